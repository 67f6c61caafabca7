# What physical motions are good for: joint moments, exports for OpenSim, figures of fit and force.


rule joint_moments:
    input:
        motions=[MOTIONS / f"captured/{id}_physical.npz" for id in PHYSICAL],
        code=RESULTS / "dynamics/library.json",
        normative=CONFIG["normative"],
        forces=sorted({str(file) for id in PLATES for file in companion(id, "forces")}),
        maps=sorted({str(map_file(CLIPS[id])) for id in PLATES}),
    output:
        moments=RESULTS / "tables/joint_moments.csv",
        plates=RESULTS / "tables/plate_moments.csv",
        curves=RESULTS / "moments/curves.json",
    log:
        LOGS / "joint_moments.log",
    benchmark:
        BENCHMARKS / "joint_moments.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("body", "motion", "mocap", "dynamics", "spacetime", "evaluation"),
        config=CONFIG["name"],
        plates={id: [str(companion(id, "forces")[0]), str(map_file(CLIPS[id]))] for id in PLATES},
    script:
        "../scripts/joint_moments.py"


rule figure_joint_moments:
    input:
        curves=RESULTS / "moments/curves.json",
        normative=CONFIG["normative"],
    output:
        svg=RESULTS / "figures/joint_moments.svg",
        png=RESULTS / "figures/joint_moments.png",
    log:
        LOGS / "figures/joint_moments.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("evaluation", "figures"),
        show="cycles",
    script:
        "../scripts/figure_joint_moments.py"


use rule figure_joint_moments as figure_plate_moments with:
    output:
        svg=RESULTS / "figures/plate_moments.svg",
        png=RESULTS / "figures/plate_moments.png",
    log:
        LOGS / "figures/plate_moments.log",
    params:
        library=library("evaluation", "figures"),
        show="stances",


rule root_residual:
    input:
        kinematic=[MOTIONS / f"captured/{id}.npz" for id in PHYSICAL],
        physical=[MOTIONS / f"captured/{id}_physical.npz" for id in PHYSICAL],
        reports=[RESULTS / f"physical/{id}.json" for id in PHYSICAL],
        code=RESULTS / "dynamics/library.json",
    output:
        table=RESULTS / "tables/root_residual.csv",
    log:
        LOGS / "root_residual.log",
    benchmark:
        BENCHMARKS / "root_residual.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("body", "motion", "dynamics", "spacetime", "evaluation"),
        config=CONFIG["name"],
        settings={id: physical_settings(id) for id in PHYSICAL},
    script:
        "../scripts/root_residual.py"


rule figure_root_residual:
    input:
        table=RESULTS / "tables/root_residual.csv",
    output:
        svg=RESULTS / "figures/root_residual.svg",
        png=RESULTS / "figures/root_residual.png",
    log:
        LOGS / "figures/root_residual.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("figures"),
    script:
        "../scripts/figure_root_residual.py"


rule figure_force_strips:
    input:
        motions=[MOTIONS / f"captured/{id}_physical.npz" for id in FORCE_STRIPS],
        reports=[RESULTS / f"physical/{id}.json" for id in FORCE_STRIPS],
    output:
        svg=RESULTS / "figures/force_strips.svg",
        png=RESULTS / "figures/force_strips.png",
    log:
        LOGS / "figures/force_strips.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("body", "motion", "evaluation", "figures"),
    script:
        "../scripts/figure_force_strips.py"


rule figure_marker_fit:
    input:
        quality=[RESULTS / f"quality/{id}.json" for id in CLIPS],
        maps=sorted({str(map_file(row)) for row in CLIPS.values() if is_markers(row)}),
    output:
        svg=RESULTS / "figures/marker_fit.svg",
        png=RESULTS / "figures/marker_fit.png",
    log:
        LOGS / "figures/marker_fit.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("mocap", "evaluation", "figures"),
        sets=[str(map_file(row)) if is_markers(row) else "" for row in CLIPS.values()],
    script:
        "../scripts/figure_marker_fit.py"


rule opensim_angles:
    input:
        motion=MOTIONS / "{kind}/{id}.npz",
    output:
        angles=RESULTS / "opensim/{kind}/{id}_angles.mot",
    log:
        LOGS / "opensim/{kind}/{id}_angles.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        library=library("body", "motion"),
        # In the full run a clip whose fit failed is a file that says so, not the run's end.
        allow_failed=lambda wildcards: wildcards.id.removesuffix("_physical") in PLATES,
    script:
        "../scripts/opensim_angles.py"


rule opensim_forces:
    input:
        motion=MOTIONS / "{kind}/{id}.npz",
        code=RESULTS / "dynamics/library.json",
    output:
        moments=RESULTS / "opensim/{kind}/{id}_moments.sto",
        forces=RESULTS / "opensim/{kind}/{id}_grf.mot",
        loads=RESULTS / "opensim/{kind}/{id}_external_loads.xml",
    log:
        LOGS / "opensim/{kind}/{id}_forces.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("body", "motion", "dynamics", "spacetime", "evaluation"),
        allow_failed=lambda wildcards: wildcards.id.removesuffix("_physical") in PLATES,
    script:
        "../scripts/opensim_forces.py"


# On demand, and for publishing: times differ from run to run, so no default output holds them.
rule benchmark_dynamics:
    input:
        motions=[MOTIONS / f"captured/{id}.npz" for id in list(CLIPS)[:3]],
        code=RESULTS / "dynamics/library.json",
    output:
        table=RESULTS / "tables/benchmark_dynamics.csv",
    log:
        LOGS / "benchmark_dynamics.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("body", "motion", "dynamics"),
        sizes={"frames": 2000, "rounds": 15, "seed": 1},
    script:
        "../scripts/benchmark_dynamics.py"
