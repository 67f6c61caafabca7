"""The tasks of motion adaptation, `config/adaptations.tsv`."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from motionstyle.errors import MotionStyleError
from motionstyle.mocap.datasets.cells import Cells, finite

COLUMNS = (
    *("task", "action", "example", "first_segment", "segments", "stride", "rises_m"),
    *("turn_deg", "obstacle_m", "obstacle_after", "balance", "figure", "note"),
)


@dataclass(frozen=True)
class Task:
    """One row of the table; see the head of the file.

    Attributes
    ----------
    task, action, example : names of the task, of the kind of movement and of the example clip.
    first_segment, segments : which whole-body segments of the example are taken.
    stride : factor on the way from foothold to foothold.
    rises_m : height gained at each new foothold; the last value holds for the rest.
    turn_deg : heading gained over the task, positive to the left.
    obstacle_m, obstacle_after : height of a bar across the way, and the foothold before it.
    balance : whether balance is marked at the end.
    figure : the figure of the paper the task stands for, or empty.
    """

    task: str
    action: str
    example: str
    first_segment: int = 0
    segments: int = 3
    stride: float = 1.0
    rises_m: tuple[float, ...] = ()
    turn_deg: float = 0.0
    obstacle_m: float = 0.0
    obstacle_after: int = 0
    balance: bool = False
    figure: str = ""
    note: str = ""

    def rise(self, foothold: int) -> float:
        """Return the height gained on reaching foothold 1, 2, …."""
        if not self.rises_m:
            return 0.0
        return self.rises_m[min(foothold, len(self.rises_m)) - 1]


def read_tasks(path: str | Path, clips: Collection[str] | None = None) -> tuple[Task, ...]:
    """Read and check the tasks; those whose example is not among `clips` are left out.

    Raises
    ------
    MotionStyleError
        With every problem of the table, one a line.
    """
    path = Path(path)
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise MotionStyleError(f"{path}: not a readable table of tasks ({error})") from error
    rows = [(n, x.split("\t")) for n, x in enumerate(lines, 1) if x.strip() and x[0] != "#"]
    if not rows or tuple(c.strip() for c in rows[0][1]) != COLUMNS:
        raise MotionStyleError(
            f"{path}: the first line must name the columns {', '.join(COLUMNS)}, divided by tabs"
        )
    problems: list[str] = []
    tasks: list[Task] = []
    for number, line in rows[1:]:
        if len(line) != len(COLUMNS):
            problems.append(f"{path.name} row {number}: {len(line)} cells, expected {len(COLUMNS)}")
            continue
        named = dict(zip(COLUMNS, (c.strip() for c in line), strict=True))
        tasks.append(_task(Cells(path.name, number, named, problems)))
        if tasks[-1].task in {t.task for t in tasks[:-1]}:
            problems.append(f"{path.name} row {number}: task {tasks[-1].task!r} stands there twice")
    if problems:
        raise MotionStyleError("\n".join(problems))
    return tuple(t for t in tasks if clips is None or t.example in clips)


def _task(cells: Cells) -> Task:
    rises: list[float] = []
    for text in filter(None, (cells.text("rises_m") or "").split(",")):
        value = finite(text.strip())
        if value is None or abs(value) > 3:
            cells.problem("rises_m", f"{text!r} is not a height in m between -3 and 3")
        else:
            rises.append(value)
    far = {"above": -360.0, "up_to": 360.0}
    return Task(
        task=cells.identifier("task"),
        action=cells.one_of("action", ("walk", "jump", "run")) or "walk",
        example=cells.required("example"),
        first_segment=cells.whole("first_segment", 0) or 0,
        segments=cells.whole("segments", 1) or 3,
        stride=cells.number("stride", "a factor above 0, up to 5", above=0, up_to=5) or 1.0,
        rises_m=tuple(rises),
        turn_deg=cells.number("turn_deg", "an angle in degrees", **far) or 0.0,
        obstacle_m=cells.number("obstacle_m", "a height up to 1 m", above=0, up_to=1) or 0.0,
        obstacle_after=cells.whole("obstacle_after", 0) or 0,
        balance=cells.one_of("balance", ("yes", "no")) == "yes",
        figure=cells.text("figure") or "",
        note=cells.text("note") or "",
    )
