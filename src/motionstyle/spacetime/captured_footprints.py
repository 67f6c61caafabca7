"""The footprints of a motion that is there: extracted from its contacts (Liu et al. 2005, §4.2).

Feet of captured motion are not quite still and not quite rigid: a stance's heel and toe lie 2–10 mm
off the shape of the sole. "own" footprints keep each point's mean place, for learning on the very
motion; "rigid" ones give each stance one pose of the flat sole, for synthesis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.kinematics import contact_points
from motionstyle.body.layout import CONTACT_POINTS
from motionstyle.mocap.fitting.floor import runs
from motionstyle.motion.motion import Motion
from motionstyle.spacetime.footprints import (
    GROUPS,
    ONE_PRINT_M,
    Footprint,
    Sole,
    numbered,
    print_axes,
    sole_of,
)

Array = NDArray[np.float64]
Shape = Literal["own", "rigid"]
LEVEL_FLOOR_M = 0.05  # a level stance whose points lie lower than this stands on y = 0
UPRIGHT = 1 - 1e-9


@dataclass(frozen=True)
class _Run:
    """One point of a foot bearing in frames first to last (included), its mean place (3,), m."""

    point: str
    first: int
    last: int
    place: Array


def footprints_of(motion: Motion, shape: Shape = "rigid") -> tuple[Footprint, ...]:
    """Return the footprints of a motion, in order of time.

    Parameters
    ----------
    shape : "own" holds every point where it was in the mean of its contact; "rigid" where the
        flat sole, laid into the stance's points by least squares, has it.
    """
    points = contact_points(motion.body, motion.pose())
    rows: list[Footprint] = []
    for foot in "rl":
        columns = {p: CONTACT_POINTS.index(f"{p}_{foot}") for p in GROUPS["foot"]}
        sole = sole_of(motion.body, foot)
        for first, last in runs(motion.contacts[:, list(columns.values())].any(axis=1)):
            found = [
                _Run(p, first + a, first + b, points[first + a : first + b + 1, k].mean(axis=0))
                for p, k in columns.items()
                for a, b in runs(motion.contacts[first : last + 1, k])
            ]
            yaw = _yaw(points, motion, columns, (first, last))
            for stance in _prints(found, sole, yaw):
                span = min(r.first for r in stance), max(r.last for r in stance)
                normal = _stance_normal(motion, columns, *span)
                yaw = _yaw(points, motion, columns, span)
                if shape == "own":
                    rows += [_row(foot, r, r.place, (yaw, normal), motion.rate_hz) for r in stance]
                else:
                    rows += _rigid(foot, stance, sole, (yaw, normal), motion.rate_hz)
    order = {name: k for k, name in enumerate(GROUPS)}
    rows.sort(key=lambda one: (one.t_on, one.foot, order[one.point]))
    return numbered(rows)


def _prints(stance: list[_Run], sole: Sole, yaw: float) -> list[list[_Run]]:
    """Part the runs of a stance by print: a toe may leave one step as the heel meets the next."""
    forward, right = print_axes(yaw, np.array([0.0, 1.0, 0.0]))
    prints: list[tuple[Array, list[_Run]]] = []
    for run in sorted(stance, key=lambda run: (run.first, run.last)):
        ahead, aside = sole.points[run.point]
        heel = run.place - ahead * forward - aside * right
        for place, members in prints:
            if np.linalg.norm(heel - place) < ONE_PRINT_M:
                members.append(run)
                break
        else:
            prints.append((heel, [run]))
    return [members for _place, members in prints]


def _row(
    foot: str, run: _Run, place: Array, plane: tuple[float, Array], rate_hz: float
) -> Footprint:
    yaw, normal = plane
    times = (run.first / rate_hz, (run.last + 1) / rate_hz)
    return Footprint(foot, run.point, *times, *place.tolist(), yaw, *normal.tolist())


def _stance_normal(motion: Motion, columns: dict[str, int], first: int, last: int) -> Array:
    """Return the mean unit normal of a stance's contacts."""
    own = list(columns.values())
    normals = motion.contact_normals[first : last + 1, own]
    mean = normals[motion.contacts[first : last + 1, own]].mean(axis=0)
    return mean / np.linalg.norm(mean)


def _yaw(points: Array, motion: Motion, columns: dict[str, int], span: tuple[int, int]) -> float:
    """Return where heel to ball points in a stance, degrees: in its flat frames, if it has any."""
    frames = np.arange(span[0], span[1] + 1)
    heel, medial, lateral, _toe = (columns[name] for name in GROUPS["foot"])
    flat = frames[motion.contacts[frames, heel] & motion.contacts[frames, medial]]
    chosen = flat if len(flat) else frames
    way = (points[chosen, medial] + points[chosen, lateral]) / 2 - points[chosen, heel]
    x, _y, z = way.mean(axis=0)
    return math.degrees(math.atan2(-z, x))


def _rigid(
    foot: str, stance: list[_Run], sole: Sole, plane: tuple[float, Array], rate_hz: float
) -> list[Footprint]:
    """Return the rows of a stance with the flat sole laid into it; both sides of a ball as one."""
    yaw, normal = plane
    forward, right = print_axes(yaw, normal)
    weights = np.array([run.last + 1 - run.first for run in stance], dtype=float)
    weights /= weights.sum()
    places = np.array([run.place for run in stance])
    local = np.array([sole.points[run.point] for run in stance])
    seen = np.column_stack([places @ forward, places @ right])
    middle, centre = weights @ local, weights @ seen
    a, b = local - middle, seen - centre
    left = math.atan2(
        float(weights @ (a[:, 1] * b[:, 0] - a[:, 0] * b[:, 1])), float(weights @ (a * b).sum(1))
    )
    turned_forward = math.cos(left) * forward - math.sin(left) * right
    turned_right = np.cross(turned_forward, normal)
    height = float(weights @ (places @ normal))
    if normal[1] > UPRIGHT and abs(height) < LEVEL_FLOOR_M:
        height = 0.0
    origin = centre[0] * forward + centre[1] * right + height * normal
    heel = origin - middle[0] * turned_forward - middle[1] * turned_right
    turned_yaw = math.degrees(math.atan2(-turned_forward[2], turned_forward[0]))
    found = []
    for run in _joined(stance):
        ahead, aside = sole.of(run.point)
        place = heel + ahead * turned_forward + aside * turned_right
        found.append(_row(foot, run, place, (turned_yaw, normal), rate_hz))
    return found


def _joined(stance: list[_Run]) -> list[_Run]:
    """Return the runs with both sides of a ball that bear together joined to `ball`."""
    lateral = {(r.first, r.last) for r in stance if r.point == "ball_lateral"}
    both = {
        (r.first, r.last)
        for r in stance
        if r.point == "ball_medial" and (r.first, r.last) in lateral
    }
    kept = []
    for run in stance:
        together = run.point.startswith("ball") and (run.first, run.last) in both
        if not together:
            kept.append(run)
        elif run.point == "ball_medial":
            kept.append(_Run("ball", run.first, run.last, run.place))
    return kept
