# Numbers on motions, and the ledger of claims.


rule gait_tables:
    input:
        motions=[MOTIONS / f"captured/{id}.npz" for id in CLIPS if "gait" in CLIPS[id].experiments],
        normative=CONFIG["normative"],
    output:
        gait=RESULTS / "tables/gait.csv",
        angles=RESULTS / "tables/gait_angles.csv",
    log:
        LOGS / "gait_tables.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("body", "motion", "evaluation"),
        config=CONFIG["name"],
    script:
        "../scripts/gait_tables.py"


rule claims:
    input:
        claims=CONFIG["claims"],
        schema=ROOT / "workflow/schemas/claims.schema.json",
        tables=TABLES,
    output:
        table=RESULTS / "tables/claims.csv",
    log:
        LOGS / "claims.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        library=library("evaluation"),
    script:
        "../scripts/claims.py"
