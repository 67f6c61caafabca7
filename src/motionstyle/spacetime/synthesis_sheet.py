"""The sheet of motions to be synthesised: one row per motion: style, footprints, edits.

Cells for footprints and edits are words divided by spaces: a source and `name=value` pairs, e.g.
`arc radius_m=2.5 side=left` and `load=suitcase narrow.hip_flexion_l=0.5`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from motionstyle.body.layout import COORDINATES, JOINT_COORDINATES
from motionstyle.errors import MotionStyleError, near_matches
from motionstyle.mocap.datasets.cells import Cells, finite, sheet_rows
from motionstyle.spacetime.edits import SUITCASE, Edits

COLUMNS = (
    *("id", "experiment", "task", "example", "style", "mood", "footprints", "edits"),
    *("first_frame", "last_frame", "others", "note"),
)
TASKS = (
    *("same_footprints", "line", "curve", "turn_180", "ramp_up", "ramp_down"),
    *("stairs_up", "stairs_down", "captured_stairs", "limp", "suitcase", "springy_shoes"),
    *("skating", "body_size", "other_style"),
)
MOODS = ("neutral", "sad", "happy", "angry", "other")
# Recipes of styles: whoever adds one adds a rule that writes `styles/RECIPE/CLIP.json`.
STYLES = ("initial", "hand", "twin", "paper", "ours")
OWN_STYLE = "file"  # the recipe of a style that the sheet names by its path
NAMED_LOADS = {"suitcase": SUITCASE}
JOINTS = COORDINATES[JOINT_COORDINATES]

_SCALES = {"step_scale": 1.0, "time_scale": 1.0}
# Sources of footprints with their parameters; None must be given, the type of others is kept.
SOURCES: dict[str, dict[str, float | str | None]] = {
    "captured": {"motion": ""},
    "file": {"path": None},
    "line": {**_SCALES},
    "arc": {"radius_m": math.nan, "side": None, "lead_m": 0.0, **_SCALES},
    "turn": {
        **{"radius_m": math.nan, "side": None, "lead_m": 0.0},
        **{"angle_deg": 180.0, "turn_step_scale": 0.6, "time_scale": 1.0},
    },
    "ramp": {"slope_deg": math.nan, "level_m": -math.inf, **_SCALES},
    "stairs": {"tread_m": math.nan, "rise_m": math.nan, "time_scale": 1.0},
}
EDITS = ("load", "shoe_stiffness", "shoe_rest_length", "friction", "length_scale", "mass_scale")


@dataclass(frozen=True)
class FootprintSource:
    """Where footprints come from: a key of `SOURCES` and its parameters; `slide` frees all feet."""

    kind: str = "captured"
    values: Mapping[str, float | str] = field(default_factory=dict)
    slide: bool = False

    def number(self, name: str) -> float:
        """Return a numeric parameter."""
        return float(self.values[name])

    def text(self, name: str) -> str:
        """Return a text parameter."""
        return str(self.values[name])


@dataclass(frozen=True)
class SynthesisRow:
    """One row of the sheet.

    Attributes
    ----------
    id : name of the motion. experiment : the claim it serves, if it serves one alone.
    task : one of `TASKS`. example : clip whose motion is copied and whose style it is by default.
    style : one of `STYLES`, and after a colon the clip it was made from, if that is not the
        example; or the path of a style's JSON file, relative to the sheet.
    mood : of the style, one of `MOODS`. footprints, edits : see their types.
    first_frame, last_frame : window of the example's physical motion, both included.
    others : clips whose style or subject it must not resemble more than its own.
    row : line of the sheet. folder : the sheet's folder.
    """

    id: str
    experiment: str | None
    task: str
    example: str
    style: str
    mood: str
    footprints: FootprintSource
    edits: Edits
    first_frame: int | None
    last_frame: int | None
    others: tuple[str, ...]
    note: str | None
    row: int
    folder: Path

    @property
    def recipe(self) -> str:
        """How the style was made; `file` if the sheet names a style's file."""
        return OWN_STYLE if is_style_file(self.style) else self.style.split(":")[0]

    @property
    def style_clip(self) -> str:
        """The clip the style was made from; of a style's own file, the example."""
        named = ":" in self.style and self.recipe != OWN_STYLE
        return self.style.split(":")[1] if named else self.example

    @property
    def style_file(self) -> Path | None:
        """The style's own file, if the sheet names one."""
        return self.folder / self.style if self.recipe == OWN_STYLE else None

    @property
    def footprint_clip(self) -> str:
        """The clip whose footprints are taken as they are, or an empty text."""
        if self.footprints.kind != "captured":
            return ""
        return self.footprints.text("motion") or self.example

    @property
    def clips(self) -> tuple[str, ...]:
        """Every clip that the motion is made from."""
        wanted = (self.example, self.style_clip, self.footprint_clip)
        return tuple(dict.fromkeys(filter(None, wanted)))


