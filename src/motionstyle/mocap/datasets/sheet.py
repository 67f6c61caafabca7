"""The motion sheet: which clips a run takes, from where, and what is known about each."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from motionstyle.errors import MotionStyleError, near_matches
from motionstyle.mocap.datasets.cells import Cells, finite, sheet_rows
from motionstyle.mocap.datasets.doors import DatasetFile, unknown_dataset_file

Datasets = Mapping[tuple[str, str], DatasetFile]
Names = Collection[str]

EMBEDDED = "embedded"
EXPERIMENTS = ("nio", "style_machines", "similarity", "force_plates", "gait", "dance")
LEVELS = ("kinematic", "physical")
SURFACES = ("level", "stairs", "ramp", "uneven")
SEXES = ("male", "female")
UP_AXES = ("y", "z")
METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "inch": 0.0254, "cmu": 0.0254 / 0.45}
# Files that name neither a unit nor the axis that is up, so that the sheet must.
SKELETON_FILES = (".bvh", ".amc", ".txt", ".json")
MARKER_FILES = (".c3d", ".trc")
COLUMNS = (
    *("id", "dataset", "path", "up_axis", "unit", "rate", "subject", "action", "style"),
    *("mass_kg", "sex", "first_frame", "last_frame", "cycles", "skeleton", "forces", "static"),
    *("level", "surface", "mirror", "experiments", "note"),
)


@dataclass(frozen=True)
class ClipRow:
    """One row of a motion sheet; None stands for an empty cell.

    Attributes
    ----------
    id : unique name, safe as a file name on every system.
    dataset : a dataset of `datasets.tsv`, `embedded`, or None for the user's own file.
    path : the file: as in `datasets.tsv`, a file name of the embedded wheel, or, without a
        dataset, relative to the sheet's folder.
    up_axis : `y` or `z`.
    unit : a key of `METRES`, or a number of metres.
    rate_hz : frames per second that overrule the file's.
    subject, action, style : labels; `action` is always there.
    mass_kg, sex : of the subject.
    first_frame, last_frame : counted from 0, both included.
    cycles : how many times a looping clip is run through.
    skeleton : a file of `config/skeletons`, or a marker set.
    forces, static : files of force plates and of a static trial, found like `path`.
    level : `kinematic` or `physical`.
    surface : `level`, `stairs`, `ramp` or `uneven`.
    mirror : whether a copy with left and right exchanged is made too.
    experiments : the analyses the clip enters.
    note : free text.
    row : line of the sheet, counted from 1.
    folder : folder of the sheet.
    """

    id: str
    dataset: str | None
    path: str
    up_axis: str | None
    unit: str | None
    rate_hz: float | None
    subject: str | None
    action: str
    style: str | None
    mass_kg: float | None
    sex: str | None
    first_frame: int | None
    last_frame: int | None
    cycles: int
    skeleton: str | None
    forces: str | None
    static: str | None
    level: str
    surface: str
    mirror: bool
    experiments: tuple[str, ...]
    note: str | None
    row: int
    folder: Path

    @property
    def metres_per_unit(self) -> float | None:
        """Metres of one unit of the file, or None where the file says it itself."""
        return None if self.unit is None else METRES.get(self.unit) or float(self.unit)

    @property
    def companions(self) -> tuple[str, ...]:
        """Further files the clip needs, named like `path`: forces, static trial, and the ASF."""
        wanted = [self.forces, self.static, companion_skeleton(self.path)]
        return tuple(name for name in wanted if name)

    def local_file(self, name: str | None = None) -> Path:
        """Return where `path`, or a companion, of a clip without a dataset lies."""
        return self.folder / (name or self.path)


def companion_skeleton(path: str) -> str | None:
    """Return the ASF file beside an AMC file: `02/02_01.amc` moves the skeleton `02/02.asf`."""
    clip = PurePosixPath(path)
    if clip.suffix.lower() != ".amc":
        return None
    return str(clip.with_name(clip.stem.rsplit("_", 1)[0] + ".asf"))


def read_sheet(
    path: str | Path,
    datasets: Datasets,
    *,
    embedded_files: Names | None = None,
    skeletons: Names | None = None,
) -> tuple[ClipRow, ...]:
    """Read and check a motion sheet; rows are counted as an editor counts lines.

    Empty lines and lines that begin with `#` are passed over.

    Parameters
    ----------
    datasets : the rows of `datasets.tsv` by (dataset, path).
    embedded_files : file names of the embedded wheel; not checked if None.
    skeletons : names that the column `skeleton` may take; not checked if None.

    Raises
    ------
    MotionStyleError
        With every problem of the sheet, one a line.
    """
    path = Path(path)
    problems: list[str] = []
    rows: list[ClipRow] = []
    seen: dict[str, ClipRow] = {}
    for cells in sheet_rows(
        path, COLUMNS, problems, none="the sheet has no rows under its column names"
    ):
        row = _row(cells, path.parent)
        _check_row(cells, row, skeletons)
        _check_files(cells, row, datasets, embedded_files)
        former = seen.setdefault(row.id.casefold(), row)
        if former is not row and row.id:
            cells.problem("id", f"{row.id!r} is already the id of row {former.row} ({former.id!r})")
        rows.append(row)
    if problems:
        raise MotionStyleError("\n".join(problems))
    return tuple(rows)


def _row(cells: Cells, folder: Path) -> ClipRow:
    """Return the typed row; wrong cells become None or the default, and are noted."""
    row = ClipRow(
        id=cells.identifier("id"),
        dataset=cells.text("dataset"),
        path=cells.required("path"),
        up_axis=cells.one_of("up_axis", UP_AXES),
        unit=_unit(cells),
        rate_hz=cells.number("rate", "a rate in Hz above 0", above=0),
        subject=cells.text("subject"),
        action=cells.required("action"),
        style=cells.text("style"),
        mass_kg=cells.number("mass_kg", "a mass of up to 500 kg", above=0, up_to=500),
        sex=cells.one_of("sex", SEXES),
        first_frame=cells.whole("first_frame", 0),
        last_frame=cells.whole("last_frame", 0),
        cycles=cells.whole("cycles", 1) or 1,
        skeleton=cells.text("skeleton"),
        forces=cells.text("forces"),
        static=cells.text("static"),
        level=cells.one_of("level", LEVELS) or LEVELS[0],
        surface=cells.one_of("surface", SURFACES) or SURFACES[0],
        mirror=cells.one_of("mirror", ("yes", "no")) == "yes",
        experiments=cells.some_of("experiments", EXPERIMENTS),
        note=cells.text("note"),
        row=cells.row,
        folder=folder,
    )
    first, last = row.first_frame or 0, row.last_frame
    if last is not None and last < first:
        cells.problem("last_frame", f"{last} lies before first_frame ({first})")
    return row


def _unit(cells: Cells) -> str | None:
    value = cells.text("unit")
    if value is None or value in METRES or (finite(value) or 0) > 0:
        return value
    near = near_matches(value, list(METRES))
    cells.problem("unit", f"{value!r} is not one of {', '.join(METRES)} or metres above 0{near}")
    return None


def _check_row(cells: Cells, row: ClipRow, skeletons: Names | None) -> None:
    """Note a file of unknown kind, a unit or axis nobody states, a skeleton nobody knows."""
    suffix = PurePosixPath(row.path).suffix.lower()
    if row.path and suffix not in SKELETON_FILES + MARKER_FILES:
        kinds = ", ".join(SKELETON_FILES + MARKER_FILES)
        cells.problem("path", f"{row.path!r} is of no known kind ({kinds})")
    if suffix in SKELETON_FILES:
        for column, known in (("unit", (*METRES, "a number of metres")), ("up_axis", UP_AXES)):
            if cells.text(column) is None:
                choice = ", ".join(known)
                cells.problem(column, f"empty, but a {suffix} file does not say it: {choice}")
    if row.skeleton is None:
        cells.problem("skeleton", "empty; it names the file of config/skeletons to read with")
    elif skeletons is not None and row.skeleton not in skeletons:
        near = near_matches(row.skeleton, sorted(skeletons))
        cells.problem("skeleton", f"{row.skeleton!r} is not one of the skeletons{near}")


def _check_files(cells: Cells, row: ClipRow, datasets: Datasets, embedded: Names | None) -> None:
    """Note every file of the row that is not there, companions included."""
    names = {dataset for dataset, _ in datasets} | {EMBEDDED}
    if row.dataset is not None and row.dataset not in names:
        near = near_matches(row.dataset, sorted(names))
        cells.problem("dataset", f"{row.dataset!r} is not a dataset of datasets.tsv{near}")
        return
    asf = companion_skeleton(row.path) if row.path else None
    wanted = [("path", row.path), ("path", asf), ("forces", row.forces), ("static", row.static)]
    for column, name in wanted:
        if name and (reason := _why_missing(row, name, datasets, embedded)):
            cells.problem(column, reason + (f" (skeleton of {row.path})" if name is asf else ""))


def _why_missing(row: ClipRow, name: str, datasets: Datasets, embedded: Names | None) -> str:
    if row.dataset is None:
        file = row.local_file(name)
        try:
            found = "is a folder" if file.is_dir() else "no such file"
            return "" if file.is_file() else f"{found}: {file}"
        except OSError as error:
            return f"{error.strerror}: {file}"
    if row.dataset != EMBEDDED:
        known = (row.dataset, name) in datasets
        return "" if known else unknown_dataset_file(datasets, row.dataset, name)
    if embedded is None or name in embedded:
        return ""
    return f"{name!r} is not an embedded clip{near_matches(name, sorted(embedded))}"
