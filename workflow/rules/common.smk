# Shared by all files here: the checked configuration, the sheets, and where things lie.

from dataclasses import asdict
from functools import cache
from hashlib import sha256
from pathlib import Path

from snakemake.exceptions import WorkflowError
from snakemake.logging import logger

import motionstyle
from motionstyle.configuration import load_config, read_settings
from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.nio.kinds import KINDS
from motionstyle.evaluation.nio.learners import LEARNERS
from motionstyle.evaluation.spacetime.sensitivity import CHOICES as SENSITIVITY_CHOICES
from motionstyle.jobs import check_writable, forget_killed_runs
from motionstyle.mocap.datasets.doors import read_datasets
from motionstyle.mocap.planted.variants import read_planted
from motionstyle.mocap.datasets.sheet import EMBEDDED, MARKER_FILES, read_sheet
from motionstyle.mocap.datasets.wheel import read_wheel_pin
from motionstyle.nio.settings import our_settings
from motionstyle.nio.styles_sheet import read_styles
from motionstyle.spacetime.synthesis_sheet import read_syntheses
from motionstyle.similarity.tasks import read_tasks

ROOT = Path(workflow.basedir)
PACKAGE = Path(motionstyle.__file__).parent
PATH_KEYS = (
    *("motions", "datasets", "embedded", "claims", "skeletons", "markersets"),
    *("planted", "normative", "syntheses", "similarity", "adaptations", "hand_style"),
    "style_machines",
)


def located(path):
    """Return a path of the configuration: from here if it is there, else in the clone."""
    return ROOT / path if not Path(path).exists() and (ROOT / path).exists() else Path(path)


try:
    # `--config key=true` arrives as text.
    config.update({k: v == "true" for k, v in config.items() if v in ("true", "false")})
    for key in PATH_KEYS:
        if isinstance(config.get(key), str):
            config[key] = str(located(config[key]))
    for key in ("settings", "styles"):
        if isinstance(config.get("nio"), dict) and isinstance(config["nio"].get(key), str):
            config["nio"] = {**config["nio"], key: str(located(config["nio"][key]))}
    CONFIG = load_config(config, ROOT / "workflow/schemas/config.schema.json", Path.cwd())
    DATASETS = read_datasets(CONFIG["datasets"])
    if workflow.is_main_process:
        check_writable(CONFIG["results_root"])
    WHEEL = read_wheel_pin(CONFIG["embedded"])
    SKELETONS, MARKERSETS = Path(CONFIG["skeletons"]), Path(CONFIG["markersets"])
    CLIPS = {
        row.id: row
        for row in read_sheet(
            CONFIG["motions"],
            DATASETS,
            embedded_files=WHEEL.names,
            skeletons={f.stem for kind in (SKELETONS, MARKERSETS) for f in kind.glob("*.yaml")},
        )
    }
    # Variants are planted on embedded clips only; a sheet without the base plants none.
    PLANTED = {
        recipe.id: recipe
        for recipe in read_planted(CONFIG["planted"])
        if recipe.base in CLIPS and CLIPS[recipe.base].dataset == EMBEDDED
    }
    # Motions are synthesised from clips of the sheet. Of the sheets that are shipped, rows whose
    # clips it has not are left out; in the user's own they are mistakes.
    SHIPPED = Path(CONFIG["syntheses"]).resolve().parent == (ROOT / "config").resolve()
    SYNTHESES = {
        row.id: row
        for row in read_syntheses(CONFIG["syntheses"], None if SHIPPED else CLIPS)
        if all(id in CLIPS for id in (*row.clips, *row.others))
    }
    # Styles are learnt from clips of the sheet; as with syntheses, rows of shipped sheets whose
    # clips are not there are left out.
    NIO = CONFIG["nio"]
    NIO_SETTINGS = read_settings(NIO["settings"], ROOT / "workflow/schemas/nio.schema.json")
    our_settings(NIO_SETTINGS, NIO["schedule"])
    SHIPPED_STYLES = Path(NIO["styles"]).resolve().parent == (ROOT / "config").resolve()
    STYLES = {
        row.id: row
        for row in read_styles(NIO["styles"], None if SHIPPED_STYLES else CLIPS)
        if row.clip in CLIPS
    }
    # Rows whose style is to be learnt need a row of the sheet of styles.
    UNLEARNT = {
        id: f"synthesis {id}: no row of {NIO['styles']} learns the style of {row.style_clip} by "
        f"{row.recipe}; add one, or take style initial"
        for id, row in SYNTHESES.items()
        if row.recipe in ("ours", "paper")
        and not any(
            s.clip == row.style_clip and row.recipe in s.algorithms for s in STYLES.values()
        )
    }
    if UNLEARNT and not SHIPPED:
        raise MotionStyleError("\n".join(UNLEARNT.values()))
    SYNTHESES = {id: row for id, row in SYNTHESES.items() if id not in UNLEARNT}
    SIMILARITY = read_settings(
        CONFIG["similarity"], ROOT / "workflow/schemas/similarity.schema.json"
    )
    TASKS = {task.task: task for task in read_tasks(CONFIG["adaptations"], set(CLIPS))}
