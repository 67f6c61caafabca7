"""The sheet of styles to be learnt: one row a style: a window of a clip, and what it is."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from motionstyle.errors import MotionStyleError, near_matches
from motionstyle.mocap.datasets.cells import Cells, sheet_rows
from motionstyle.motion.motion import Motion
from motionstyle.spacetime.synthesis_sheet import MOODS

COLUMNS = (
    *("id", "clip", "first_frame", "last_frame", "mood", "action", "set", "algorithms"),
    "against",
)
SETS = ("development", "held_out")
ALGORITHMS = ("ours", "paper")
SHORTEST = 12  # frames: whole cubic splines and a stance


@dataclass(frozen=True)
class StyleRow:
    """One row of the sheet.

    Attributes
    ----------
    id : the style's name in tables. clip : it is learnt from; one style a clip.
    first_frame, last_frame : window of the clip's physical motion at its own rate, both included.
    mood, action : what moves how. set : whether settings were found on it.
    algorithms : by which it is learnt. against : id of the style it is compared with, or empty.
    """

    id: str
    clip: str
    first_frame: int | None
    last_frame: int | None
    mood: str
    action: str
    set: str
    algorithms: tuple[str, ...]
    against: str

    def window(self, motion: Motion) -> Motion:
        """Return the row's window of the clip's motion.

        Raises
        ------
        MotionStyleError
            If it reaches beyond the motion.
        """
        last = motion.frames - 1 if self.last_frame is None else self.last_frame
        if last >= motion.frames:
            raise MotionStyleError(
                f"style {self.id}: last_frame is {last}, but {motion.id} ends at frame "
                f"{motion.frames - 1}; choose an earlier one"
            )
        return motion.window(self.first_frame or 0, last)


def read_styles(path: str | Path, clips: Collection[str] | None = None) -> tuple[StyleRow, ...]:
    """Read and check the sheet.

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
    rows: list[StyleRow] = []
    first: dict[tuple[str, str], int] = {}
    for cells in sheet_rows(path, COLUMNS, problems):
        row = _row(cells)
        rows.append(row)
        for column, value in (("id", row.id.casefold()), ("clip", row.clip)):
            former = first.setdefault((column, value), cells.row)
            if former != cells.row and value:
                cells.problem(column, f"{value!r} stands already in row {former}")
        if clips is not None and row.clip and row.clip not in clips:
            near = near_matches(row.clip, sorted(clips))
            cells.problem("clip", f"{row.clip!r} is not a clip of the motion sheet{near}")
    known = {row.id for row in rows}
    problems += [
        f"{path.name}, style {row.id}: against {row.against!r}, which is not a style of the sheet"
        f"{near_matches(row.against, sorted(known))}"
        for row in rows
        if row.against and row.against not in known - {row.id}
    ]
    if problems:
        raise MotionStyleError("\n".join(problems))
    return tuple(rows)


def read_style_row(path: str | Path, clip: str) -> StyleRow:
    """Return the row of one clip."""
    return next(row for row in read_styles(path) if row.clip == clip)


def _row(cells: Cells) -> StyleRow:
    for column in ("mood", "set", "algorithms"):
        cells.required(column)
    row = StyleRow(
        id=cells.identifier("id"),
        clip=cells.required("clip"),
        first_frame=cells.whole("first_frame", 0),
        last_frame=cells.whole("last_frame", 0),
        mood=cells.one_of("mood", MOODS) or MOODS[0],
        action=cells.required("action"),
        set=cells.one_of("set", SETS) or SETS[0],
        algorithms=cells.some_of("algorithms", ALGORITHMS),
        against=cells.text("against") or "",
    )
    if row.last_frame is not None and row.last_frame - (row.first_frame or 0) < SHORTEST - 1:
        cells.problem("last_frame", f"a window needs at least {SHORTEST} frames")
    return row
