# Of NIO: which styles are learnt and judged, and what their rules depend on.

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
FIRST_JUDGED = [(row, kind) for row, kind in JUDGED if row is FIRST_STYLE]
# Before and after learning are needed of it, whatever else is judged.
if FIRST_STYLE:
    FIRST_JUDGED += [
        (FIRST_STYLE, kind)
        for kind in ("initial", "ours")
        if (FIRST_STYLE, kind) not in FIRST_JUDGED
    ]
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


def judged_inputs(wildcards):
    """Return the learnt style that a kind judges, where it has one."""
    recipe = KINDS[wildcards.kind].style
    return {"style": RESULTS / f"styles/{recipe}/{wildcards.clip}.json"} if recipe else {}