def is_style_file(style: str) -> bool:
    """Whether a cell of the column `style` names a file."""
    return style.lower().endswith(".json")


def read_syntheses(
    path: str | Path, clips: Collection[str] | None = None
) -> tuple[SynthesisRow, ...]:
    """Read and check the sheet; rows are counted as an editor counts lines.

    Parameters
    ----------
    clips : clips that rows may name; not checked if None.

    Raises
    ------
    MotionStyleError
        With every problem of the sheet, one a line.
    """
    path = Path(path)
    problems: list[str] = []
    rows: list[SynthesisRow] = []
    seen: dict[str, int] = {}
    for cells in sheet_rows(path, COLUMNS, problems):
        row = _row(cells, path.parent)
        if clips is not None:
            _check_clips(cells, row, sorted(clips))
        former = seen.setdefault(row.id.casefold(), cells.row)
        if former != cells.row and row.id:
            cells.problem("id", f"{row.id!r} is already the id of row {former}")
        rows.append(row)
    if problems:
        raise MotionStyleError("\n".join(problems))
    return tuple(rows)


def read_row(path: str | Path, id: str) -> SynthesisRow:
    """Return one row of the sheet.

    Raises
    ------
    MotionStyleError
        If the sheet has problems or no such row.
    """
    rows = {row.id: row for row in read_syntheses(path)}
    if id not in rows:
        raise MotionStyleError(f"{path}: no synthesis {id!r}{near_matches(id, list(rows))}")
    return rows[id]


def _row(cells: Cells, folder: Path) -> SynthesisRow:
    style = cells.required("style")
    recipe = style.split(":")[0]
    if is_style_file(style):
        if not (folder / style).is_file():
            cells.problem("style", f"there is no file {folder / style}; paths begin at the sheet")
    elif style and recipe not in STYLES:
        near = near_matches(recipe, STYLES)
        cells.problem(
            "style", f"{recipe!r} is not one of {', '.join(STYLES)}, nor a path to a .json{near}"
        )
    cells.required("task")
    row = SynthesisRow(
        id=cells.identifier("id"),
        experiment=cells.text("experiment"),
        task=cells.one_of("task", TASKS) or TASKS[0],
        example=cells.required("example"),
        style=style or STYLES[0],
        mood=cells.one_of("mood", MOODS) or "neutral",
        footprints=_source(cells),
        edits=_edits(cells),
        first_frame=cells.whole("first_frame", 0),
        last_frame=cells.whole("last_frame", 0),
        others=tuple(part.strip() for part in (cells.text("others") or "").split(",") if part),
        note=cells.text("note"),
        row=cells.row,
        folder=folder,
    )
    if row.id.endswith("_copied"):
        cells.problem(
            "id", f"{row.id!r} ends in '_copied', which names the baseline of another row"
        )
    if row.last_frame is not None and row.last_frame - (row.first_frame or 0) < 7:
        cells.problem("last_frame", "a window needs at least 8 frames, from first_frame on")
    return row


