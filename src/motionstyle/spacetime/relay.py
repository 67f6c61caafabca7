"""New footprints from old: an example's prints laid along another way, onto another surface.

The example's timing, step width and toe-out are kept; its straight line is bent into a `Route` of
straight pieces and arcs, and tilted into a ramp or cut into stairs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.body import Body
from motionstyle.errors import MotionStyleError
from motionstyle.spacetime.footprint_constraints import PrintPose, print_poses
from motionstyle.spacetime.footprints import Footprint, Sole, numbered, print_axes, sole_of

Array = NDArray[np.float64]

STRAIGHT_DEG = 30.0  # how far an example's prints of one foot may turn from first to last
OVERHANG_M = 0.02  # of the shoe before the toe tip and behind the heel


@dataclass(frozen=True)
class Piece:
    """A straight piece or an arc of a way.

    length_m : along the way. turn_deg : heading change over it, left positive; 0 is straight.
    step_scale : of the example's step lengths on it.
    """

    length_m: float
    turn_deg: float = 0.0
    step_scale: float = 1.0


@dataclass(frozen=True)
class Route:
    """Pieces one after the other; before the first and after the last it goes on straight."""

    pieces: tuple[Piece, ...]

    def at(self, travelled_m: float) -> tuple[Array, float]:
        """Return (forward, right) in m and heading in rad after a distance of the example's way."""
        place, heading, left = np.zeros(2), 0.0, travelled_m
        scale = self.pieces[0].step_scale if self.pieces else 1.0
        for piece in self.pieces:
            scale = piece.step_scale
            if left < 0:
                break
            covered = min(left * scale, piece.length_m)
            turn = math.radians(piece.turn_deg) * covered / piece.length_m
            place = place + _chord(covered, heading, turn)
            heading += turn
            left -= covered / scale
            if covered < piece.length_m:
                return place, heading
        return place + _chord(left * scale, heading, 0.0), heading


def _chord(length: float, heading: float, turn: float) -> Array:
    """Return (forward, right) of the end of an arc of some length and turn from its beginning."""
    middle = heading + turn / 2
    straight = length * float(np.sinc(turn / (2 * np.pi)))
    return straight * np.array([math.cos(middle), -math.sin(middle)])


def straight(step_scale: float = 1.0) -> Route:
    """Return a straight way."""
    return Route((Piece(math.inf, 0.0, step_scale),)) if step_scale != 1.0 else Route(())


def arc(radius_m: float, side: str, lead_m: float = 0.0, step_scale: float = 1.0) -> Route:
    """Return a circle (many rounds of it) to the "left" or "right", after a straight lead-in."""
    if not radius_m > 0 or side not in {"left", "right"}:
        raise MotionStyleError(
            f"arc of radius {radius_m} m to the '{side}': need > 0, left or right"
        )
    rounds = 10
    turn = 360.0 * rounds * (1 if side == "left" else -1)
    circle = Piece(2 * math.pi * radius_m * rounds, turn, step_scale)
    return Route(((Piece(lead_m, 0.0, step_scale),) if lead_m > 0 else ()) + (circle,))


def sharp_turn(
    radius_m: float, side: str, lead_m: float, turn_step_scale: float, angle_deg: float = 180.0
) -> Route:
    """Return a straight way, a turn on a narrow arc with shorter steps, and a straight way on."""
    if not radius_m > 0 or side not in {"left", "right"}:
        raise MotionStyleError(
            f"turn of radius {radius_m} m to the '{side}': need > 0, left or right"
        )
    sign = 1 if side == "left" else -1
    length = radius_m * math.radians(angle_deg)
    lead = (Piece(lead_m),) if lead_m > 0 else ()
    return Route((*lead, Piece(length, sign * angle_deg, turn_step_scale), Piece(1e6)))


