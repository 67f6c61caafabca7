"""From footprints, or from a captured motion, to the constraints C(X) that the optimiser sees.

The ground under a point that swings is not in the footprints. It is taken as the plane of the
nearest print, of either foot, under the way from the foot's last print to its next one: the common
plane on a floor or a ramp, the steps on stairs, with a margin before and behind every edge.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.body import Body
from motionstyle.body.kinematics import contact_points
from motionstyle.body.layout import CONTACT_POINTS
from motionstyle.motion.motion import Motion
from motionstyle.spacetime.captured_footprints import footprints_of
from motionstyle.spacetime.foot_constraints import FootConstraints
from motionstyle.spacetime.footprints import (
    GROUPS,
    ONE_PRINT_M,
    Footprint,
    Sole,
    points_of,
    print_axes,
    sole_of,
)

Array = NDArray[np.float64]

FRICTION = 0.8  # dry shoe on a floor
SLIDING_FRICTION = 0.02  # a skate on ice
EDGE_MARGIN_M = 0.04  # how far before and behind an edge a swinging foot keeps to the upper step
USUAL_SWING_S = 0.4  # of a swing cut off by the motion's ends


@dataclass(frozen=True)
class PrintPose:
    """A foot's flat sole in one stance.

    foot : "r" or "l". first, stop : frames first to stop − 1. heel : its place (3,), m.
    yaw : degrees. normal : (3,). rows : the footprints it stands for.
    """

    foot: str
    first: int
    stop: int
    heel: Array
    yaw: float
    normal: Array
    rows: tuple[Footprint, ...]


def frames_of(footprint: Footprint, rate_hz: float) -> tuple[int, int]:
    """Return the first frame a row holds and the first it does not any more."""
    return round(footprint.t_on * rate_hz), round(footprint.t_off * rate_hz)


def print_poses(
    footprints: Sequence[Footprint], body: Body, rate_hz: float
) -> tuple[PrintPose, ...]:
    """Return the stances that the rows form, in order of time.

    Rows of a foot that follow each other without a frame between them are one stance, unless
    their soles lie more than a decimetre apart.
    """
    poses: list[PrintPose] = []
    for foot in "rl":
        sole = sole_of(body, foot)
        own = sorted((one for one in footprints if one.foot == foot), key=lambda one: one.t_on)
        stance: list[Footprint] = []
        stop = -1
        for one in own:
            first, end = frames_of(one, rate_hz)
            if stance and (first > stop or _apart(stance[0], one, sole)):
                poses.append(_pose(stance, sole, rate_hz))
                stance = []
            stop = max(stop, end) if stance else end
            stance.append(one)
        if stance:
            poses.append(_pose(stance, sole, rate_hz))
    return tuple(sorted(poses, key=lambda pose: (pose.first, pose.stop)))


def heel_of(one: Footprint, sole: Sole) -> Array:
    """Return where the heel of the flat foot is that a row belongs to, (3,), m."""
    forward, right = print_axes(one.yaw, one.normal)
    ahead, aside = sole.of(one.point)
    return one.place - ahead * forward - aside * right


def _apart(a: Footprint, b: Footprint, sole: Sole) -> bool:
    return bool(np.linalg.norm(heel_of(a, sole) - heel_of(b, sole)) > ONE_PRINT_M)


def _pose(stance: list[Footprint], sole: Sole, rate_hz: float) -> PrintPose:
    spans = [frames_of(one, rate_hz) for one in stance]
    heel = np.mean([heel_of(one, sole) for one in stance], axis=0)
    one = stance[0]
    first, stop = min(a for a, _ in spans), max(b for _, b in spans)
    return PrintPose(one.foot, first, stop, heel, one.yaw, one.normal, tuple(stance))


def to_constraints(
    footprints: Sequence[Footprint],
    body: Body,
    frames: int,
    rate_hz: float,
    *,
    friction: float = FRICTION,
    sliding_friction: float = SLIDING_FRICTION,
    like: Motion | None = None,
) -> FootConstraints:
    """Return what the feet must keep to, frame by frame.

    Parameters
    ----------
    footprints : checked ones, see `footprint_checks.check_footprints`.
    frames, rate_hz : of the motion to be made.
    friction, sliding_friction : coefficients of the cone where points stand and where they slide.
    like : a motion of as many frames whose unheld points may sink as deep as they do there.
    """
    shape = (frames, len(CONTACT_POINTS))
    held, sliding = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
    ground, normals = _swing_ground(footprints, body, frames, rate_hz)
    targets = ground.copy()
    soles = {foot: sole_of(body, foot) for foot in "rl"}
    for one in footprints:
        first, stop = frames_of(one, rate_hz)
        span = slice(max(first, 0), max(min(stop, frames), 0))
        for name, place in points_of(one, soles[one.foot]).items():
            k = CONTACT_POINTS.index(name)
            held[span, k], sliding[span, k] = True, one.slide
            targets[span, k] = ground[span, k] = place
            normals[span, k] = one.normal
    clearance = np.zeros(shape)
    if like is not None:
        clearance = _own_clearance(contact_points(like.body, like.pose()), ground, normals, held)
    coefficient = np.where(sliding, sliding_friction, friction)
    return FootConstraints(held, sliding, targets, ground, normals, clearance, coefficient)


def captured_constraints(
    motion: Motion, targets: Literal["path", "mean"] = "path", friction: float = FRICTION
) -> FootConstraints:
    """Return the constraints that a motion itself keeps, for learning from it.

    Contacts are the motion's own; unheld points stay above the ground, or no deeper below it than
    they are. Targets are the points' own paths, so that the motion violates nothing, or the mean
    of each contact.
    """
    prints = footprints_of(motion, "own")
    found = to_constraints(
        prints, motion.body, motion.frames, motion.rate_hz, friction=friction, like=motion
    )
    if targets == "mean":
        return found
    points = contact_points(motion.body, motion.pose())
    held = found.held[..., None]
    return FootConstraints(
        found.held,
        found.sliding,
        np.where(held, points, found.targets),
        np.where(held, points, found.ground),
        found.normals,
        found.clearance,
        found.friction,
    )


def _own_clearance(points: Array, ground: Array, normals: Array, held: NDArray[np.bool_]) -> Array:
    """Return how deep unheld points lie below their planes, (F, 8), m, none above 0."""
    heights = ((points - ground) * normals).sum(axis=-1)
    return np.where(held, 0.0, np.minimum(heights, 0.0))


def _swing_ground(
    footprints: Sequence[Footprint], body: Body, frames: int, rate_hz: float
) -> tuple[Array, Array]:
    """Return a point and the normal of the plane under every foot point, each (F, 8, 3)."""
    ground = np.zeros((frames, len(CONTACT_POINTS), 3))
    normals = np.zeros_like(ground)
    normals[..., 1] = 1.0
    poses = print_poses(footprints, body, rate_hz)
    for foot in "rl":
        sole = sole_of(body, foot)
        own = [pose for pose in poses if pose.foot == foot]
        if not own:  # a foot without prints keeps above those of the other one
            own = list(poses)
        if not own:
            continue
        ends = _with_ends(own, poses, frames, rate_hz)
        for name in GROUPS["foot"]:
            k = CONTACT_POINTS.index(f"{name}_{foot}")
            local = np.array(sole.points[name])
            for pose in own:
                span = slice(max(pose.first, 0), min(pose.stop, frames))
                ground[span, k], normals[span, k] = _lay(pose, local), pose.normal
            for before, after in itertools.pairwise(ends):
                span = np.arange(max(before.stop, 0), min(after.first, frames))
                if len(span):
                    way = _way(before, after, local, span)
                    place, normal = _under(way, before, after, poses, local)
                    ground[span, k], normals[span, k] = place, normal
    return ground, normals


def _lay(pose: PrintPose, local: Array) -> Array:
    """Return where a sole's point (forward, right) lies in a print, (3,), m."""
    forward, right = print_axes(pose.yaw, pose.normal)
    return pose.heel + local[0] * forward + local[1] * right


