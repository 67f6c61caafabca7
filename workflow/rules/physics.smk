# Generated dynamics, and motions that obey Newton.


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
        code=RESULTS / "dynamics/library.json",
    output:
        motion=MOTIONS / "captured/{clip}_physical.npz",
        sidecar=MOTIONS / "captured/{clip}_physical.json",
        report=RESULTS / "physical/{clip}.json",
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
        library=library("body", "motion", "dynamics", *PHYSICAL_MODULES),
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
