"""Footprints: which point of a foot is held where and when (Liu et al. 2005, §4.2 and §7).

One `Footprint` is one row of a `footprints.tsv`: tab-separated, units m, s and degrees, y up. It
comes from a captured motion (`captured_footprints`), a generator (`relay`), or a user's editor.

A row holds one contact point, or a group of them laid out as the foot's flat sole prescribes:
`heel`, `ball` (its middle; both sides are held), `toe`, or `foot` (all four; the place is that of
the heel). The yaw says where heel to ball points: 0 along +x, 90 to the left (along −z).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.body import Body
from motionstyle.body.layout import CONTACT_POINTS, NODE_INDEX
from motionstyle.errors import MotionStyleError
from motionstyle.files import atomic_write
from motionstyle.mocap.datasets.cells import Cells, sheet_rows

Array = NDArray[np.float64]

COLUMNS = (
    *("foot", "point", "t_on", "t_off", "x", "y", "z", "yaw"),
    *("normal_x", "normal_y", "normal_z", "slide"),
)
UNITS = "# times in s (held from t_on up to t_off), places in m (y up), yaw in degrees"
SIDES = {"r": "right", "l": "left"}
GROUPS: dict[str, tuple[str, ...]] = {
    "heel": ("heel",),
    "ball": ("ball_medial", "ball_lateral"),
    "ball_medial": ("ball_medial",),
    "ball_lateral": ("ball_lateral",),
    "toe": ("toe",),
    "foot": ("heel", "ball_medial", "ball_lateral", "toe"),
}
ONE_PRINT_M = 0.1  # rows of a foot whose heels lie farther apart are different prints
HEADER_LINES = 2  # of a written file: the units and the names of the columns


@dataclass(frozen=True)
class Footprint:
    """One foot point, or group of points, held for a period.

    Attributes
    ----------
    foot : "r" or "l". point : a key of `GROUPS`.
    t_on, t_off : held from t_on up to t_off, s from the motion's first frame.
    x, y, z : where, m. yaw : heading of the foot, degrees.
    normal_x, normal_y, normal_z : unit normal of the surface.
    slide : held to the surface only, free to move along it.
    row : line of the file, for messages; not compared.
    """

    foot: str
    point: str
    t_on: float
    t_off: float
    x: float
    y: float
    z: float
    yaw: float
    normal_x: float = 0.0
    normal_y: float = 1.0
    normal_z: float = 0.0
    slide: bool = False
    row: int = field(default=0, compare=False)

    @property
    def place(self) -> Array:
        """Where the point is held, (3,), m."""
        return np.array([self.x, self.y, self.z])

    @property
    def normal(self) -> Array:
        """Unit normal of the surface, (3,)."""
        return np.array([self.normal_x, self.normal_y, self.normal_z])


@dataclass(frozen=True)
class Sole:
    """Where the points of one flat foot lie, seen from above: (forward, right) of the heel, m.

    points : by the names of `GROUPS["foot"]`.
    """

    points: dict[str, tuple[float, float]]

    def of(self, point: str) -> Array:
        """Return (forward, right) of a group's place: its points' mean; for `foot` the heel."""
        if point == "foot":
            return np.zeros(2)
        return np.mean([self.points[name] for name in GROUPS[point]], axis=0)


def sole_of(body: Body, foot: str) -> Sole:
    """Return the flat sole of a foot (`r` or `l`).

    The sole is the plane through the heel and both sides of the ball; the toe tip reaches it by
    turning about the toe joint.
    """
    local = {
        name: body.geometry.contact_points[CONTACT_POINTS.index(f"{name}_{foot}")]
        for name in GROUPS["foot"]
    }
    heel, medial, lateral = (local[n] for n in ("heel", "ball_medial", "ball_lateral"))
    forward = (medial + lateral) / 2 - heel
    forward = forward / np.linalg.norm(forward)
    right = (lateral - medial) * (1.0 if foot == "r" else -1.0)
    right = right - (right @ forward) * forward
    right = right / np.linalg.norm(right)
    up = np.cross(right, forward)
    flat = {
        name: (float((p - heel) @ forward), float((p - heel) @ right))
        for name, p in local.items()
        if name != "toe"
    }
    joint = body.joint_offsets[NODE_INDEX[f"toes_{foot}"]] - heel
    length, aside = math.hypot(*local["toe"][:2]), float(local["toe"] @ np.array([0, 0, 1.0]))
    height = float(joint @ up)
    reach = math.sqrt(max(length**2 - height**2, 0.0))
    flat["toe"] = (float(joint @ forward) + reach, float(joint @ right) + aside)
    return Sole(flat)


def print_axes(yaw_deg: float, normal: Array) -> tuple[Array, Array]:
    """Return unit vectors forward and right (3,) in the plane of `normal`, at yaw from above."""
    yaw = math.radians(yaw_deg)
    level = np.array([math.cos(yaw), 0.0, -math.sin(yaw)])
    forward = level - np.array([0.0, 1.0, 0.0]) * (level @ normal) / normal[1]
    forward /= np.linalg.norm(forward)
    return forward, np.cross(forward, normal)


def points_of(footprint: Footprint, sole: Sole) -> dict[str, Array]:
    """Return the places (3,), m, of the contact points a row holds, by name with its side."""
    normal = footprint.normal
    forward, right = print_axes(footprint.yaw, normal)
    origin = sole.of(footprint.point)
    found = {}
    for name in GROUPS[footprint.point]:
        ahead, aside = np.array(sole.points[name]) - origin
        found[f"{name}_{footprint.foot}"] = footprint.place + ahead * forward + aside * right
    return found


def numbered(footprints: Sequence[Footprint]) -> tuple[Footprint, ...]:
    """Return the rows with the line numbers they have in a written file."""
    return tuple(replace(one, row=HEADER_LINES + 1 + index) for index, one in enumerate(footprints))


def write_footprints(path: str | Path, footprints: Sequence[Footprint]) -> None:
    """Write `footprints.tsv` atomically: micrometres, microseconds, millionths of a degree."""
    with atomic_write(path) as handle:
        handle.write(UNITS + "\n" + "\t".join(COLUMNS) + "\n")
        for one in footprints:
            handle.write("\t".join(_cell(getattr(one, name)) for name in COLUMNS) + "\n")


def _cell(value: str | float | bool) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return (
        value if isinstance(value, str) else f"{round(value, 6) + 0.0:.6f}".rstrip("0").rstrip(".")
    )


def read_footprints(path: str | Path) -> tuple[Footprint, ...]:
    """Read `footprints.tsv`; empty lines and lines that begin with `#` are passed over.

    Whether a body can follow them is another question: see `footprint_checks`.

    Raises
    ------
    MotionStyleError
        With every wrong cell, one a line.
    """
    path = Path(path)
    problems: list[str] = []
    found = []
    for cells in sheet_rows(
        path, COLUMNS, problems, none="no footprints under the names of the columns"
    ):
        before = len(problems)
        values = {name: _number(cells, name) for name in COLUMNS[2:11]}
        for name in ("foot", "point"):
            cells.required(name)
        foot, point = cells.one_of("foot", tuple(SIDES)), cells.one_of("point", tuple(GROUPS))
        slide = cells.one_of("slide", ("yes", "no")) == "yes"
        if len(problems) == before and foot and point:
            found.append(Footprint(foot, point, **values, slide=slide, row=cells.row))
    if problems:
        raise MotionStyleError("\n".join(problems))
    return tuple(found)


def _number(cells: Cells, column: str) -> float:
    if not cells.required(column):
        return math.nan
    value = cells.number(column, "a number", above=-math.inf)
    return math.nan if value is None else value


def labels(footprints: Sequence[Footprint]) -> str:
    """Return "row 3 (right heel)" or "rows 3 and 5 (…)" for messages."""
    names = [f"{one.row} ({SIDES[one.foot]} {one.point})" for one in footprints]
    return ("row " if len(names) == 1 else "rows ") + " and ".join(names)
