# What the spacetime problem's choices do, how E lies between captured motion and optimum, and growth.


rule sensitivity:
    input:
        motion=MOTIONS / f"captured/{STUDY['clip']}_physical.npz",
        code=RESULTS / "dynamics/library.json",
        second_order=RESULTS / "dynamics/second_order.json",
    output:
        rows=RESULTS / "sensitivity/{choice}.json",
    log:
        LOGS / "sensitivity/{choice}.log",
    benchmark:
        BENCHMARKS / "sensitivity/{choice}.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1500,
    params:
        library=library(
            *("body", "motion", "dynamics", "spacetime", "evaluation/spacetime/sensitivity.py"),
            "evaluation/spacetime/landscape.py",
            "nio/learning_problem.py",
        ),
        study={name: STUDY[name] for name in STUDY if name not in ("choices", "growth")},
    script:
        "../scripts/sensitivity.py"


rule sensitivity_table:
    input:
        rows=[RESULTS / f"sensitivity/{choice}.json" for choice in CHOICES],
    output:
        table=RESULTS / "tables/spacetime_sensitivity.csv",
    log:
        LOGS / "sensitivity_table.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        library=library("evaluation/spacetime/sensitivity.py"),
        config=CONFIG["name"],
    script:
        "../scripts/sensitivity_table.py"


rule figure_landscape:
    input:
        rows=RESULTS / "sensitivity/base.json",
    output:
        svg=RESULTS / "figures/landscape.svg",
        png=RESULTS / "figures/landscape.png",
    log:
        LOGS / "figures/landscape.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("figures/landscape.py", "figures/style.py"),
    script:
        "../scripts/figure_landscape.py"


rule growth:
    input:
        motion=MOTIONS / f"captured/{STUDY['clip']}_physical.npz",
        code=RESULTS / "dynamics/library.json",
        second_order=RESULTS / "dynamics/second_order.json",
    output:
        rows=RESULTS / "growth/{frames}.json",
    log:
        LOGS / "growth/{frames}.log",
    benchmark:
        BENCHMARKS / "growth/{frames}.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1500,
    params:
        library=library(
            *("body", "motion", "dynamics", "spacetime", "evaluation/spacetime/growth.py"),
        ),
        study={"clip": STUDY["clip"], **STUDY["growth"]},
    script:
        "../scripts/growth.py"


rule growth_table:
    input:
        rows=[RESULTS / f"growth/{frames}.json" for frames in STUDY["growth"]["frames"]],
    output:
        table=RESULTS / "tables/solver_growth.csv",
    log:
        LOGS / "growth_table.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        library=library("evaluation/spacetime/growth.py"),
        config=CONFIG["name"],
    script:
        "../scripts/growth_table.py"