def _with_ends(
    own: list[PrintPose], poses: Sequence[PrintPose], frames: int, rate_hz: float
) -> list[PrintPose]:
    """Return a foot's prints with made-up ones where its first and last swing are cut off."""
    swing = round(USUAL_SWING_S * rate_hz)
    result = list(own)
    for at, sign in ((0, -1.0), (-1, 1.0)):
        one = own[at]
        others = [p for p in poses if p.foot != one.foot]
        near = min(others, key=lambda p: abs(p.first - one.first), default=None)
        stride = np.zeros(3)
        if near is not None:
            stride = 2 * (one.heel - near.heel) * (1.0 if near.first < one.first else -1.0)
        if sign < 0:
            first, stop = min(one.first - swing - 1, -1), min(one.first - swing, 0)
        else:
            first, stop = max(one.stop + swing, frames), max(one.stop + swing + 1, frames + 1)
        made = PrintPose(one.foot, first, stop, one.heel + sign * stride, one.yaw, one.normal, ())
        if sign < 0:
            result.insert(0, made)
        else:
            result.append(made)
    return result


def _way(before: PrintPose, after: PrintPose, local: Array, frames: NDArray[np.int64]) -> Array:
    """Return the usual way of a swinging point, (F, 3): least jerk from print to print."""
    s = (frames + 1 - before.stop) / max(after.first + 1 - before.stop, 1)
    ease = s**3 * (10 - 15 * s + 6 * s**2)
    start, end = _lay(before, local), _lay(after, local)
    return start + ease[:, None] * (end - start)


