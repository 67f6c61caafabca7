# Solver designs on the same problems, and how far starts spread.


rule compare_solvers:
    input:
        unpack(lambda wildcards: synthesis_motions(SYNTHESES[wildcards.synthesis])),
        table=RESULTS / "footprints/{synthesis}.tsv",
        status=RESULTS / "footprints/{synthesis}.json",
        style=lambda wildcards: style_of(SYNTHESES[wildcards.synthesis]),
        code=RESULTS / "dynamics/library.json",
        second_order=RESULTS / "dynamics/second_order.json",
    output:
        rows=RESULTS / "solvers/{synthesis}.json",
    log:
        LOGS / "solvers/{synthesis}.log",
    benchmark:
        BENCHMARKS / "solvers/{synthesis}.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=3000,
    params:
        library=library("body", "motion", "dynamics", "spacetime"),
        sheet=CONFIG["syntheses"],
        row=lambda wildcards: synthesis_text(wildcards.synthesis),
        comparison=CONFIG["solver_comparison"],
    script:
        "../scripts/compare_solvers.py"


rule solver_comparison_table:
    input:
        rows=[RESULTS / f"solvers/{id}.json" for id in COMPARED],
    output:
        table=RESULTS / "tables/solver_comparison.csv",
    log:
        LOGS / "solver_comparison_table.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        library=library("spacetime"),
    script:
        "../scripts/solver_comparison_table.py"


rule figure_solvers:
    input:
        rows=[RESULTS / f"solvers/{id}.json" for id in COMPARED],
    output:
        svg=RESULTS / "figures/solvers.svg",
        png=RESULTS / "figures/solvers.png",
    log:
        LOGS / "figures/solvers.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("spacetime", "figures"),
    script:
        "../scripts/figure_solvers.py"
