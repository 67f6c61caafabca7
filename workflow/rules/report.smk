# Figures, the page, what is published, and whether all clips could be read.


rule figure_body:
    input:
        motions=[MOTIONS / f"captured/{id}.npz" for id in SHOWN["body"]],
    output:
        svg=RESULTS / "figures/body.svg",
        png=RESULTS / "figures/body.png",
        table=RESULTS / "tables/body.csv",
    log:
        LOGS / "figures/body.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("body", "motion", "evaluation", "figures"),
        config=CONFIG["name"],
    script:
        "../scripts/figure_body.py"


rule figure_strips:
    input:
        motions=[MOTIONS / f"captured/{id}.npz" for id in SHOWN["strips"]],
    output:
        svg=RESULTS / "figures/strips.svg",
        png=RESULTS / "figures/strips.png",
    log:
        LOGS / "figures/strips.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("body", "motion", "evaluation", "figures"),
    script:
        "../scripts/figure_strips.py"


use rule figure_strips as figure_planted with:
    input:
        motions=[
            MOTIONS / f"planted/{id}.npz" for id in list(PLANTED)[:: max(1, len(PLANTED) // 6)]
        ],
    output:
        svg=RESULTS / "figures/planted.svg",
        png=RESULTS / "figures/planted.png",
    log:
        LOGS / "figures/planted.log",
    params:
        library=library("body", "motion", "evaluation", "figures"),


rule figure_gait:
    input:
        motions=[MOTIONS / f"captured/{id}.npz" for id in SHOWN["gait"]],
        normative=CONFIG["normative"],
    output:
        svg=RESULTS / "figures/gait.svg",
        png=RESULTS / "figures/gait.png",
    log:
        LOGS / "figures/gait.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("body", "motion", "evaluation", "figures"),
    script:
        "../scripts/figure_gait.py"


rule figure_markers:
    input:
        quality=[RESULTS / f"quality/{id}.json" for id in SHOWN["markers"]],
    output:
        svg=RESULTS / "figures/markers.svg",
        png=RESULTS / "figures/markers.png",
    log:
        LOGS / "figures/markers.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("body", "motion", "evaluation", "figures"),
    script:
        "../scripts/figure_markers.py"


rule report:
    input:
        clips=RESULTS / "tables/clips.csv",
        motions=RESULTS / "tables/motions.csv",
        claims_table=RESULTS / "tables/claims.csv",
        tables=TABLES,
        claims=CONFIG["claims"],
        schema=ROOT / "workflow/schemas/claims.schema.json",
        captions=ROOT / "workflow/report/captions.yaml",
        figures=[RESULTS / f"figures/{name}.png" for name in FIGURES],
    output:
        page=RESULTS / "report.html",
    log:
        LOGS / "report.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("evaluation", "report"),
        config=CONFIG["name"],
        data=CONFIG["name"] if all(row.dataset for row in CLIPS.values()) else "own",
    script:
        "../scripts/report.py"


rule check_clips:
    input:
        clips=RESULTS / "tables/clips.csv",
        report=RESULTS / "report.html",
    output:
        stamp=RESULTS / "status/clips.ok",
    log:
        LOGS / "check_clips.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=200,
    params:
        allow=CONFIG["allow_failed_clips"],
    script:
        "../scripts/check_clips.py"


rule publish:
    input:
        tables=[
            RESULTS / f"tables/{name}.csv"
            for name in (
                *("body", "clips", "gait_angles", "gait", "claims"),
                *("physical", "force_plates", "joint_moments", "plate_moments", "root_residual"),
                *(
                    "benchmark_dynamics",
                    "shmm_benchmark",
                    "syntheses",
                    "ramp_gait",
                    "solver_comparison",
                ),
                *SHMM_TABLES,
                *SOLVER_TABLES,
                *NIO_TABLES,
                *(SIMILARITY_TABLES if SIMILAR else ()),
            )
        ],
        figures=[RESULTS / f"figures/{name}.png" for name in FIGURES],
        stamp=RESULTS / "status/clips.ok",
        datasets=CONFIG["datasets"],
    log:
        LOGS / "publish.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=200,
    params:
        config=CONFIG["name"],
        folder=str(ROOT / "results/published"),
        used=sorted({(row.dataset or "own", row.path) for row in CLIPS.values()}),
    script:
        "../scripts/publish.py"
