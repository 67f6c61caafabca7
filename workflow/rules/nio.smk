# NIO: styles learnt from one motion each, judged by converged solves, and what the paper shows of it.


rule learn_style:
    input:
        motion=MOTIONS / "captured/{clip}_physical.npz",
        code=RESULTS / "dynamics/library.json",
        second_order=RESULTS / "dynamics/second_order.json",
        schema=ROOT / "workflow/schemas/nio.schema.json",
    output:
        style=RESULTS / "styles/{algorithm}/{clip}.json",
        initial=RESULTS / "nio/initial/{algorithm}/{clip}.json",
        rows=RESULTS / "nio/learning/{algorithm}/{clip}.json",
    log:
        LOGS / "nio/learning/{algorithm}/{clip}.log",
    benchmark:
        BENCHMARKS / "nio/learning/{algorithm}/{clip}.tsv"
    wildcard_constraints:
        algorithm="|".join(name for name in LEARNERS if name != "least_squares"),
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1500,
    params:
        library=library(
            "body", "motion", "dynamics", "spacetime", "nio", "evaluation/nio/learners.py"
        ),
        sheet=NIO["styles"],
        row=lambda wildcards: style_text(wildcards.clip),
        settings_file=NIO["settings"],
        settings=lambda wildcards: learning_settings(wildcards.algorithm),
        schedule=NIO["schedule"],
        paper_iterations=NIO["paper_iterations"],
    script:
        "../scripts/learn_style.py"


use rule learn_style as learn_style_by_least_squares with:
    input:
        motion=MOTIONS / "captured/{clip}_physical.npz",
        code=RESULTS / "dynamics/library.json",
        second_order=RESULTS / "dynamics/second_order.json",
        schema=ROOT / "workflow/schemas/nio.schema.json",
        budget=RESULTS / "nio/learning/paper/{clip}.json",
    output:
        style=RESULTS / "styles/{algorithm}/{clip}.json",
        initial=RESULTS / "nio/initial/{algorithm}/{clip}.json",
        rows=RESULTS / "nio/learning/{algorithm}/{clip}.json",
    log:
        LOGS / "nio/learning/{algorithm}/{clip}.log",
    benchmark:
        BENCHMARKS / "nio/learning/{algorithm}/{clip}.tsv"
    wildcard_constraints:
        algorithm="least_squares",


rule judge_style:
    input:
        unpack(judged_inputs),
        motion=MOTIONS / "captured/{clip}_physical.npz",
        code=RESULTS / "dynamics/library.json",
        second_order=RESULTS / "dynamics/second_order.json",
    output:
        rows=RESULTS / "nio/judged/{kind}/{clip}.json",
        motion=RESULTS / "nio/motions/{kind}/{clip}.npz",
        motion_sidecar=RESULTS / "nio/motions/{kind}/{clip}.json",
        target=RESULTS / "nio/motions/{kind}/{clip}_target.npz",
        target_sidecar=RESULTS / "nio/motions/{kind}/{clip}_target.json",
    log:
        LOGS / "nio/judged/{kind}/{clip}.log",
    benchmark:
        BENCHMARKS / "nio/judged/{kind}/{clip}.tsv"
    wildcard_constraints:
        kind="|".join(KINDS),
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1500,
    params:
        library=library("body", "motion", "dynamics", "spacetime", "nio", "evaluation/nio/kinds.py"),
        sheet=NIO["styles"],
        row=lambda wildcards: style_text(wildcards.clip),
        perturbed=NIO["perturbed"],
    script:
        "../scripts/judge_style.py"


rule nio_learning_table:
    input:
        learnt=[RESULTS / f"nio/learning/{name}/{row.clip}.json" for row, name in LEARNT],
        judged=[RESULTS / f"nio/judged/{kind}/{row.clip}.json" for row, kind in JUDGED],
    output:
        table=RESULTS / "tables/nio_learning.csv",
    log:
        LOGS / "nio_learning_table.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        library=library("evaluation/nio/learning_table.py"),
        config=CONFIG["name"],
    script:
        "../scripts/nio_learning_table.py"


rule nio_resynthesis_table:
    input:
        judged=[RESULTS / f"nio/judged/{kind}/{row.clip}.json" for row, kind in JUDGED],
    output:
        table=RESULTS / "tables/resynthesis.csv",
    log:
        LOGS / "nio_resynthesis_table.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        library=library("evaluation/nio/learning_table.py"),
        config=CONFIG["name"],
    script:
        "../scripts/nio_resynthesis_table.py"


rule style_parameters_table:
    input:
        styles=[RESULTS / f"styles/{name}/{STYLES[id].clip}.json" for id, name in LEARNT_KEYS],
        initial=[RESULTS / f"nio/initial/{name}/{STYLES[id].clip}.json" for id, name in LEARNT_KEYS],
    output:
        table=RESULTS / "tables/style_parameters.csv",
    log:
        LOGS / "style_parameters_table.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        library=library("evaluation/nio/style_parameters.py", "spacetime/style.py"),
        sheet=NIO["styles"],
        keys_of=LEARNT_KEYS,
        config=CONFIG["name"],
    script:
        "../scripts/style_parameters_table.py"


