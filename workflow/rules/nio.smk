# NIO: styles learnt from one motion each, judged by converged solves, and what the paper shows of it.

TWIN_STYLES = [
    RESULTS / f"known_truth/style_twins_{seed}_{noise}.json"
    for seed in NIO["twins"]["seeds"]
    for noise in NIO["twins"]["noise_deg"]
    if NIO["twins"]["style"] in STYLES
]
KNOWN_TRUTH += TWIN_STYLES
BY_CLIP = {row.clip: row for row in STYLES.values()}
SHOWN_STYLES = [STYLES[id] for id in NIO["shown"] if id in STYLES] or list(STYLES.values())[:4]
# Of one style, with which F2–F4 and E14 are shown.
FIRST_STYLE = SHOWN_STYLES[0] if SHOWN_STYLES else None
LEARNT_KEYS = [(row.id, name) for row, name in LEARNT if name in ("ours", "paper")]

if STYLES:
    FIGURES += ["nio_springs", "nio_segment", "nio_learning", "nio_likelihood", "resynthesis"]
    FIGURES += ["style_sides", "style_compared"]
FIGURES += ["nio_identifiability"] if TWIN_STYLES else []


def style_text(clip):
    """Return what a style's learning depends on, as text: a change learns it anew."""
    row = BY_CLIP[clip]
    return repr([row.clip, row.first_frame, row.last_frame, row.mood, row.action, row.set, row.id])


def learning_settings(algorithm):
    """Return the settings that matter to a learner, as text."""
    part = {"ours": "ours", "alpha_only": "ours"}.get(algorithm, "paper")
    counts = [NIO["schedule"]] if part == "ours" else [NIO["paper_iterations"]]
    return repr([NIO_SETTINGS[part], *counts])


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
    conda:
        "../envs/motionstyle.yaml"
    wildcard_constraints:
        algorithm="|".join(name for name in LEARNERS if name != "least_squares"),
    threads: 1
    resources:
        mem_mb=1500,
    params:
        library=library("body", "motion", "dynamics", "spacetime", "nio", "evaluation/nio/learners.py"),
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


def judged_inputs(wildcards):
    """Return the learnt style that a kind judges, where it has one."""
    recipe = KINDS[wildcards.kind].style
    return {"style": RESULTS / f"styles/{recipe}/{wildcards.clip}.json"} if recipe else {}


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
