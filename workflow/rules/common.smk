# Shared by all files here: the checked configuration, the sheets, and where things lie.

from dataclasses import asdict
from functools import cache
from hashlib import sha256
from pathlib import Path

from snakemake.exceptions import WorkflowError

import motionstyle
from motionstyle.configuration import load_config
from motionstyle.errors import MotionStyleError
from motionstyle.jobs import check_writable, forget_killed_runs
from motionstyle.mocap.datasets.doors import read_datasets
from motionstyle.mocap.planted.variants import read_planted
from motionstyle.mocap.datasets.sheet import EMBEDDED, MARKER_FILES, read_sheet
from motionstyle.mocap.datasets.wheel import read_wheel_pin

ROOT = Path(workflow.basedir)
PACKAGE = Path(motionstyle.__file__).parent
PATH_KEYS = (
    *("motions", "datasets", "embedded", "claims", "skeletons", "markersets"),
    *("planted", "normative", "style_machines"),
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
except MotionStyleError as error:
    raise WorkflowError(str(error)) from None

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
    if row.level == "physical" or "nio" in row.experiments or id in PLATES
]


wildcard_constraints:
    clip="|".join(CLIPS) or "none",
    planted="|".join(PLANTED) or "none",


@cache
def room_digest(room):
    """Return a digest of the sources of one room of the package."""
    digest = sha256()
    for file in sorted(f for f in (PACKAGE / room).rglob("*") if f.suffix in {".py", ".j2"}):
        if room or file.parent == PACKAGE:
            digest.update(file.relative_to(PACKAGE).as_posix().encode() + file.read_bytes())
    return digest.hexdigest()


def library(*rooms):
    """Return a digest of the package's sources in these rooms, as a parameter of a rule.

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


def motion_files():
    """Return the files of every motion of this run."""
    captured = [MOTIONS / "captured" / f"{id}.npz" for id in [*CLIPS, *MIRRORED]]
    captured += [MOTIONS / "captured" / f"{id}_physical.npz" for id in PHYSICAL]
    planted = [MOTIONS / "planted" / f"{id}.npz" for id in PLANTED]
    synthesised = [file for job in SHMM_MADE for file in shmm_motions(job)]
    return captured + planted + synthesised


# Every table that claims may be judged on; the ledger is remade when any of them changes.
TABLES = [
    RESULTS / f"tables/{name}.csv"
    for name in (
        *("body", "clips", "motions", "gait_angles", "gait", "physical", "force_plates"),
        *("joint_moments", "plate_moments", "root_residual"),
    )
]

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
# The tables and figures of style machines are added in their rules.


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
    made = [*figures, *quality, *motions, *sidecars, *opensim]
    return [*TABLES, RESULTS / "tables/claims.csv", *made]