@dataclass(frozen=True)
class Ramp:
    """A plane that rises (slope_deg > 0) or falls along a straight way, `level_m` after the start.

    With level_m = −inf, the default, all of the way lies on it.
    """

    slope_deg: float
    level_m: float = -math.inf


@dataclass(frozen=True)
class Stairs:
    """Steps along a straight way, one print on each: treads in m, rise in m (down if negative)."""

    tread_m: float
    rise_m: float


def relay(
    footprints: Sequence[Footprint],
    body: Body,
    rate_hz: float,
    route: Route,
    *,
    surface: Ramp | Stairs | None = None,
    time_scale: float = 1.0,
    slide: bool = False,
    other_body: Body | None = None,
) -> tuple[Footprint, ...]:
    """Return an example's footprints laid along a way that starts at its first print.

    Parameters
    ----------
    footprints : rigid ones of a straight movement on level ground.
    body : of the example.
    rate_hz : of the motion; rows are grouped into stances by it.
    surface : on a straight way, a ramp or stairs; None is level ground.
    time_scale : of all times; 2 is half as fast.
    slide : whether the feet may slide.
    other_body : whose soles are laid down; the example's by default.

    Raises
    ------
    MotionStyleError
        If the example is not straight, or a ramp or stairs are asked for on a way that turns.
    """
    if not 0.2 <= time_scale <= 5:
        raise MotionStyleError(f"time_scale {time_scale} lies outside 0.2 to 5")
    if surface is not None and any(piece.turn_deg for piece in route.pieces):
        raise MotionStyleError("ramps and stairs need a straight way, this one turns")
    poses = print_poses(footprints, body, rate_hz)
    origin, direction = _line(poses, body)
    across = np.cross(direction, [0.0, 1.0, 0.0])
    base_yaw = math.degrees(math.atan2(-direction[2], direction[0]))
    order = np.argsort([(_centre(p, body) - origin) @ direction for p in poses], kind="stable")
    rank = {int(pose): k for k, pose in enumerate(order)}
    rows: list[Footprint] = []
    for index, pose in enumerate(poses):
        away = _centre(pose, body) - origin
        place, heading = route.at(float(away @ direction))
        if isinstance(surface, Stairs):
            place = np.array([surface.tread_m * rank[index], 0.0])
        side = np.array([math.sin(heading), math.cos(heading)])
        forward_right = place + float(away @ across) * side
        toe_out = (pose.yaw - base_yaw + 180) % 360 - 180
        yaw = base_yaw + math.degrees(heading) + toe_out
        half = _half_length(other_body or body, pose.foot)
        ahead, height, normal = _lift(surface, forward_right[0], rank[index], half, direction)
        centre = origin + ahead * direction + forward_right[1] * across
        centre[1] = origin[1] + height
        forward, _right = print_axes(yaw, normal)
        sole = sole_of(other_body or body, pose.foot)
        for one in _laid(pose, sole, centre - half * forward, (yaw, normal)):
            times = {"t_on": one.t_on * time_scale, "t_off": one.t_off * time_scale}
            rows.append(replace(one, **times, slide=slide or one.slide))
    rows.sort(key=lambda one: (one.t_on, one.foot))
    return numbered(rows)


def resoled(
    footprints: Sequence[Footprint], body: Body, rate_hz: float, other_body: Body, *, slide: bool
) -> tuple[Footprint, ...]:
    """Return footprints of one body as another body leaves them: middles of the feet kept."""
    rows = []
    for pose in print_poses(footprints, body, rate_hz):
        forward, _right = print_axes(pose.yaw, pose.normal)
        heel = _centre(pose, body) - _half_length(other_body, pose.foot) * forward
        sole = sole_of(other_body, pose.foot)
        for one in _laid(pose, sole, heel, (pose.yaw, pose.normal)):
            rows.append(replace(one, slide=slide or one.slide))
    rows.sort(key=lambda one: (one.t_on, one.foot))
    return numbered(rows)


