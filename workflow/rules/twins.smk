# Styles nobody learnt, and what is known of the solver beforehand: known optima and twins.


rule hand_style:
    input:
        motion=MOTIONS / "captured/{clip}_physical.npz",
        table=CONFIG["hand_style"],
    output:
        style=RESULTS / "styles/hand/{clip}.json",
    log:
        LOGS / "styles/hand/{clip}.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        library=library("body", "motion", "spacetime/made_styles.py", "spacetime/style.py"),
    script:
        "../scripts/hand_style.py"


rule twin_style:
    input:
        style=RESULTS / "styles/initial/{clip}.json",
    output:
        style=RESULTS / "styles/twin/{clip}.json",
    log:
        LOGS / "styles/twin/{clip}.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        library=library("spacetime/made_styles.py", "spacetime/style.py"),
        seed=CONFIG["twins"]["seeds"][0],
    script:
        "../scripts/twin_style.py"


rule twins:
    input:
        unpack(lambda wildcards: synthesis_motions(SYNTHESES[TWINS["problem"]])),
        table=lambda wildcards: RESULTS / f"footprints/{TWINS['problem']}.tsv",
        status=lambda wildcards: RESULTS / f"footprints/{TWINS['problem']}.json",
        style=lambda wildcards: RESULTS
        / f"styles/initial/{SYNTHESES[TWINS['problem']].style_clip}.json",
        code=RESULTS / "dynamics/library.json",
        second_order=RESULTS / "dynamics/second_order.json",
    output:
        rows=RESULTS / "known_truth/twins_{seed}.json",
        style=RESULTS / "known_truth/twins_{seed}_style.json",
        motion=RESULTS / "known_truth/twins_{seed}.npz",
    log:
        LOGS / "known_truth/twins_{seed}.log",
    benchmark:
        BENCHMARKS / "known_truth/twins_{seed}.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1500,
    params:
        library=library("body", "motion", "dynamics", "spacetime", "evaluation/spacetime/twins.py"),
        sheet=CONFIG["syntheses"],
        row=lambda wildcards: synthesis_text(TWINS["problem"]),
        twins=TWINS,
    script:
        "../scripts/twins.py"


rule known_optima:
    input:
        motion=MOTIONS / f"captured/{STUDY['clip']}_physical.npz",
        code=RESULTS / "dynamics/library.json",
        second_order=RESULTS / "dynamics/second_order.json",
    output:
        table=RESULTS / "tables/known_optima.csv",
        rows=RESULTS / "known_truth/optima.json",
    log:
        LOGS / "known_truth/optima.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library(
            *("body", "motion", "dynamics", "spacetime", "evaluation/spacetime/known_optima.py"),
            "evaluation/spacetime/sliding_masses.py",
        ),
        config=CONFIG["name"],
    script:
        "../scripts/known_optima.py"


rule known_truth_table:
    input:
        rows=KNOWN_TRUTH,
    output:
        table=RESULTS / "tables/known_truth.csv",
    log:
        LOGS / "known_truth_table.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        library=library("evaluation/spacetime/known_truth.py"),
        config=CONFIG["name"],
    script:
        "../scripts/known_truth_table.py"