def _under(
    way: Array, before: PrintPose, after: PrintPose, poses: Sequence[PrintPose], local: Array
) -> tuple[Array, Array]:
    """Return a point and the normal of the plane under a way (F, 3)."""
    along = (_lay(after, local) - _lay(before, local)) * [1, 0, 1]
    length = float(np.linalg.norm(along))
    if length > 1e-6:
        along = along / length
    place, normal = _nearest(way, poses)
    gone = (way - _lay(before, local)) @ along
    clear = (gone > EDGE_MARGIN_M) & (gone < length - EDGE_MARGIN_M)
    for shift in (-EDGE_MARGIN_M, EDGE_MARGIN_M):
        beside, tilted = _nearest(way + shift * along, poses)
        height = _height(way, beside, tilted)
        higher = clear & (height > _height(way, place, normal) + 1e-9)
        place, normal = (
            np.where(higher[:, None], new, old) for new, old in ((beside, place), (tilted, normal))
        )
    below = way.copy()  # straight below the way, whichever print the plane is of
    below[:, 1] = _height(way, place, normal)
    return below, normal


def _height(way: Array, place: Array, normal: Array) -> Array:
    """Return the height of planes straight below or above points, (F,), m."""
    return place[:, 1] - ((way - place) * normal * [1, 0, 1]).sum(axis=1) / normal[:, 1]


def _nearest(points: Array, poses: Sequence[PrintPose]) -> tuple[Array, Array]:
    """Return heel and normal of the print nearest to each point as seen from above, (F, 3) each."""
    distances = []
    for pose in poses:
        forward, _right = print_axes(pose.yaw, pose.normal)
        heel, way = pose.heel[[0, 2]], 0.2 * forward[[0, 2]]
        t = np.clip((points[:, [0, 2]] - heel) @ way / (way @ way), 0.0, 1.0)
        away = points[:, [0, 2]] - heel - t[:, None] * way
        distances.append(np.linalg.norm(away, axis=1))
    chosen = np.argmin(distances, axis=0)
    heels, normals = (np.array([getattr(p, n) for p in poses]) for n in ("heel", "normal"))
    return heels[chosen], normals[chosen]
