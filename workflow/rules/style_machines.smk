# Style machines: models of motion with a space of styles (Brand & Hertzmann 2000).

from motionstyle.evaluation.style_machines import runs as _shmm
from motionstyle.evaluation.style_machines.settings import load_settings, pattern_ids, planned

SHMM = RESULTS / "shmm"
# Ids of all motions that style machines may be learnt from, and their files.
SHMM_SOURCES = {id: MOTIONS / f"captured/{id}.npz" for id in [*CLIPS, *MIRRORED]}
SHMM_SOURCES |= {id: MOTIONS / f"planted/{id}.npz" for id in PLANTED}
# Walks and runs that random draws are made from.
SHMM_POOL = [
    id
    for id, row in CLIPS.items()
    if "style_machines" in row.experiments and row.action in ("walk", "run")
]

try:
    SHMM_PLAN = planned(
        load_settings(
            CONFIG["style_machines"], ROOT / "workflow/schemas/style_machines.schema.json"
        ),
        SHMM_SOURCES,
    )
    SHMM_MADE = _shmm.motion_ids(SHMM_PLAN)
except MotionStyleError as error:
    raise WorkflowError(str(error)) from None


def shmm_inputs(*groups):
    """Return the files of the motions that some groups of experiments read."""
    ids = []
    for group in groups:
        entry = SHMM_PLAN.get(group)
        if group == "draws":
            ids += SHMM_POOL if SHMM_PLAN["draws"]["count"] else []
        elif group == "explained_variance":
            ids += [id for one in entry.values() for id in one["motions"]]
        elif group == "analogies":
            for one in entry.values():
                for pattern in (one["walk"], one["run"]):
                    ids += pattern_ids(pattern, one["styles"], one["takes"])
        elif group == "held_out":
            for one in entry.values():
                ids += pattern_ids(one["motion"], one["styles"], [*one["learn"], *one["try"]])
        elif group == "dances":
            ids += [id for one in entry.values() for id in one]
        elif entry is not None:
            keys = {
                "gaits": ("motions",),
                "three_walks": ("learn", "try"),
                "driving": ("learn",),
                "novice": (),
            }
            ids += [id for key in keys[group] for id in entry[key]]
            ids += [entry["held_out"], entry["expert"]] if group == "novice" else []
    return [SHMM_SOURCES[id] for id in dict.fromkeys(ids)]


def shmm_plan(*groups):
    """Return the part of the settings that a job depends on."""
    return {key: SHMM_PLAN[key] for key in groups if key in SHMM_PLAN}


def shmm_motions(job):
    """Return the motion files that a job makes."""
    return [MOTIONS / f"shmm/{id}.npz" for id in SHMM_MADE[job]]


def shmm_contacts(action):
    """Return the contact thresholds of an action of the configuration."""
    return {**CONFIG["contacts"]["default"], **CONFIG["contacts"].get(action, {})}


rule shmm_gaits:
    input:
        motions=shmm_inputs("explained_variance", "draws", "gaits"),
    output:
        explained_variance=RESULTS / "tables/explained_variance.csv",
        style_dof=RESULTS / "tables/style_dof.csv",
        motions=shmm_motions("gaits"),
        sidecars=[file.with_suffix(".json") for file in shmm_motions("gaits")],
        rows=SHMM / "gaits.json",
        arrays=SHMM / "gaits.npz",
    log:
        LOGS / "shmm/gaits.log",
    benchmark:
        BENCHMARKS / "shmm/gaits.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=2000,
    params:
        library=library("body", "motion", "mocap", "shmm", "evaluation"),
        plan=shmm_plan("locomotion", "explained_variance", "draws", "gaits"),
        pool=SHMM_POOL,
        contacts=shmm_contacts(SHMM_PLAN["gait_action"]),
        config=CONFIG["name"],
    script:
        "../scripts/shmm_gaits.py"


rule shmm_analogies:
    input:
        motions=shmm_inputs("analogies"),
    output:
        analogies=RESULTS / "tables/analogies.csv",
    log:
        LOGS / "shmm/analogies.log",
    benchmark:
        BENCHMARKS / "shmm/analogies.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=2000,
    params:
        library=library("body", "motion", "mocap", "shmm", "evaluation"),
        plan=shmm_plan("locomotion", "analogies", "analogy_variants"),
        config=CONFIG["name"],
    script:
        "../scripts/shmm_analogies.py"


