# Numbers on motions, and the ledger of claims.


rule gait_tables:
    input:
        motions=[MOTIONS / f"captured/{id}.npz" for id in CLIPS if "gait" in CLIPS[id].experiments],
        normative=CONFIG["normative"],
        library=library("body", "motion", "evaluation"),
    output:
        gait=RESULTS / "tables/gait.csv",
        bands=RESULTS / "tables/gait_bands.csv",
    params:
        config=CONFIG["name"],
    log:
        LOGS / "gait_tables.log",
    threads: 1
    resources:
        mem_mb=1000,
    script:
        "../scripts/gait_tables.py"


rule claims:
    input:
        claims=CONFIG["claims"],
        schema=ROOT / "workflow/schemas/claims.schema.json",
        tables=TABLES,
        library=library("evaluation"),
    output:
        table=RESULTS / "tables/claims.csv",
    params:
        results=str(RESULTS),
    log:
        LOGS / "claims.log",
    threads: 1
    resources:
        mem_mb=500,
    script:
        "../scripts/claims.py"