except MotionStyleError as error:
    raise WorkflowError(str(error)) from None

# The first synthesis of each task, for figures.
ONE_OF_EACH_TASK = list({row.task: row.id for row in reversed(SYNTHESES.values())}.values())[::-1]
# Syntheses on which solver designs are held against each other.
COMPARED = [id for id in CONFIG["solver_comparison"]["problems"] if id in SYNTHESES]
# One row with random styles, recovered from elsewhere; and the clip that other studies of the
# solver are made on. Those whose row or clip this run has not are left out.
TWINS = CONFIG["twins"]
STUDY = CONFIG["solver_study"]
CHOICES = STUDY["choices"] if STUDY["clip"] in CLIPS else []
KNOWN_TRUTH = [
    Path(CONFIG["results_root"]) / f"known_truth/{name}.json"
    for name in (
        *(["optima"] if STUDY["clip"] in CLIPS else []),
        *(f"twins_{seed}" for seed in TWINS["seeds"] if TWINS["problem"] in SYNTHESES),
    )
]
# Syntheses on a ramp, each with the one on the level in the same style and window.
RAMPS = [
    (ramp.id, level.id)
    for ramp in SYNTHESES.values()
    for level in SYNTHESES.values()
    if ramp.footprints.kind == "ramp"
    and level.task == "same_footprints"
    and ramp.style == level.style
    and (ramp.example, ramp.first_frame, ramp.last_frame)
    == (level.example, level.first_frame, level.last_frame)
]
if workflow.is_main_process:
    LEFT_OUT = [row.id for row in read_syntheses(CONFIG["syntheses"]) if row.id not in SYNTHESES]
    if LEFT_OUT:
        missing = f"clips not in {CONFIG['motions']} or styles not learnt"
        logger.info(f"syntheses left out, {missing}: {', '.join(LEFT_OUT)}")

# Kept open while this run lasts: a run that was killed leaves locks, which the next one removes.
ALIVE = forget_killed_runs(".snakemake") if workflow.is_main_process else None

RESULTS = Path(CONFIG["results_root"])
LOGS = RESULTS / "logs"
BENCHMARKS = RESULTS / "benchmarks"
SOURCES = RESULTS / "sources"
MOTIONS = RESULTS / "motions"
MIRRORED = [f"{id}_mirror" for id, row in CLIPS.items() if row.mirror]
# Clips with force plates, against which estimated forces are held.
PLATES = [id for id, row in CLIPS.items() if row.forces and "force_plates" in row.experiments]
# Clips that are made to obey Newton.
PHYSICAL = [
    id
    for id, row in CLIPS.items()
    if row.level == "physical"
    or "nio" in row.experiments
    or id in PLATES
    or any(id in synthesis.clips for synthesis in SYNTHESES.values())
    or id == STUDY["clip"]
    or any(id == style.clip for style in STYLES.values())
]

# Motions that similar pairs are made of. Planted variants stand in for the embedded clips, whose
# frames they share.
SIMILAR = [
    *(
        f"captured/{id}"
        for id, row in CLIPS.items()
        if "similarity" in row.experiments and row.dataset != EMBEDDED
    ),
    *(f"planted/{id}" for id, recipe in PLANTED.items() if "similarity" in recipe.experiments),
]
TASKS = TASKS if SIMILAR else {}
ADAPTED = [f"{task}{variant}" for task in TASKS for variant in ("", "_without_style")]


# Styles whose experiments go beyond learning and judging, and who is learnt and judged how.
STUDIED = [STYLES[id] for id in NIO["studied"] if id in STYLES]
LEARNT = [(row, name) for row in STYLES.values() for name in row.algorithms]
LEARNT += [(row, name) for row in STUDIED for name in NIO["learners"] if name not in row.algorithms]
JUDGED = [
    (row, name)
    for row in STYLES.values()
    for name, kind in KINDS.items()
    if (not kind.style or (row, kind.style) in LEARNT)
    and (
        name in NIO["kinds"]
        or (row in STUDIED and (name in NIO["studied_kinds"] or kind.style in NIO["learners"]))
    )
]