rule shmm_held_out:
    input:
        motions=shmm_inputs("held_out"),
    output:
        held_out=RESULTS / "tables/held_out.csv",
    log:
        LOGS / "shmm/held_out.log",
    benchmark:
        BENCHMARKS / "shmm/held_out.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=2000,
    params:
        library=library("body", "motion", "mocap", "shmm", "evaluation"),
        plan=shmm_plan("locomotion", "held_out"),
        config=CONFIG["name"],
    script:
        "../scripts/shmm_held_out.py"


rule shmm_dances:
    input:
        motions=shmm_inputs("dances", "novice"),
    output:
        dance_model=RESULTS / "tables/dance_model.csv",
        novice=RESULTS / "tables/novice.csv",
        motions=shmm_motions("dances"),
        sidecars=[file.with_suffix(".json") for file in shmm_motions("dances")],
        rows=SHMM / "dances.json",
        arrays=SHMM / "dances.npz",
    log:
        LOGS / "shmm/dances.log",
    benchmark:
        BENCHMARKS / "shmm/dances.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=2000,
    params:
        library=library("body", "motion", "mocap", "shmm", "evaluation"),
        plan=shmm_plan("dance", "dances", "novice"),
        contacts=shmm_contacts(SHMM_PLAN["dance_action"]),
        config=CONFIG["name"],
    script:
        "../scripts/shmm_dances.py"


rule shmm_driving:
    input:
        motions=shmm_inputs("driving"),
    output:
        path_map=RESULTS / "tables/path_map.csv",
        motions=shmm_motions("driving"),
        sidecars=[file.with_suffix(".json") for file in shmm_motions("driving")],
        arrays=SHMM / "driving.npz",
    log:
        LOGS / "shmm/driving.log",
    benchmark:
        BENCHMARKS / "shmm/driving.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=2000,
    params:
        library=library("body", "motion", "mocap", "shmm", "evaluation"),
        plan=shmm_plan("dance", "driving"),
        contacts=shmm_contacts(SHMM_PLAN["dance_action"]),
        config=CONFIG["name"],
    script:
        "../scripts/shmm_driving.py"


rule shmm_checks:
    input:
        motions=shmm_inputs("three_walks", "explained_variance"),
    output:
        shmm_figure_checks=RESULTS / "tables/shmm_figure_checks.csv",
        shmm_sensitivity=RESULTS / "tables/shmm_sensitivity.csv",
        arrays=SHMM / "checks.npz",
    log:
        LOGS / "shmm/checks.log",
    benchmark:
        BENCHMARKS / "shmm/checks.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=2000,
    params:
        library=library("body", "motion", "mocap", "shmm", "evaluation"),
        plan=shmm_plan("locomotion", "explained_variance", "three_walks", "seeds", "sensitivity"),
        config=CONFIG["name"],
    script:
        "../scripts/shmm_checks.py"


rule shmm_twin:
    output:
        table=RESULTS / "tables/shmm_twin.csv",
    log:
        LOGS / "shmm/twin.log",
    benchmark:
        BENCHMARKS / "shmm/twin.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("body", "motion", "shmm", "evaluation"),
        plan=shmm_plan("twin"),
        config=CONFIG["name"],
    script:
        "../scripts/shmm_twin.py"


rule shmm_syntheses:
    input:
        rows=[SHMM / "gaits.json", SHMM / "dances.json"],
    output:
        table=RESULTS / "tables/shmm_syntheses.csv",
    log:
        LOGS / "shmm/syntheses.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        library=library("evaluation"),
    script:
        "../scripts/shmm_syntheses.py"


rule shmm_benchmark:
    input:
        motions=[SHMM_SOURCES[id] for id in next(iter(SHMM_PLAN["dances"].values()), [])],
    output:
        table=RESULTS / "tables/shmm_benchmark.csv",
    log:
        LOGS / "shmm/benchmark.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=4000,
    params:
        library=library("body", "motion", "shmm", "evaluation"),
        plan=shmm_plan("dance"),
    script:
        "../scripts/shmm_benchmark.py"