def _check_clips(cells: Cells, row: SynthesisRow, clips: list[str]) -> None:
    columns = (
        ("example", (row.example,)),
        ("style", (row.style_clip,) if row.style_clip != row.example else ()),
        ("footprints", (row.footprint_clip,)),
        ("others", row.others),
    )
    for column, names in columns:
        for name in names:
            if name and name not in clips:
                near = near_matches(name, clips)
                cells.problem(column, f"{name!r} is not a clip of the motion sheet{near}")


def _pairs(cells: Cells, column: str, words: list[str]) -> list[tuple[str, str]]:
    """Return the name=value pairs of some words; others are noted."""
    found = []
    for word in words:
        name, equals, value = word.partition("=")
        if not equals or not value:
            cells.problem(column, f"{word!r} is no name=value pair")
        elif any(name == other for other, _ in found) and name != "load":
            cells.problem(column, f"{name} stands there twice")
        else:
            found.append((name, value))
    return found


def _source(cells: Cells) -> FootprintSource:
    kind, *words = (cells.text("footprints") or "captured").split()
    if kind not in SOURCES:
        near = near_matches(kind, list(SOURCES))
        cells.problem("footprints", f"{kind!r} is not one of {', '.join(SOURCES)}{near}")
        return FootprintSource()
    known = SOURCES[kind]
    values: dict[str, float | str] = {n: v for n, v in known.items() if v is not None}
    slide = False
    for name, text in _pairs(cells, "footprints", words):
        number = finite(text)
        if name == "slide" and text in {"yes", "no"}:
            slide = text == "yes"
        elif name not in known:
            near = near_matches(name, [*known, "slide"])
            choice = ", ".join([*known, "slide"])
            cells.problem("footprints", f"{name!r} is no parameter of {kind} ({choice}){near}")
        elif not isinstance(known[name], float):
            values[name] = text
        elif number is None:
            cells.problem("footprints", f"{name} is {text!r}, not a number")
        else:
            values[name] = number
    for name, default in known.items():
        absent = name not in values or (isinstance(default, float) and math.isnan(default))
        if absent and (name not in values or math.isnan(float(values[name]))):
            cells.problem("footprints", f"{kind} needs {name}")
            values[name] = ""
    if values.get("side", "left") not in {"left", "right", ""}:
        cells.problem("footprints", f"side is {values['side']!r}, must be left or right")
    return FootprintSource(kind, values, slide)


def _edits(cells: Cells) -> Edits:
    loads, locked, narrowed, numbers = [], {}, {}, {}
    for name, text in _pairs(cells, "edits", (cells.text("edits") or "").split()):
        what, _dot, joint = name.partition(".")
        number = finite(text)
        if name == "load":
            if text in NAMED_LOADS:
                loads.append(NAMED_LOADS[text])
            else:
                near = near_matches(text, list(NAMED_LOADS))
                cells.problem("edits", f"{text!r} is no load ({', '.join(NAMED_LOADS)}){near}")
        elif what in {"lock", "narrow"} and joint in JOINTS and number is not None:
            (locked if what == "lock" else narrowed)[joint] = number
        elif what in {"lock", "narrow"} and joint not in JOINTS:
            near = near_matches(joint, JOINTS)
            cells.problem("edits", f"{joint!r} is not a joint coordinate{near}")
        elif name in EDITS and number is not None:
            numbers[name] = number
        elif number is None:
            cells.problem("edits", f"{name} is {text!r}, not a number")
        else:
            known = (*EDITS, "lock.JOINT", "narrow.JOINT")
            near = near_matches(re.sub(r"\..*", ".JOINT", name), known)
            cells.problem("edits", f"{name!r} is not one of {', '.join(known)}{near}")
    try:
        return Edits(loads=tuple(loads), locked=locked, narrowed=narrowed, **numbers)
    except MotionStyleError as error:
        cells.problem("edits", str(error).removeprefix("edits: "))
        return Edits()
