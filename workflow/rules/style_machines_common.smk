# Shared by the rules of style machines: the experiments of this run and their files.

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


# Figures from tables and arrays.
SHMM_FIGURES = [
    f"shmm_{name}"
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
        [
            *(f"gait-dof{d}-{end}" for d in (1, 2, 3) for end in ("minus", "plus")),
            *(f"gait-{a}-{b}" for a in ("strut", "cat") for b in ("interpolated", "extrapolated")),
        ],
        "side",
        None,
    ),
    **{
        f"shmm_move_{m + 1}": ([f"dance-move{m}-{k}" for k in range(5)], "oblique", 7)
        for m in range(4)
    },
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
    FIGURES += [*SHMM_FIGURES, *(name for name in SHMM_STRIPS if shmm_shown(name))]
