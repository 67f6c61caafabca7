"""New footholds and ground of a task, from the example's stances (specification §7, steps 1–3)."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.kinematics import contact_points
from motionstyle.body.layout import CONTACT_POINTS
from motionstyle.body.rotations import exponential, logarithm, unroll
from motionstyle.errors import MotionStyleError
from motionstyle.mocap.fitting.floor import runs
from motionstyle.motion.motion import Motion
from motionstyle.motion.resample import resample
from motionstyle.similarity.alignment import Segment, segments_of
from motionstyle.similarity.events import (
    EventRules,
    bearing,
    clip_events,
    whole_body_borders,
)
from motionstyle.similarity.surface import Surface
from motionstyle.similarity.tasks import Task

Array = NDArray[np.float64]
_OF_SIDE = {s: [i for i, n in enumerate(CONTACT_POINTS) if n.endswith(f"_{s}")] for s in "lr"}
_UP = np.array([0.0, 1.0, 0.0])
EDGE_FROM_FOOT_M, BAR_M = 0.10, 0.12
HIGHEST_RISE, LONGEST_STEP, LONGEST_FLIGHT = 0.7, 1.35, 2.5  # of the leg's length


@dataclass(frozen=True)
class Example:
    """The part of an example a task is made from, and its segments, frames counted from its first.

    Attributes
    ----------
    motion : the part. segments : whole segments inside it.
    touches : frames at which a new foothold is reached, the first at 0.
    first_sides : feet whose foothold counts as the first.
    """

    motion: Motion
    segments: tuple[Segment, ...]
    touches: tuple[int, ...]
    first_sides: str


@dataclass(frozen=True)
class Footholds:
    """Where the feet go: targets of bearing points and what the pelvis starts from.

    Attributes
    ----------
    targets : (F, 8, 3) m, of use where `bearing` (F, 8).
    surface : the ground. support : height (m) of the ground under the body, (F,).
    centres : centre of support (F, 3), m; flight : whether no foot bears, (F,).
    pelvis : start of the six pelvis coordinates, (F, 6). turn : heading gained, rad (F,).
    """

    targets: Array
    bearing: NDArray[np.bool_]
    surface: Surface
    support: Array
    centres: Array
    flight: NDArray[np.bool_]
    pelvis: Array


def cut_example(motion: Motion, task: Task, rules: EventRules, rate_hz: float) -> Example:
    """Return the part of the example that a task asks for, at the task's rate.

    Raises
    ------
    MotionStyleError
        If the example has no contacts or fewer whole-body segments.
    """
    slow = resample(motion, rate_hz)
    events = clip_events(slow, rules).events
    borders = whole_body_borders(events)
    first, last = task.first_segment, task.first_segment + task.segments
    if last >= len(borders):
        raise MotionStyleError(
            f"task {task.task}: example {motion.id} has {max(0, len(borders) - 1)} whole-body "
            f"segments, but {task.segments} from segment {first} on are asked for"
        )
    begin, end = borders[first], borders[last]
    start, stop = events[begin].frame, min(events[end].frame, slow.frames - 1)
    part = slow.window(start, stop)
    inside = events[begin : end + 1]
    shifted = tuple(
        replace(s, first=s.first - start, last=min(s.last - start, part.frames - 1))
        for s in segments_of(inside)
    )
    touches = [0]
    touches += [e.frame - start for e in inside[1:] if e.kind == "touch" and e.frame <= stop]
    sides = inside[0].sides
    return Example(part, shifted, tuple(touches), sides)


def _yaw(angle: float | Array) -> Array:
    return exponential(np.multiply.outer(np.asarray(angle), _UP))


def foothold_numbers(example: Example) -> NDArray[np.int64]:
    """Return the number of the foothold each foot point is on or last was, (F, 8)."""
    motion = example.motion
    numbers = np.zeros(motion.contacts.shape, dtype=int)
    tolerance = max(2, round(0.07 * motion.rate_hz))
    for side, on in bearing(motion).items():
        current, before = 0, 0
        for first, last in runs(on):
            reached = [n for n, t in enumerate(example.touches) if t <= first + tolerance]
            current = reached[-1] if first > 0 else 0
            numbers[before:first, _OF_SIDE[side]] = numbers[max(0, before - 1), _OF_SIDE[side]]
            numbers[first : last + 1, _OF_SIDE[side]] = current
            before = last + 1
        numbers[before:, _OF_SIDE[side]] = current
    return numbers


def make_footholds(example: Example, task: Task) -> Footholds:
    """Return a task's targets, ground and pelvis start.

    Raises
    ------
    MotionStyleError
        If a foothold is out of reach.
    """
    motion = example.motion
    points = contact_points(motion.body, motion.pose())
    on, numbers = motion.contacts, foothold_numbers(example)
    count = int(numbers[on].max()) + 1 if on.any() else 1
    old = _places(points, on, numbers, count, example)
    turns = np.radians(task.turn_deg) * np.arange(count) / max(count - 1, 1)
    new = [old[0]]
    for n in range(1, count):
        way = (old[n] - old[n - 1]) * [1, 0, 1]
        half = (turns[n - 1] + turns[n]) / 2
        new.append(new[-1] + task.stride * (_yaw(half) @ way) + task.rise(n) * _UP)
    places = np.array(new)
    _check_reach(task, motion, places, numbers, on)
    moves = [(_yaw(a), o, p) for a, o, p in zip(turns, old, places, strict=True)]
    targets = np.array(points)
    for p in range(points.shape[1]):
        for first, last in runs(on[:, p]):
            n = numbers[first, p]
            rotation, origin, place = moves[n]
            mean = points[first : last + 1, p].mean(axis=0)
            mean[1] = max(mean[1] - origin[1], 0.0) + origin[1]
            targets[first : last + 1, p] = place + rotation @ (mean - origin)
    surface = _surface(task, points, on, numbers, moves, places)
    level = places[:, 1]
    flight = ~on.any(axis=1)
    weight = on / np.maximum(on.sum(axis=1, keepdims=True), 1)
    centres = np.einsum("fp,fpa->fa", weight, targets)
    pelvis, support = _pelvis(example, moves, turns, level)
    return Footholds(targets, on, surface, support, centres, flight, pelvis)


def _places(
    points: Array, on: NDArray[np.bool_], numbers: NDArray[np.int64], count: int, example: Example
) -> Array:
    """Return the mean place of the feet on each foothold, on the floor, (N, 3)."""
    places = np.zeros((count, 3))
    for n in range(count):
        mask = on & (numbers == n)
        if n == 0:
            wanted = np.zeros(on.shape[1], dtype=bool)
            for side in example.first_sides:
                wanted[_OF_SIDE[side]] = True
            mask = mask & wanted if (mask & wanted).any() else mask
        if not mask.any():
            places[n] = places[n - 1] if n else 0
            continue
        feet = [
            points[:, c][mask[:, c]].mean(axis=0) for c in _OF_SIDE.values() if mask[:, c].any()
        ]
        places[n] = np.mean(feet, axis=0)
    places[:, 1] = 0.0
    return places


def _check_reach(
    task: Task,
    motion: Motion,
    places: Array,
    numbers: NDArray[np.int64],
    on: NDArray[np.bool_],
) -> None:
    """Refuse footholds that no leg can reach, in words about the task."""
    leg = motion.body.leg_length
    for n in range(1, len(places)):
        way = places[n] - places[n - 1]
        rise, step = abs(float(way[1])), float(np.linalg.norm(way * [1, 0, 1]))
        together = ((on & (numbers == n)).any(axis=1) & (on & (numbers == n - 1)).any(axis=1)).any()
        longest = (LONGEST_STEP if together else LONGEST_FLIGHT) * leg
        if rise > HIGHEST_RISE * leg or step > longest:
            raise MotionStyleError(
                f"task {task.task}: foothold {n} is out of reach, {step:.2f} m away and "
                f"{way[1]:+.2f} m up from the one before; a leg of {leg:.2f} m allows "
                f"{longest:.2f} m and ±{HIGHEST_RISE * leg:.2f} m here: lower stride or rises_m "
                "in adaptations.tsv"
            )


def _surface(
    task: Task,
    points: Array,
    on: NDArray[np.bool_],
    numbers: NDArray[np.int64],
    moves: Sequence[tuple[Array, Array, Array]],
    places: Array,
) -> Surface:
    """Return the ground: a step edge before each foothold that rises, after one that falls."""
    way = (places[-1] - places[0]) * [1, 0, 1]
    size = np.linalg.norm(way)
    direction = way / size if size > 0.05 else np.array([1.0, 0.0, 0.0])

    def extent(n: int) -> tuple[float, float]:
        """Return the least and greatest distance of the points on foothold n."""
        rotation, origin, place = moves[n]
        own = points[on & (numbers == n)]
        new = place + (own - origin) @ rotation.T
        along = (new - places[0]) @ direction
        return float(along.min()), float(along.max())

    edges, rises = [], []
    for n in range(1, len(places)):
        rise = places[n, 1] - places[n - 1, 1]
        if rise:
            near = extent(n)[0] - EDGE_FROM_FOOT_M
            far = extent(n - 1)[1] + EDGE_FROM_FOOT_M
            edges.append(max(near, (near + far) / 2) if rise > 0 else min(far, (near + far) / 2))
            rises.append(float(rise))
    if task.obstacle_m and task.obstacle_after + 1 < len(places):
        n = task.obstacle_after
        middle = (extent(n)[1] + extent(n + 1)[0]) / 2
        edges += [middle - BAR_M / 2, middle + BAR_M / 2]
        rises += [task.obstacle_m, -task.obstacle_m]
    return Surface(
        tuple(edges),
        tuple(rises),
        (float(places[0, 0]), float(places[0, 2])),
        (float(direction[0]), float(direction[2])),
    )


def _pelvis(
    example: Example, moves: Sequence[tuple[Array, Array, Array]], turns: Array, level: Array
) -> tuple[Array, Array]:
    """Return the pelvis coordinates (F, 6) and the ground's height (F,), from foothold to foothold.

    In the middle of the time on a foothold the pelvis moves as that foothold does; in between,
    smoothly from one to the next.
    """
    motion = example.motion
    frames = np.arange(motion.frames)
    touches = [*example.touches, motion.frames - 1]
    middles = [(a + b) / 2 for a, b in itertools.pairwise(touches)][: len(moves)]
    while len(middles) < len(moves):
        middles.append(float(motion.frames - 1) + len(middles))
    phase = np.interp(frames, middles, np.arange(len(middles)))
    whole = np.floor(phase).astype(int)
    part = phase - whole
    smooth = part * part * (3 - 2 * part)
    after = np.minimum(whole + 1, len(moves) - 1)
    place = motion.coordinates[:, :3]
    carried = np.array([p + (place - o) @ r.T for r, o, p in moves])
    blended = (1 - smooth)[:, None] * carried[whole, frames] + smooth[:, None] * carried[
        after, frames
    ]
    angle = (1 - smooth) * turns[whole] + smooth * turns[after]
    turned = _yaw(angle) @ exponential(motion.coordinates[:, 3:6])
    vectors, _ = unroll(logarithm(turned))
    support = (1 - smooth) * level[whole] + smooth * level[after]
    return np.hstack([blended, vectors]), support
