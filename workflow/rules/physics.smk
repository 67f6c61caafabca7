# Generated dynamics, and motions that obey Newton.


rule dynamics_code:
    output:
        library=RESULTS / "dynamics/library.json",
    log:
        LOGS / "dynamics_code.log",
    benchmark:
        BENCHMARKS / "dynamics_code.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=2500,
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
        library=library("body", "motion", "dynamics", "spacetime"),
        physical=CONFIG["physical"],
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