if STYLES:

    rule nio_segment:
        input:
            motion=MOTIONS / f"captured/{FIRST_STYLE.clip}_physical.npz",
            style=RESULTS / f"styles/ours/{FIRST_STYLE.clip}.json",
            before=RESULTS / f"nio/motions/initial/{FIRST_STYLE.clip}.npz",
            after=RESULTS / f"nio/motions/ours/{FIRST_STYLE.clip}.npz",
            code=RESULTS / "dynamics/library.json",
            second_order=RESULTS / "dynamics/second_order.json",
        output:
            found=RESULTS / "nio/segment.json",
        log:
            LOGS / "nio/segment.log",
        benchmark:
            BENCHMARKS / "nio/segment.tsv"
        conda:
            "../envs/motionstyle.yaml"
        threads: 1
        resources:
            mem_mb=1500,
        params:
            library=library(
                *("body", "motion", "dynamics", "spacetime", "nio"),
                *("evaluation/nio/gradient_cost.py", "evaluation/spacetime/landscape.py"),
            ),
            sheet=NIO["styles"],
            clip=FIRST_STYLE.clip,
            row=style_text(FIRST_STYLE.clip),
            solves=NIO["difference_solves"],
        script:
            "../scripts/nio_segment.py"

    rule figure_checks_table:
        input:
            styles=[RESULTS / f"styles/{name}/{STYLES[id].clip}.json" for id, name in LEARNT_KEYS],
            segment=RESULTS / "nio/segment.json",
        output:
            table=RESULTS / "tables/figure_checks.csv",
        log:
            LOGS / "figure_checks_table.log",
        conda:
            "../envs/motionstyle.yaml"
        threads: 1
        resources:
            mem_mb=500,
        params:
            library=library(
                *(
                    "evaluation/nio/checks.py",
                    "evaluation/nio/likelihood.py",
                    "spacetime/style.py",
                ),
                *("dynamics/passive.py", "dynamics/shoes.py"),
            ),
            keys_of=LEARNT_KEYS,
            config=CONFIG["name"],
        script:
            "../scripts/figure_checks_table.py"

    rule figures_nio:
        input:
            styles=[RESULTS / f"styles/{name}/{STYLES[id].clip}.json" for id, name in LEARNT_KEYS],
            initial=RESULTS / f"nio/initial/ours/{FIRST_STYLE.clip}.json",
            segment=RESULTS / "nio/segment.json",
            table=RESULTS / "tables/nio_learning.csv",
        output:
            **{
                f"{name}_{kind}": RESULTS / f"figures/{name}.{kind}"
                for name in (
                    *("nio_springs", "nio_segment", "nio_learning", "nio_likelihood"),
                    *("style_sides", "style_compared"),
                )
                for kind in ("svg", "png")
            },
        log:
            LOGS / "figures/nio.log",
        conda:
            "../envs/motionstyle.yaml"
        threads: 1
        resources:
            mem_mb=1000,
        params:
            library=library("evaluation/nio", "figures", "dynamics/passive.py", "dynamics/shoes.py"),
            sheet=NIO["styles"],
            keys_of=LEARNT_KEYS,
            first=FIRST_STYLE.id,
            shown=[row.id for row in SHOWN_STYLES],
        script:
            "../scripts/figures_nio.py"

    rule figure_resynthesis:
        input:
            motions=[RESULTS / f"nio/motions/{kind}/{row.clip}.npz" for row, kind in FIRST_JUDGED],
            rows=[RESULTS / f"nio/judged/{kind}/{row.clip}.json" for row, kind in FIRST_JUDGED],
        output:
            svg=RESULTS / "figures/resynthesis.svg",
            png=RESULTS / "figures/resynthesis.png",
        log:
            LOGS / "figures/resynthesis.log",
        conda:
            "../envs/motionstyle.yaml"
        threads: 1
        resources:
            mem_mb=1000,
        params:
            library=library("body", "motion", "figures", "evaluation/nio/kinds.py"),
            style=FIRST_STYLE.id,
            kinds=[kind for _, kind in FIRST_JUDGED],
        script:
            "../scripts/figure_resynthesis.py"


if TWIN_STYLES:

    rule style_twin:
        input:
            motion=MOTIONS / f"captured/{STYLES[NIO['twins']['style']].clip}_physical.npz",
            code=RESULTS / "dynamics/library.json",
            second_order=RESULTS / "dynamics/second_order.json",
            schema=ROOT / "workflow/schemas/nio.schema.json",
        output:
            rows=RESULTS / "known_truth/style_twins_{seed}_{noise}.json",
        log:
            LOGS / "known_truth/style_twins_{seed}_{noise}.log",
        benchmark:
            BENCHMARKS / "known_truth/style_twins_{seed}_{noise}.tsv"
        wildcard_constraints:
            noise="[0-9]+",
        conda:
            "../envs/motionstyle.yaml"
        threads: 1
        resources:
            mem_mb=1500,
        params:
            library=library(
                *("body", "motion", "dynamics", "spacetime", "nio", "evaluation/nio/twins.py"),
            ),
            sheet=NIO["styles"],
            clip=STYLES[NIO["twins"]["style"]].clip,
            row=style_text(STYLES[NIO["twins"]["style"]].clip),
            settings_file=NIO["settings"],
            settings=learning_settings("ours"),
            schedule=NIO["schedule"],
        script:
            "../scripts/style_twin.py"

    rule figure_identifiability:
        input:
            rows=TWIN_STYLES,
        output:
            svg=RESULTS / "figures/nio_identifiability.svg",
            png=RESULTS / "figures/nio_identifiability.png",
        log:
            LOGS / "figures/nio_identifiability.log",
        conda:
            "../envs/motionstyle.yaml"
        threads: 1
        resources:
            mem_mb=1000,
        params:
            library=library("figures/nio.py", "figures/style.py"),
        script:
            "../scripts/figure_identifiability.py"