def _laid(pose: PrintPose, sole: Sole, heel: Array, plane: tuple[float, Array]) -> list[Footprint]:
    """Return the rows of a print with a sole laid down at `heel` (3,), m."""
    yaw, normal = plane
    forward, right = print_axes(yaw, normal)
    rows = []
    for one in pose.rows:
        u, v = sole.of(one.point)
        x, y, z = (heel + u * forward + v * right).tolist()
        a, b, c = normal.tolist()
        tilt = {"normal_x": a, "normal_y": b, "normal_z": c}
        rows.append(replace(one, x=x, y=y, z=z, yaw=(yaw + 180) % 360 - 180, **tilt))
    return rows


def _half_length(body: Body, foot: str) -> float:
    return sole_of(body, foot).points["toe"][0] / 2


def _centre(pose: PrintPose, body: Body) -> Array:
    forward, _right = print_axes(pose.yaw, pose.normal)
    return pose.heel + _half_length(body, pose.foot) * forward


def _line(poses: Sequence[PrintPose], body: Body) -> tuple[Array, Array]:
    """Return the first print's place on the line through the prints, and the line's direction."""
    if len({pose.foot for pose in poses}) < 2 or len(poses) < 3:
        raise MotionStyleError(
            f"{len(poses)} footprints are too few to be laid along a way; need three of both feet"
        )
    for foot in "rl":
        yaws = np.unwrap([math.radians(p.yaw) for p in poses if p.foot == foot])
        turned = math.degrees(float(np.ptp(yaws)))
        if turned > STRAIGHT_DEG:
            raise MotionStyleError(
                f"the example's {foot} foot turns by {turned:.0f} degrees; only a straight "
                "movement can be laid along another way (take its own footprints instead)"
            )
    if any(pose.normal[1] < math.cos(math.radians(2)) for pose in poses):
        raise MotionStyleError("the example stands on a slope; need one on level ground")
    centres = np.array([_centre(pose, body) for pose in poses])
    times = np.array([(pose.first + pose.stop) / 2 for pose in poses])
    sides = np.array([pose.foot == "r" for pose in poses], dtype=float)
    design = np.column_stack([np.ones(len(times)), times, sides])
    solution = np.linalg.lstsq(design, centres[:, [0, 2]], rcond=None)[0]
    direction = np.array([solution[1, 0], 0.0, solution[1, 1]])
    size = float(np.linalg.norm(direction))
    if size * (times[-1] - times[0]) < 0.3:
        raise MotionStyleError(
            "the example's footprints stay in place; need a way to be laid along"
        )
    direction /= size
    across = np.cross(direction, [0.0, 1.0, 0.0])
    aside = [
        float(np.mean([c @ across for c, p in zip(centres, poses, strict=True) if p.foot == f]))
        for f in "rl"
    ]
    first = centres[int(np.argmin(centres @ direction))]
    origin = (first @ direction) * direction + np.mean(aside) * across
    origin[1] = float(np.median(centres[:, 1]))
    return origin, direction


def _lift(
    surface: Ramp | Stairs | None, ahead: float, rank: int, half: float, direction: Array
) -> tuple[float, float, Array]:
    """Return forward place, height (m) and normal of a print at `ahead` m of its way."""
    up = np.array([0.0, 1.0, 0.0])
    if surface is None:
        return ahead, 0.0, up
    if isinstance(surface, Stairs):
        return ahead, surface.rise_m * rank, up
    slope = math.radians(surface.slope_deg)
    start = surface.level_m if math.isfinite(surface.level_m) else 0.0
    reach = half + OVERHANG_M
    if math.isfinite(surface.level_m):
        if abs(ahead - start) < reach:  # no print across the edge: to the side its middle is on
            ahead = start + math.copysign(reach, ahead - start)
        if ahead < start:
            return ahead, 0.0, up
    along = ahead - start
    normal = math.cos(slope) * up - math.sin(slope) * direction
    return start + along * math.cos(slope), along * math.sin(slope), normal