# Figures from tables and arrays.
SHMM_FIGURES = [
    "shmm_" + name
    for name in (
        *("models", "priors", "dof", "dance", "graphs", "annealing", "axes", "analogies"),
        *("held_out", "driving", "phases", "twin", "novice"),
    )
]
# Strips of synthesised motions: which ones, the view, and how many stick figures.
SHMM_STRIPS = {
    "shmm_teaser": ([f"dance-choreography-{k}" for k in range(5)], "oblique", 9),
    "shmm_gaits": (
        [f"gait-{a}-{b}" for a in ("strut", "cat") for b in ("walk", "run", "style", "x")],
        "side",
        None,
    ),
    "shmm_extremes": (
        [f"gait-dof{d}-{end}" for d in (1, 2, 3) for end in ("minus", "plus")]
        + [f"gait-{a}-{b}" for a in ("strut", "cat") for b in ("interpolated", "extrapolated")],
        "side",
        None,
    ),
    "shmm_choreography": (
        [f"dance-move{m}-{k}" for m in range(4) for k in range(5)],
        "oblique",
        7,
    ),
    "shmm_walks": ([*(f"dance-walk-{k}" for k in range(3)), "dance-pasted"], "oblique", 9),
    "shmm_novice_strip": (
        [f"dance-novice-{k}" for k in ("original", "novice", "improved")],
        "oblique",
        9,
    ),
    "shmm_driven": (
        [f"driven-{k}" for k in ("truth", "path_map", "path_map_restyled")],
        "oblique",
        9,
    ),
}


def shmm_shown(name):
    """Return the motions of a strip that this run makes."""
    made = {id for ids in SHMM_MADE.values() for id in ids}
    return [MOTIONS / f"shmm/{id}.npz" for id in SHMM_STRIPS[name][0] if id in made]


# A sheet without any motion of these experiments gets none of their tables and figures.
SHMM_TABLES = []
if any(SHMM_MADE.values()) or SHMM_PLAN["analogies"] or SHMM_PLAN["held_out"]:
    SHMM_TABLES = [
        *("explained_variance", "style_dof", "analogies", "held_out", "dance_model", "novice"),
        *("path_map", "shmm_figure_checks", "shmm_sensitivity", "shmm_twin", "shmm_syntheses"),
    ]
    TABLES += [RESULTS / f"tables/{name}.csv" for name in SHMM_TABLES]
    FIGURES += SHMM_FIGURES + [name for name in SHMM_STRIPS if shmm_shown(name)]


rule shmm_figures:
    input:
        tables=[
            RESULTS / f"tables/{name}.csv"
            for name in (
                *("shmm_figure_checks", "dance_model", "explained_variance", "style_dof"),
                *("analogies", "held_out", "path_map", "shmm_twin", "novice"),
            )
        ],
        gaits=SHMM / "gaits.npz",
        dances=SHMM / "dances.npz",
        driving=SHMM / "driving.npz",
        checks=SHMM / "checks.npz",
    output:
        svg=[RESULTS / f"figures/{name}.svg" for name in SHMM_FIGURES],
        png=[RESULTS / f"figures/{name}.png" for name in SHMM_FIGURES],
    log:
        LOGS / "figures/shmm.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1500,
    params:
        library=library("body", "motion", "shmm", "evaluation", "figures"),
    script:
        "../scripts/shmm_figures.py"


rule shmm_strips:
    input:
        motions=lambda wildcards: shmm_shown(wildcards.strip),
    output:
        svg=RESULTS / "figures/{strip}.svg",
        png=RESULTS / "figures/{strip}.png",
    log:
        LOGS / "figures/{strip}.log",
    wildcard_constraints:
        strip="|".join(SHMM_STRIPS),
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1500,
    params:
        library=library("body", "motion", "evaluation", "figures"),
        view=lambda wildcards: SHMM_STRIPS[wildcards.strip][1],
        number=lambda wildcards: SHMM_STRIPS[wildcards.strip][2],
    script:
        "../scripts/shmm_strips.py"
