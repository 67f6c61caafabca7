# Generated dynamics, and motions that obey Newton.

from motionstyle.evaluation.force_study import read_study

# Variants of the physics fit's settings, and the clips on which they are compared.
try:
    FORCE_STUDY = read_study(located("config/force_study.yaml"))
except MotionStyleError as error:
    raise WorkflowError(str(error)) from None
STUDIED = [id for id in FORCE_STUDY["development"] if id in PLATES]
TABLES += [RESULTS / "tables/force_plate_study.csv"] if STUDIED else []


rule dynamics_code:
    output:
        library=RESULTS / "dynamics/library.json",
        second_order=RESULTS / "dynamics/second_order.json",
    log:
        LOGS / "dynamics_code.log",
    benchmark:
        BENCHMARKS / "dynamics_code.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=3000,
    params:
        library=library("body", "dynamics"),
    script:
        "../scripts/dynamics_code.py"


rule fit_physical:
    input:
        motion=MOTIONS / "captured/{clip}.npz",
        markers=RESULTS / "markers/{clip}.npz",
        code=RESULTS / "dynamics/library.json",
    output:
        motion=MOTIONS / "captured/{clip}_physical.npz",
        sidecar=MOTIONS / "captured/{clip}_physical.json",
        report=RESULTS / "physical/{clip}.json",
        diagnosis=RESULTS / "diagnosis/{clip}.json",
    log:
        LOGS / "fit_physical/{clip}.log",
    benchmark:
        BENCHMARKS / "fit_physical/{clip}.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1500,
    params:
        library=library("body", "motion", "mocap/settings.py", "dynamics", *PHYSICAL_MODULES),
        physical=lambda wildcards: {
            **CONFIG["physical"],
            **(CONFIG["force_plates"] if wildcards.clip in PLATES else {}),
        },
    script:
        "../scripts/fit_physical.py"


rule physical_table:
    input:
        reports=[RESULTS / f"physical/{id}.json" for id in PHYSICAL],
    output:
        table=RESULTS / "tables/physical.csv",
    log:
        LOGS / "physical_table.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        library=library("evaluation"),
        config=CONFIG["name"],
    script:
        "../scripts/physical_table.py"


rule compare_plates:
    input:
        motion=MOTIONS / "captured/{clip}_physical.npz",
        forces=lambda wildcards: companion(wildcards.clip, "forces"),
        map=lambda wildcards: map_file(CLIPS[wildcards.clip]),
    output:
        rows=RESULTS / "force_plates/{clip}.json",
    log:
        LOGS / "compare_plates/{clip}.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("body", "motion", "mocap", "evaluation"),
        config=CONFIG["name"],
    script:
        "../scripts/compare_plates.py"


rule force_plates_table:
    input:
        rows=[RESULTS / f"force_plates/{id}.json" for id in PLATES],
    output:
        table=RESULTS / "tables/force_plates.csv",
    log:
        LOGS / "force_plates_table.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        library=library("evaluation"),
    script:
        "../scripts/force_plates_table.py"


rule figure_force_plates:
    input:
        rows=[RESULTS / f"force_plates/{id}.json" for id in PLATES],
    output:
        svg=RESULTS / "figures/force_plates.svg",
        png=RESULTS / "figures/force_plates.png",
    log:
        LOGS / "figures/force_plates.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("evaluation", "figures"),
    script:
        "../scripts/figure_force_plates.py"


rule force_study:
    input:
        motions=[MOTIONS / f"captured/{id}.npz" for id in STUDIED],
        markers=[RESULTS / f"markers/{id}.npz" for id in STUDIED],
        forces=[companion(id, "forces")[0] for id in STUDIED],
        maps=[map_file(CLIPS[id]) for id in STUDIED],
        code=RESULTS / "dynamics/library.json",
    output:
        table=RESULTS / "tables/force_plate_study.csv",
    log:
        LOGS / "force_study.log",
    benchmark:
        BENCHMARKS / "force_study.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=2000,
    params:
        library=library("body", "motion", "mocap", "dynamics", "spacetime", "evaluation"),
        study=FORCE_STUDY,
        clips=STUDIED,
        physical={**CONFIG["physical"], **CONFIG["force_plates"]},
    script:
        "../scripts/force_study.py"