wildcard_constraints:
    task="|".join(TASKS) or "none",
    clip="|".join(CLIPS) or "none",
    planted="|".join(PLANTED) or "none",
    synthesis="|".join(SYNTHESES) or "none",
    choice="|".join(SENSITIVITY_CHOICES),
    seed="[0-9]+",
    frames="[0-9]+",


# What the physics fit is made of in its room: other modules there do not touch it.
PHYSICAL_MODULES = [
    f"spacetime/{name}.py"
    for name in (
        *("physical", "physical_problem", "physical_step", "ground", "sharing", "diagnosis"),
        *("forces", "splines"),
    )
]


@cache
def room_digest(room):
    """Return a digest of the sources of one room, or one module, of the package."""
    digest = sha256()
    files = [PACKAGE / room] if room.endswith(".py") else (PACKAGE / room).rglob("*")
    for file in sorted(f for f in files if f.suffix in {".py", ".c", ".j2"}):
        if room or file.parent == PACKAGE:
            digest.update(file.relative_to(PACKAGE).as_posix().encode() + file.read_bytes())
    return digest.hexdigest()


def library(*rooms):
    """Return a digest of the package's sources in these rooms or modules, for a rule's parameters.

    Snakemake reruns a job whose parameters changed, so an edit reruns what it touches.
    """
    return sha256("".join(room_digest(room) for room in ("", *rooms)).encode()).hexdigest()[:16]


def source_file(row, name=None):
    """Return where the file of a clip, or a companion of it, lies for this run."""
    if row.dataset is None:
        return row.local_file(name)
    if row.dataset == EMBEDDED:
        return SOURCES / EMBEDDED / (name or row.path)
    return SOURCES / "datasets" / (name or row.path)


def is_markers(row):
    """Whether a clip is measured markers, not a skeleton's motion."""
    return row.path.lower().endswith(MARKER_FILES)


def map_file(row):
    """Return the skeleton map or marker set a clip is read with."""
    return (MARKERSETS if is_markers(row) else SKELETONS) / f"{row.skeleton}.yaml"


def skeleton_files(row):
    """Return the files a clip needs beside its own to be read: ASF or URDF."""
    if row.dataset == EMBEDDED:
        return [SOURCES / EMBEDDED / "humanoid.urdf"]
    if row.path.lower().endswith((".txt", ".json")):  # the user's own in DeepMimic's format
        beside = row.local_file(str(Path(row.path).with_name("humanoid.urdf")))
        return [beside if beside.exists() else SOURCES / EMBEDDED / "humanoid.urdf"]
    return [source_file(row, name) for name in row.companions if name.lower().endswith(".asf")]


def companion(id, kind):
    """Return the file of a clip's static trial or force plates, as a list of one or none."""
    name = getattr(CLIPS[id], kind)
    return [source_file(CLIPS[id], name)] if name else []


def physical_settings(id):
    """Return the settings of a clip's physics fit."""
    return {**CONFIG["physical"], **(CONFIG["force_plates"] if id in PLATES else {})}


def synthesis_motions(row):
    """Return the physical motions a synthesis is made from, by name of the input."""
    files = {"example": MOTIONS / f"captured/{row.example}_physical.npz"}
    if row.footprint_clip not in ("", row.example):
        files["source"] = MOTIONS / f"captured/{row.footprint_clip}_physical.npz"
    if row.footprints.kind == "file":
        files["file"] = row.folder / row.footprints.text("path")
    return files


def style_of(row):
    """Return the file of a synthesis's style: the user's own, or one that a rule makes."""
    return row.style_file or RESULTS / f"styles/{row.recipe}/{row.style_clip}.json"


def synthesis_text(id):
    """Return what a synthesis depends on, as text: a change makes it anew."""
    row = SYNTHESES[id]
    return repr([getattr(row, name) for name in vars(row) if name not in ("row", "note")])


