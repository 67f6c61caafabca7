# Stylistic similarity: segments, models, validation, adaptation, and one judge for all papers.

SIMILARITY_ROOMS = ("body", "motion", "mocap", "dynamics", "similarity")
BANK = RESULTS / "similarity/bank.npz"


rule similarity_bank:
    input:
        motions=[MOTIONS / f"{id}.npz" for id in SIMILAR],
        settings=CONFIG["similarity"],
    output:
        bank=BANK,
        sidecar=BANK.with_suffix(".json"),
        alignments=RESULTS / "tables/similarity_alignments.csv",
    log:
        LOGS / "similarity_bank.log",
    benchmark:
        BENCHMARKS / "similarity_bank.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1500,
    params:
        library=library(*SIMILARITY_ROOMS),
        settings=SIMILARITY,
    script:
        "../scripts/similarity_bank.py"


rule similarity_study:
    input:
        bank=BANK,
        sidecar=BANK.with_suffix(".json"),
    output:
        sets=RESULTS / "tables/similarity_sets.csv",
        subspaces=RESULTS / "tables/leg_subspaces.csv",
        leakage=RESULTS / "tables/leakage.csv",
        svm=RESULTS / "tables/one_class_svm.csv",
        held_out=RESULTS / "similarity/held_out.npz",
    log:
        LOGS / "similarity_study.log",
    benchmark:
        BENCHMARKS / "similarity_study.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1500,
    params:
        library=library(*SIMILARITY_ROOMS),
        settings=SIMILARITY,
        config=CONFIG["name"],
    script:
        "../scripts/similarity_study.py"


rule discrimination:
    input:
        bank=BANK,
        sidecar=BANK.with_suffix(".json"),
    output:
        table=RESULTS / "tables/discrimination.csv",
    log:
        LOGS / "discrimination.log",
    benchmark:
        BENCHMARKS / "discrimination.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1500,
    params:
        library=library(*SIMILARITY_ROOMS),
        settings=SIMILARITY,
        config=CONFIG["name"],
    script:
        "../scripts/discrimination.py"


rule dose_response:
    input:
        bank=BANK,
        sidecar=BANK.with_suffix(".json"),
    output:
        table=RESULTS / "tables/dose_response.csv",
        points=RESULTS / "tables/dose_points.csv",
    log:
        LOGS / "dose_response.log",
    benchmark:
        BENCHMARKS / "dose_response.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1500,
    params:
        library=library(*SIMILARITY_ROOMS),
        settings=SIMILARITY,
        config=CONFIG["name"],
    script:
        "../scripts/dose_response.py"


rule adapt:
    input:
        bank=BANK,
        sidecar=BANK.with_suffix(".json"),
        example=lambda wildcards: MOTIONS / f"captured/{TASKS[wildcards.task].example}.npz",
    output:
        full=MOTIONS / "adapted/{task}.npz",
        full_sidecar=MOTIONS / "adapted/{task}.json",
        ablated=MOTIONS / "adapted/{task}_without_style.npz",
        ablated_sidecar=MOTIONS / "adapted/{task}_without_style.json",
        report=RESULTS / "similarity/adaptations/{task}.json",
    log:
        LOGS / "adapt/{task}.log",
    benchmark:
        BENCHMARKS / "adapt/{task}.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1500,
    params:
        library=library(*SIMILARITY_ROOMS),
        settings=SIMILARITY,
        config=CONFIG["name"],
        task=lambda wildcards: asdict(TASKS[wildcards.task]),
    script:
        "../scripts/adapt.py"


rule adaptations_table:
    input:
        reports=[RESULTS / f"similarity/adaptations/{task}.json" for task in TASKS],
    output:
        table=RESULTS / "tables/adaptations.csv",
    log:
        LOGS / "adaptations_table.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        library=library("similarity"),
    script:
        "../scripts/adaptations_table.py"


