# Style machines: models of motion with a space of styles (Brand & Hertzmann 2000).


rule shmm_gaits:
    input:
        motions=shmm_inputs("explained_variance", "draws", "gaits"),
    output:
        explained_variance=RESULTS / "tables/explained_variance.csv",
        style_dof=RESULTS / "tables/style_dof.csv",
        motions=shmm_motions("gaits"),
        sidecars=[file.with_suffix(".json") for file in shmm_motions("gaits")],
        rows=SHMM / "gaits.json",
        arrays=SHMM / "gaits.npz",
    log:
        LOGS / "shmm/gaits.log",
    benchmark:
        BENCHMARKS / "shmm/gaits.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=2000,
    params:
        library=library("body", "motion", "mocap", "shmm", "evaluation"),
        plan=shmm_plan("locomotion", "explained_variance", "draws", "gaits"),
        pool=SHMM_POOL,
        contacts=shmm_contacts(SHMM_PLAN["gait_action"]),
        config=CONFIG["name"],
    script:
        "../scripts/shmm_gaits.py"


rule shmm_analogies:
    input:
        motions=shmm_inputs("analogies"),
    output:
        analogies=RESULTS / "tables/analogies.csv",
    log:
        LOGS / "shmm/analogies.log",
    benchmark:
        BENCHMARKS / "shmm/analogies.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=2000,
    params:
        library=library("body", "motion", "mocap", "shmm", "evaluation"),
        plan=shmm_plan("locomotion", "analogies", "analogy_variants"),
        config=CONFIG["name"],
    script:
        "../scripts/shmm_analogies.py"


rule shmm_held_out:
    input:
        motions=shmm_inputs("held_out"),
    output:
        held_out=RESULTS / "tables/held_out.csv",
    log:
        LOGS / "shmm/held_out.log",
    benchmark:
        BENCHMARKS / "shmm/held_out.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=2000,
    params:
        library=library("body", "motion", "mocap", "shmm", "evaluation"),
        plan=shmm_plan("locomotion", "held_out"),
        config=CONFIG["name"],
    script:
        "../scripts/shmm_held_out.py"


rule shmm_dances:
    input:
        motions=shmm_inputs("dances", "novice"),
    output:
        dance_model=RESULTS / "tables/dance_model.csv",
        novice=RESULTS / "tables/novice.csv",
        motions=shmm_motions("dances"),
        sidecars=[file.with_suffix(".json") for file in shmm_motions("dances")],
        rows=SHMM / "dances.json",
        arrays=SHMM / "dances.npz",
    log:
        LOGS / "shmm/dances.log",
    benchmark:
        BENCHMARKS / "shmm/dances.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=2000,
    params:
        library=library("body", "motion", "mocap", "shmm", "evaluation"),
        plan=shmm_plan("dance", "dances", "novice"),
        contacts=shmm_contacts(SHMM_PLAN["dance_action"]),
        config=CONFIG["name"],
    script:
        "../scripts/shmm_dances.py"


rule shmm_driving:
    input:
        motions=shmm_inputs("driving"),
    output:
        path_map=RESULTS / "tables/path_map.csv",
        motions=shmm_motions("driving"),
        sidecars=[file.with_suffix(".json") for file in shmm_motions("driving")],
        arrays=SHMM / "driving.npz",
    log:
        LOGS / "shmm/driving.log",
    benchmark:
        BENCHMARKS / "shmm/driving.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=2000,
    params:
        library=library("body", "motion", "mocap", "shmm", "evaluation"),
        plan=shmm_plan("dance", "driving"),
        contacts=shmm_contacts(SHMM_PLAN["dance_action"]),
        config=CONFIG["name"],
    script:
        "../scripts/shmm_driving.py"


rule shmm_checks:
    input:
        motions=shmm_inputs("three_walks", "explained_variance"),
    output:
        shmm_figure_checks=RESULTS / "tables/shmm_figure_checks.csv",
        shmm_sensitivity=RESULTS / "tables/shmm_sensitivity.csv",
        arrays=SHMM / "checks.npz",
    log:
        LOGS / "shmm/checks.log",
    benchmark:
        BENCHMARKS / "shmm/checks.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=2000,
    params:
        library=library("body", "motion", "mocap", "shmm", "evaluation"),
        plan=shmm_plan("locomotion", "explained_variance", "three_walks", "seeds", "sensitivity"),
        config=CONFIG["name"],
    script:
        "../scripts/shmm_checks.py"


rule shmm_twin:
    output:
        table=RESULTS / "tables/shmm_twin.csv",
    log:
        LOGS / "shmm/twin.log",
    benchmark:
        BENCHMARKS / "shmm/twin.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("body", "motion", "shmm", "evaluation"),
        plan=shmm_plan("twin"),
        config=CONFIG["name"],
    script:
        "../scripts/shmm_twin.py"


rule shmm_syntheses:
    input:
        rows=[SHMM / "gaits.json", SHMM / "dances.json"],
    output:
        table=RESULTS / "tables/shmm_syntheses.csv",
    log:
        LOGS / "shmm/syntheses.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        library=library("evaluation"),
    script:
        "../scripts/shmm_syntheses.py"


rule shmm_benchmark:
    input:
        motions=[SHMM_SOURCES[id] for id in next(iter(SHMM_PLAN["dances"].values()), [])],
    output:
        table=RESULTS / "tables/shmm_benchmark.csv",
    log:
        LOGS / "shmm/benchmark.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=4000,
    params:
        library=library("body", "motion", "shmm", "evaluation"),
        plan=shmm_plan("dance"),
    script:
        "../scripts/shmm_benchmark.py"


rule shmm_figures:
    input:
        tables=[
            RESULTS / f"tables/{name}.csv"
            for name in (
                *("shmm_figure_checks", "dance_model", "explained_variance", "style_dof"),
                *("analogies", "held_out", "path_map", "shmm_twin", "novice"),
            )
        ],
        gaits=SHMM / "gaits.npz",
        dances=SHMM / "dances.npz",
        driving=SHMM / "driving.npz",
        checks=SHMM / "checks.npz",
    output:
        svg=[RESULTS / f"figures/{name}.svg" for name in SHMM_FIGURES],
        png=[RESULTS / f"figures/{name}.png" for name in SHMM_FIGURES],
    log:
        LOGS / "figures/shmm.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1500,
    params:
        library=library("body", "motion", "shmm", "evaluation", "figures"),
    script:
        "../scripts/shmm_figures.py"


rule shmm_strips:
    input:
        motions=lambda wildcards: shmm_shown(wildcards.strip),
    output:
        svg=RESULTS / "figures/{strip}.svg",
        png=RESULTS / "figures/{strip}.png",
    log:
        LOGS / "figures/{strip}.log",
    wildcard_constraints:
        strip="|".join(SHMM_STRIPS),
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1500,
    params:
        library=library("body", "motion", "evaluation", "figures"),
        view=lambda wildcards: SHMM_STRIPS[wildcards.strip][1],
        number=lambda wildcards: SHMM_STRIPS[wildcards.strip][2],
    script:
        "../scripts/shmm_strips.py"
