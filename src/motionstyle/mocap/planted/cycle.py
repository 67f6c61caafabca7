"""The material planted motions are made of: one clean cycle (or clip) from chosen source frames.

Source frames. The embedded walk and run are one recorded step each: their publisher made the
second half of the cycle as an exact mirror image of the first, and the sheet runs through the
cycle several times. Frames are therefore counted in the original file, and where the second half
mirrors the first, frame f + half counts as frame f. What then is left to split is every second
frame of one performance (windows `even` and `odd`): no planted take is a second performance. The
base is the ingested motion, whose low-pass lets neighbouring frames bleed into each other.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, make_interp_spline

from motionstyle.body.kinematics import contact_points, forward_kinematics
from motionstyle.body.layout import (
    CONTACT_POINTS,
    COORDINATE_INDEX,
    EXPONENTIAL_BLOCKS,
    NODE_INDEX,
    mirrored_coordinates,
)
from motionstyle.body.rotations import exponential, logarithm, unroll
from motionstyle.errors import MotionStyleError
from motionstyle.mocap.planted.feet import grounded_foot, plant_path, smooth, trimmed
from motionstyle.motion.motion import Motion

Array = NDArray[np.float64]
WINDOWS = ("whole", "even", "odd", "first_half", "second_half")
SAMPLES_PER_FRAME = 8
TWIN_DEG = 1.5  # rms below which the second half of a cycle counts as the mirrored first
LOOP_DEG = 3.0  # rms up to which a cycle may fail to close
SEAM_DEG = 2.0  # up to which the ends of a half cycle may miss each other and stay as they are
FEWEST_KNOTS = 5  # source frames a window must leave
POINTS = {
    side: [CONTACT_POINTS.index(f"{n}_{side}") for n in ("heel", "ball_medial", "ball_lateral")]
    for side in "rl"
}


@dataclass(frozen=True)
class SourceCycle:
    """One cycle of a base (or all of a clip that does not loop), travelling along +x.

    Attributes
    ----------
    phases : sample phases, (G,); one cycle is 0 to 1, its neighbours are sampled too.
    coordinates : (G, 35). ankles, feet : positions (G, 2, 3), m, and rotation vectors (G, 2, 3)
        of right and left foot, exact in stance. plants : `feet.plant_path`, (G, 2), m.
    lifts : height of each foot's lowest point, (G, 2), m. bearing : contact points, (G, 8).
    travel : m per cycle, 0 for a clip. duration_s : of one cycle. loops : whether it is one.
    source_frames : frames of the original file it was made from. twins : frames after which
        the original repeats itself mirrored, or None. start_phase : far from any contact event, so
        that motions of one base begin and end in the same phase of support.
    """

    phases: Array
    coordinates: Array
    ankles: Array
    feet: Array
    plants: Array
    lifts: Array
    bearing: NDArray[np.bool_]
    travel: float
    duration_s: float
    loops: bool
    source_frames: tuple[int, ...]
    twins: int | None
    start_phase: float

    @property
    def one_cycle(self) -> slice:
        """The samples of phase 0 to 1."""
        first, last = np.searchsorted(self.phases, [-1e-9, 1 - 1e-9 if self.loops else 1 + 1e-9])
        return slice(int(first), int(last))

    def sample(self, values: Array, phases: Array, travel: float = 0.0) -> Array:
        """Return (F, ...) values at phases (F,), advancing by `travel` with every cycle."""
        turn = np.floor(phases) if self.loops else np.zeros_like(phases)
        at = make_interp_spline(self.phases, values, k=3)(phases - turn)
        return at + travel * turn.reshape(-1, *[1] * (values.ndim - 1))

    def bearing_at(self, phases: Array) -> NDArray[np.bool_]:
        """Return which points bear at phases (F,), (F, 8)."""
        within = phases - np.floor(phases) if self.loops else phases
        step = self.phases[1] - self.phases[0]
        nearest = np.round((within - self.phases[0]) / step).astype(int)
        return self.bearing[np.clip(nearest, 0, len(self.phases) - 1)]


def source_cycle(base: Motion, cycle_frames: int | None, window: str) -> SourceCycle:
    """Make the clean cycle of a base motion from the source frames of one window.

    Parameters
    ----------
    base : a captured motion on a level floor. cycle_frames : frames of one cycle, None for a
        clip that does not loop. window : one of `WINDOWS`; but for `whole` and clips, a half
        cycle and its mirror image.

    Raises
    ------
    MotionStyleError
        If the base does not loop with that cycle, or the window leaves too few frames.
    """
    if window not in WINDOWS:
        raise MotionStyleError(f"source_window is '{window}', expected one of {', '.join(WINDOWS)}")
    q, loops = base.coordinates, cycle_frames is not None
    start, count = 0, base.frames
    if cycle_frames is not None:
        start, count = (base.frames - 1) // cycle_frames // 2 * cycle_frames, cycle_frames
        if not 2 * FEWEST_KNOTS <= count < base.frames:
            raise MotionStyleError(
                f"{base.id}: cycle_frames is {count}, expected at least {2 * FEWEST_KNOTS} and "
                f"less than the motion's {base.frames} frames"
            )
    last = start + count if loops else count - 1
    q = _along_x(q, q[last, [0, 2]] - q[start, [0, 2]])
    travel = float(q[last, 0] - q[start, 0]) if loops else 0.0
    flat = np.array(q)
    flat[:, 0] -= travel / count * (np.arange(len(q)) - start)
    if loops and _rms_deg(flat[last] - flat[start]) > LOOP_DEG:
        raise MotionStyleError(
            f"{base.id}: poses {count} frames apart differ by "
            f"{_rms_deg(flat[last] - flat[start]):.1f}° rms; cycle_frames is not its cycle"
        )
    cycle, marks = flat[start : start + count], base.contacts[start : start + count]
    cycle[:, 0] -= cycle[0, 0]
    cycle[:, 2] -= cycle[:, 2].mean() if loops else cycle[0, 2]
    twins = count // 2 if loops and _mirrors_itself(cycle) else None
    if loops:
        knots, values, marks, used = _looped(cycle, marks, window)
        spline = CubicSpline([*knots, 1 + knots[0]], [*values, values[0]], bc_type="periodic")
        grid = np.arange(-count, 2 * count, 1 / SAMPLES_PER_FRAME) / count
        nearest = np.round(np.mod(grid, 1.0) * count).astype(int) % count
    else:
        used = _window_frames(count, window)
        spline = make_interp_spline(used / (count - 1), cycle[used], k=3)
        grid = np.linspace(0.0, 1.0, (count - 1) * SAMPLES_PER_FRAME + 1)
        nearest = np.round(grid * (count - 1)).astype(int)
    dense = spline(np.mod(grid, 1.0) if loops else grid)
    dense[:, 0] += travel * grid
    ankles, feet, plants, lifts, bearing = _clean_feet(base, dense, marks[nearest])
    span = count if loops else count - 1
    frames = _first_source_frame(base) + used
    named = tuple(int(f) for f in frames)
    return SourceCycle(
        *(grid, dense, ankles, feet, plants, lifts, bearing, travel, span / base.rate_hz),
        *(loops, named, twins, _quiet_frame(marks) / count if loops else 0.0),
    )


def _quiet_frame(marks: NDArray[np.bool_]) -> int:
    """Return the frame of a cycle in the middle of the longest time without a foot's event."""
    feet = marks.reshape(len(marks), 2, -1).any(axis=2)
    events = np.flatnonzero((feet != np.roll(feet, 1, axis=0)).any(axis=1))
    if not len(events):
        return 0
    gaps = np.diff([*events, events[0] + len(marks)])
    longest = int(np.argmax(gaps))
    return int(events[longest] + gaps[longest] // 2) % len(marks)


def _clean_feet(
    base: Motion, dense: Array, marks: NDArray[np.bool_]
) -> tuple[Array, Array, Array, Array, NDArray[np.bool_]]:
    rate = base.rate_hz * SAMPLES_PER_FRAME
    pose = forward_kinematics(base.body, dense)
    points = contact_points(base.body, pose)
    bearing = np.array(marks)
    parts: list[list[Array]] = [[], [], [], []]
    for side in "rl":
        columns = POINTS[side]
        node = NODE_INDEX[f"foot_{side}"]
        tip = CONTACT_POINTS.index(f"toe_{side}")
        for column in (columns, [tip]):
            bearing[:, column] = trimmed(marks[:, column], points[:, column], rate)
        bears = bearing[:, [*columns, tip]]
        local = base.body.geometry.contact_points[columns].mean(axis=0)
        joint = base.body.joint_offsets[NODE_INDEX[f"toes_{side}"]] - local
        clean, turns = grounded_foot(
            points[:, columns], pose.rotations[:, node], bears, joint, rate
        )
        middle = clean.mean(axis=1)
        parts[0].append(middle - turns @ local)
        parts[1].append(unroll(logarithm(turns))[0])
        parts[2].append(plant_path(middle, bears))
        low = np.where(bears.any(axis=1), 0.0, np.maximum(clean[..., 1].min(axis=1), 0.0))
        parts[3].append(np.where(bears.any(axis=1), 0.0, smooth(low, rate)))
    ankles, feet, plants, lifts = (np.stack(part, axis=1) for part in parts)
    return ankles, feet, plants, lifts, bearing


def _window_frames(count: int, window: str) -> NDArray[np.int64]:
    """Return which of `count` frames a window takes."""
    frames = np.arange(count)
    if window in {"first_half", "second_half"}:
        raise MotionStyleError(
            f"source_window is '{window}', but a clip without cycle_frames has no half cycles; "
            "take whole, even or odd"
        )
    step = {"whole": frames, "even": frames[::2], "odd": frames[1::2]}
    return step[window]


def _looped(
    cycle: Array, marks: NDArray[np.bool_], window: str
) -> tuple[Array, Array, NDArray[np.bool_], NDArray[np.int64]]:
    """Return knots in phase (K,), their poses, contacts of all frames, and frames used."""
    count = len(cycle)
    if window == "whole":
        return np.arange(count) / count, cycle, marks, np.arange(count)
    half = np.flatnonzero(2 * np.arange(count) < count)
    if window == "second_half":
        half = half + count // 2
    used = {"even": half[::2], "odd": half[1::2]}.get(window, half)
    if len(used) < FEWEST_KNOTS:
        raise MotionStyleError(
            f"source_window '{window}' leaves {len(used)} of {count} frames of a cycle; "
            f"a half cycle needs {FEWEST_KNOTS}"
        )
    order, sign = mirrored_coordinates()
    poses = np.array(cycle[used])
    if used is half:
        # both ends meet half the way, so that there is no seam
        beyond = 3 * poses[-1] - 3 * poses[-2] + poses[-3]
        gap = poses[0, order] * sign - beyond
        gap = np.sign(gap) * np.maximum(np.abs(gap) - np.radians(SEAM_DEG), 0.0) / 2
        rise = np.linspace(0.0, 1.0, len(poses), endpoint=False)[:, None]
        poses += rise * gap - (1 - rise) * gap[order] * sign
    knots = np.concatenate([used, used + count / 2]) / count
    values = np.concatenate([poses, poses[:, order] * sign])
    turn = np.argsort(np.mod(knots, 1.0))
    swapped = [
        CONTACT_POINTS.index(n[:-1] + ("l" if n[-1] == "r" else "r")) for n in CONTACT_POINTS
    ]
    other = (half + count // 2) % count
    marks = np.array(marks)
    marks[other] = marks[half[: len(other)]][:, swapped]
    return np.mod(knots, 1.0)[turn], values[turn], marks, used


def _along_x(q: Array, travel: Array) -> Array:
    """Return coordinates turned about the vertical so that the travel (x, z) points along +x."""
    yaw = float(np.arctan2(travel[1], travel[0])) if np.linalg.norm(travel) > 0.05 else 0.0
    return turned(q, yaw)


def turned(q: Array, yaw_rad: float) -> Array:
    """Return coordinates (F, 35) turned about the world's vertical by an angle."""
    matrix = exponential(np.array([0.0, yaw_rad, 0.0]))
    result = np.array(q)
    result[:, :3] = q[:, :3] @ matrix.T
    root = EXPONENTIAL_BLOCKS[0]
    result[:, root] = unroll(logarithm(matrix @ exponential(q[:, root])))[0]
    return result


def _rms_deg(difference: Array) -> float:
    return float(np.degrees(np.sqrt((difference[..., 6:] ** 2).mean())))


def _mirrors_itself(cycle: Array) -> bool:
    order, sign = mirrored_coordinates()
    if len(cycle) % 2:
        return False
    half = len(cycle) // 2
    toes = [COORDINATE_INDEX[f"toes_extension_{side}"] for side in "rl"]
    difference = cycle[half:] - cycle[:half, order] * sign
    difference[:, toes] = 0.0
    return _rms_deg(difference) < TWIN_DEG


def _first_source_frame(base: Motion) -> int:
    text = str(base.provenance.get("source_frames", "0"))
    found = re.match(r"\d+", text)
    return int(found[0]) if found else 0