def motion_files():
    """Return the files of every motion of this run."""
    captured = [MOTIONS / "captured" / f"{id}.npz" for id in [*CLIPS, *MIRRORED]]
    captured += [MOTIONS / "captured" / f"{id}_physical.npz" for id in PHYSICAL]
    captured += [MOTIONS / f"{kind}/{id}.npz" for id in SYNTHESES for kind in ("nio", "warp")]
    captured += [MOTIONS / f"warp/{id}_copied.npz" for id in SYNTHESES]
    captured += [MOTIONS / "planted" / f"{id}.npz" for id in PLANTED]
    captured += [file for job in SHMM_MADE for file in shmm_motions(job)]
    return captured + [MOTIONS / "adapted" / f"{id}.npz" for id in ADAPTED]


def made_motions():
    """Return the motions of the kinds that are judged against their example.

    Styles set by hand or at random are not the example's, so that theirs are not.
    """
    kinds = SIMILARITY["judge"]["kinds"]
    foreign = {id for id, row in SYNTHESES.items() if row.recipe in ("hand", "twin")}
    return [
        file
        for file in motion_files()
        if file.parent.name in kinds and file.stem.removesuffix("_copied") not in foreign
    ]


# Every table that claims may be judged on; the ledger is remade when any of them changes.
TABLES = [
    RESULTS / f"tables/{name}.csv"
    for name in (
        *("body", "clips", "motions", "gait_angles", "gait", "physical", "force_plates"),
        *("joint_moments", "plate_moments", "root_residual"),
    )
]
TABLES += [
    RESULTS / f"tables/{name}.csv" for name in ("syntheses", "ramp_gait", "solver_comparison")
]

SOLVER_TABLES = ["known_truth"] if KNOWN_TRUTH else []
SOLVER_TABLES += ["known_optima", "solver_growth"] if STUDY["clip"] in CLIPS else []
SOLVER_TABLES += ["spacetime_sensitivity"] if CHOICES else []
TABLES += [RESULTS / f"tables/{name}.csv" for name in SOLVER_TABLES]

NIO_TABLES = ["nio_learning", "resynthesis", "style_parameters", "figure_checks"] if STYLES else []
TABLES += [RESULTS / f"tables/{name}.csv" for name in NIO_TABLES]

SIMILARITY_TABLES = [
    *("similarity_alignments", "similarity_sets", "leg_subspaces", "leakage", "one_class_svm"),
    *("discrimination", "dose_response", "dose_points", "adaptations", "style_judgement"),
]
TABLES += [RESULTS / f"tables/{name}.csv" for name in SIMILARITY_TABLES if SIMILAR]

# Clips shown in the figures: those of the sheet among the configured ones, in this order.
SHOWN = {
    figure: [id for id in ids if id in CLIPS] or list(CLIPS)[:4]
    for figure, ids in CONFIG["figures"].items()
}
FORCE_STRIPS = [id for id in CONFIG["figures"].get("forces", []) if id in PHYSICAL] or PHYSICAL[:4]
FIGURES = ["body", "strips", "gait", "markers", "marker_fit"]
FIGURES += ["planted"] if PLANTED else []
FIGURES += ["force_plates", "plate_moments"] if PLATES else []
FIGURES += ["root_residual", "force_strips", "joint_moments"] if PHYSICAL else []
# The tables and figures of style machines, and the figures of NIO, are added in their rules.
FIGURES += ["syntheses", "warps"] if SYNTHESES else []
FIGURES += ["solvers"] if COMPARED else []
FIGURES += ["landscape"] if "base" in CHOICES else []
FIGURES += ["similarity_features", "leg_subspaces", "leakage", "discrimination"] if SIMILAR else []
FIGURES += ["dose_response"] if SIMILAR and PLANTED else []
FIGURES += ["adaptation_triptych", "adaptation_strips"] if TASKS else []


def everything():
    """Return all files a run makes, so that one that was deleted is made again."""
    motions = motion_files()
    figures = [RESULTS / f"figures/{name}.{kind}" for name in FIGURES for kind in ("svg", "png")]
    quality = [RESULTS / f"quality/{id}.json" for id in CLIPS]
    sidecars = [file.with_suffix(".json") for file in motions]
    opensim = [
        RESULTS / f"opensim/captured/{id}_physical_{ending}"
        for id in PLATES
        for ending in ("angles.mot", "moments.sto", "grf.mot", "external_loads.xml")
    ]
    footprints = [
        RESULTS / f"footprints/{id}.{kind}"
        for id in SYNTHESES
        for kind in ("tsv", "json", "svg", "png")
    ]
    made = [*figures, *quality, *motions, *sidecars, *opensim, *footprints]
    return [*TABLES, RESULTS / "tables/claims.csv", *made]
