"""Whether a body can follow footprints, asked before anything is solved: timing, order, reach.

Every check names the rows it is about. What passes may still be infeasible; what fails is.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.body import Body
from motionstyle.errors import MotionStyleError
from motionstyle.spacetime.footprint_constraints import (
    PrintPose,
    frames_of,
    heel_of,
    print_poses,
)
from motionstyle.spacetime.footprints import (
    ONE_PRINT_M,
    SIDES,
    Footprint,
    labels,
    numbered,
    points_of,
    print_axes,
    sole_of,
)

Array = NDArray[np.float64]

UNIT_TOLERANCE = 1e-3
STEEPEST_DEG = 60.0  # of a surface that feet stand on
SAME_PLACE_M = 0.005
SHAPE_TOLERANCE_M = 0.03  # how far held points may be from the shape of the sole
SINK_M = 0.01  # how far a print may lie below the floor that the others share
LONGEST_STEP_LEGS = 1.6  # both feet down, hips at 0.6 leg lengths: 2√(1 − 0.6²)
FASTEST_MPS = 9.0  # of the pelvis between two stances that do not overlap
HIGHEST_STEP_LEGS = 0.9  # rise from one print to the next
LONGEST_REACH_LEGS = 1.1  # hip to heel as seen from above, pelvis midway between the feet's prints


def check_footprints(
    footprints: Sequence[Footprint],
    body: Body,
    frames: int,
    rate_hz: float,
    *,
    name: str = "footprints",
    alternate: bool = True,
) -> None:
    """Refuse footprints that no body of this size can follow in so many frames.

    Parameters
    ----------
    name : of the file, for messages.
    alternate : whether left and right have to take turns; False for hops.

    Raises
    ------
    MotionStyleError
        With every problem found, one a line, naming the rows.
    """
    if not footprints:
        raise MotionStyleError(f"{name}: no footprints")
    rows = tuple(footprints) if all(one.row for one in footprints) else numbered(footprints)
    problems = _alone(rows, frames, rate_hz)
    if not problems:  # the other checks need sound rows
        problems = [*_overlaps(rows, body, rate_hz), *_floor(rows)]
    if not problems:
        poses = print_poses(rows, body, rate_hz)
        problems = _steps(poses, body, rate_hz)
        problems += _order(poses) if alternate else []
    if problems:
        raise MotionStyleError("\n".join(f"{name}: {problem}" for problem in problems))


def _alone(rows: Sequence[Footprint], frames: int, rate_hz: float) -> list[str]:
    """Return what is wrong with single rows."""
    problems = []
    end = frames / rate_hz
    for one in rows:
        who = labels([one])
        first, stop = frames_of(one, rate_hz)
        span = f"from {one.t_on:g} to {one.t_off:g} s"
        if one.t_off <= one.t_on:
            problems.append(f"{who} is held {span}: t_off must lie after t_on")
        elif one.t_on < -0.5 / rate_hz or one.t_off > end + 0.5 / rate_hz:
            problems.append(f"{who} is held {span}, beyond the motion (0 to {end:g} s)")
        elif stop <= first:
            problems.append(
                f"{who} never touches: held {span}, shorter than one frame ({1 / rate_hz:.3g} s)"
            )
        size = float(np.linalg.norm(one.normal))
        if abs(size - 1) > UNIT_TOLERANCE:
            problems.append(f"{who}: the normal has length {size:.4g}, must be 1")
        elif one.normal_y < math.cos(math.radians(STEEPEST_DEG)):
            problems.append(
                f"{who}: the surface is steeper than {STEEPEST_DEG:.0f} degrees "
                f"(normal_y {one.normal_y:.3g})"
            )
    return problems


def _overlaps(rows: Sequence[Footprint], body: Body, rate_hz: float) -> list[str]:
    """Return rows that hold one point at once, or points of a foot apart from its shape."""
    problems = []
    soles = {foot: sole_of(body, foot) for foot in SIDES}
    places = [points_of(one, soles[one.foot]) for one in rows]
    heels = [heel_of(one, soles[one.foot]) for one in rows]
    told: set[tuple[float, ...]] = set()
    for i, j in itertools.combinations(range(len(rows)), 2):
        a, b = rows[i], rows[j]
        (a_on, a_off), (b_on, b_off) = frames_of(a, rate_hz), frames_of(b, rate_hz)
        first, stop = max(a_on, b_on), min(a_off, b_off)
        if a.foot != b.foot or stop <= first:
            continue
        when = f"at {first / rate_hz:.3g} s"
        apart = float(np.linalg.norm(heels[i] - heels[j]))
        if apart > ONE_PRINT_M:  # two prints: told once, not for each point of the foot
            key = (*heels[i].round(2), *heels[j].round(2))
            if key not in told:
                problems.append(
                    f"{labels([a, b])}: the {SIDES[a.foot]} foot stands in two places {when}, "
                    f"{apart:.2f} m apart; left and right must take turns"
                )
            told.add(key)
            continue
        shared = sorted(set(places[i]) & set(places[j]))
        if shared:
            away = max(float(np.linalg.norm(places[i][n] - places[j][n])) for n in shared)
            how = "in two places" if away > SAME_PLACE_M else "twice"
            problems.append(f"{labels([a, b])} hold {', '.join(shared)} {how} {when}")
            continue
        sole = soles[a.foot]
        for (n, p), (m, q) in itertools.product(places[i].items(), places[j].items()):
            wanted = math.dist(sole.points[n[:-2]], sole.points[m[:-2]])
            found = float(np.linalg.norm(p - q))
            if abs(found - wanted) > SHAPE_TOLERANCE_M:
                problems.append(
                    f"{labels([a, b])} hold {n} and {m} {found:.3f} m apart {when}; on this foot "
                    f"they are {wanted:.3f} m apart"
                )
                break
    return problems


def _floor(rows: Sequence[Footprint]) -> list[str]:
    """Return rows below the floor y = 0 on which most of the others stand."""
    level = [one for one in rows if one.normal_y > 1 - 1e-6]
    on_floor = [one for one in level if abs(one.y) <= SINK_M]
    if len(on_floor) < 2 / 3 * len(rows):
        return []
    return [
        f"{labels([one])} lies {-one.y:.3f} m below the floor, on which the others stand"
        for one in level
        if one.y < -SINK_M
    ]


def _steps(poses: Sequence[PrintPose], body: Body, rate_hz: float) -> list[str]:
    """Return steps too long, too high or too fast for the legs."""
    problems = []
    leg = body.leg_length
    for before, after in itertools.pairwise(poses):
        rows = labels([before.rows[0], after.rows[0]])
        step = after.heel - before.heel
        length, rise = float(np.hypot(step[0], step[2])), abs(float(step[1]))
        gap = (after.first - before.stop) / rate_hz
        allowed = LONGEST_STEP_LEGS * leg + max(gap, 0.0) * FASTEST_MPS
        if length > allowed:
            problems.append(
                f"{rows}: a step of {length:.2f} m is out of reach for legs of {leg:.2f} m "
                f"(at most {allowed:.2f} m with {max(gap, 0.0):.2g} s between the stances)"
            )
        elif rise > HIGHEST_STEP_LEGS * leg:
            problems.append(
                f"{rows}: a rise of {rise:.2f} m is out of reach for legs of {leg:.2f} m; "
                "the foot would never touch"
            )
    return problems or _reach(poses, leg, rate_hz)


def _reach(poses: Sequence[PrintPose], leg: float, rate_hz: float) -> list[str]:
    """Return stances that the pelvis walks away from before they end."""
    if len(poses) < 2:
        return []
    middles = np.array([(p.first + p.stop) / 2 for p in poses])
    heels = np.array([p.heel for p in poses])
    order = np.argsort(middles, kind="stable")
    times = (middles[order][1:] + middles[order][:-1]) / 2
    pelvis = (heels[order][1:] + heels[order][:-1]) / 2
    problems = []
    for pose in poses:
        frames = np.array([pose.first, pose.stop - 1], dtype=float)
        frames = frames[(frames >= times[0]) & (frames <= times[-1])]
        if len(frames) == 0:
            continue
        forward, _right = print_axes(pose.yaw, pose.normal)
        middle = pose.heel + 0.1 * forward
        path = np.column_stack([np.interp(frames, times, pelvis[:, k]) for k in (0, 2)])
        away = np.linalg.norm(path - middle[[0, 2]], axis=1)
        if away.max() > LONGEST_REACH_LEGS * leg:
            at = float(frames[np.argmax(away)]) / rate_hz
            problems.append(
                f"{labels(pose.rows[:1])}: still held at {at:.3g} s, when the other prints have "
                f"the pelvis {away.max():.2f} m away; legs are {leg:.2f} m long"
            )
    return problems


def _order(poses: Sequence[PrintPose]) -> list[str]:
    """Return stances of one foot that follow each other without one of the other foot."""
    problems = []
    for before, after in itertools.pairwise(poses):
        if before.foot != after.foot:
            continue
        moved = float(np.linalg.norm(after.heel - before.heel))
        down = any(
            p.foot != after.foot and p.first <= before.stop and p.stop >= after.first for p in poses
        )
        if moved > 0.1 and not down:
            problems.append(
                f"{labels([before.rows[0], after.rows[0]])}: the {SIDES[after.foot]} foot steps "
                f"twice in a row ({moved:.2f} m) with no {SIDES['l' if after.foot == 'r' else 'r']}"
                " step between; left and right must take turns"
            )
    return problems + _crossed(poses)


def _crossed(poses: Sequence[PrintPose]) -> list[str]:
    """Return prints on the wrong side of the other foot's line, by more than a foot's width."""
    problems = []
    for before, middle, after in zip(poses[:-2], poses[1:-1], poses[2:], strict=True):
        if not before.foot == after.foot != middle.foot:
            continue
        turned = abs((after.yaw - before.yaw + 180) % 360 - 180)
        way = (after.heel - before.heel) * [1, 0, 1]
        length = float(np.linalg.norm(way))
        if turned > 15 or length < 0.3:
            continue
        right = np.cross(way / length, [0.0, 1.0, 0.0])
        aside = float((middle.heel - before.heel) @ right)
        inside = aside if middle.foot == "l" else -aside
        if inside > 0.15:
            problems.append(
                f"{labels([middle.rows[0]])} lies {inside:.2f} m on the wrong side of the other "
                "foot's line; are left and right exchanged?"
            )
    return problems