rule style_judgement:
    input:
        bank=BANK,
        sidecar=BANK.with_suffix(".json"),
        motions=lambda wildcards: made_motions(),
        examples=[f for f in motion_files() if f.parent.name in {"captured", "planted"}],
    output:
        table=RESULTS / "tables/style_judgement.csv",
    log:
        LOGS / "style_judgement.log",
    benchmark:
        BENCHMARKS / "style_judgement.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1500,
    params:
        library=library(*SIMILARITY_ROOMS),
        settings=SIMILARITY,
        config=CONFIG["name"],
    script:
        "../scripts/style_judgement.py"


rule figure_similarity_features:
    input:
        motions=[MOTIONS / f"{id}.npz" for id in SIMILAR],
    output:
        svg=RESULTS / "figures/similarity_features.svg",
        png=RESULTS / "figures/similarity_features.png",
    log:
        LOGS / "figures/similarity_features.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library(*SIMILARITY_ROOMS, "evaluation", "figures"),
        settings=SIMILARITY,
    script:
        "../scripts/figure_similarity_features.py"


rule figure_leg_subspaces:
    input:
        table=RESULTS / "tables/leg_subspaces.csv",
    output:
        svg=RESULTS / "figures/leg_subspaces.svg",
        png=RESULTS / "figures/leg_subspaces.png",
    log:
        LOGS / "figures/leg_subspaces.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library(*SIMILARITY_ROOMS, "evaluation", "figures"),
    script:
        "../scripts/figure_leg_subspaces.py"


rule figure_leakage:
    input:
        table=RESULTS / "tables/leakage.csv",
        held_out=RESULTS / "similarity/held_out.npz",
    output:
        svg=RESULTS / "figures/leakage.svg",
        png=RESULTS / "figures/leakage.png",
    log:
        LOGS / "figures/leakage.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library(*SIMILARITY_ROOMS, "evaluation", "figures"),
    script:
        "../scripts/figure_leakage.py"


rule figure_discrimination:
    input:
        table=RESULTS / "tables/discrimination.csv",
    output:
        svg=RESULTS / "figures/discrimination.svg",
        png=RESULTS / "figures/discrimination.png",
    log:
        LOGS / "figures/discrimination.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library(*SIMILARITY_ROOMS, "evaluation", "figures"),
    script:
        "../scripts/figure_discrimination.py"


rule figure_dose_response:
    input:
        points=RESULTS / "tables/dose_points.csv",
    output:
        svg=RESULTS / "figures/dose_response.svg",
        png=RESULTS / "figures/dose_response.png",
    log:
        LOGS / "figures/dose_response.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library(*SIMILARITY_ROOMS, "evaluation", "figures"),
    script:
        "../scripts/figure_dose_response.py"


rule figure_adaptation_triptych:
    input:
        examples=[MOTIONS / f"captured/{task.example}.npz" for task in TASKS.values()],
        motions=[MOTIONS / f"adapted/{id}.npz" for id in ADAPTED],
        table=RESULTS / "tables/adaptations.csv",
    output:
        svg=RESULTS / "figures/adaptation_triptych.svg",
        png=RESULTS / "figures/adaptation_triptych.png",
    log:
        LOGS / "figures/adaptation_triptych.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library(*SIMILARITY_ROOMS, "evaluation", "figures"),
        settings=SIMILARITY,
        tasks=[asdict(task) for task in TASKS.values()],
    script:
        "../scripts/figure_adaptation_triptych.py"


rule figure_adaptation_strips:
    input:
        motions=[MOTIONS / f"adapted/{id}.npz" for id in ADAPTED],
        table=RESULTS / "tables/adaptations.csv",
    output:
        svg=RESULTS / "figures/adaptation_strips.svg",
        png=RESULTS / "figures/adaptation_strips.png",
    log:
        LOGS / "figures/adaptation_strips.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library(*SIMILARITY_ROOMS, "evaluation", "figures"),
    script:
        "../scripts/figure_adaptation_strips.py"
