"""Gait as numbers: stances, steps, cycles, clinical joint angles, foot slip and penetration.

Events come from a motion's contacts alone; a stance cut off by the clip's first frame has no
strike and one cut off by its last frame no lift-off, so no event is made up there. Quantities
that a motion does not show (no complete cycle, say) are nan.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter
from scipy.spatial.transform import Rotation

from motionstyle.body.kinematics import contact_points
from motionstyle.body.layout import CONTACT_POINTS, COORDINATE_INDEX, NODE_INDEX
from motionstyle.mocap.fitting.floor import runs
from motionstyle.motion.motion import Motion

Array = NDArray[np.float64]
Cycle = tuple[int, int]

SLOWEST_TRAVEL_MPS = 0.1  # below this the direction of travel is where the pelvis faces
RAISED_GROUND_M = 0.05  # a contact this high or higher stands on something above the floor
SHORTEST_STEP_S = 0.1
USUAL_STRIDE_S = 1.0  # smoothing window of motions without a complete cycle
_UP = np.array([0.0, 1.0, 0.0])
_COLUMNS = {
    side: [i for i, name in enumerate(CONTACT_POINTS) if name.endswith(f"_{side}")] for side in "rl"
}


class Stance(NamedTuple):
    """A foot on the ground in frames first to last (included), its heel at place (3,), m."""

    side: str
    first: int
    last: int
    place: Array


def foot_stances(motion: Motion) -> list[Stance]:
    """Return the stances of both feet, a foot's points joined, in order of their beginning.

    The place is where the heel stands: its mean position while it bears, or, in stances on the
    forefoot, the ball's mean place less the length of the foot behind it.
    """
    points = contact_points(motion.body, motion.pose())
    stances = []
    for side, (heel, medial, lateral, _toe) in _COLUMNS.items():
        ball = points[:, [medial, lateral]].mean(axis=1)
        forward = (ball - points[:, heel]) * [1, 0, 1]
        forward /= np.maximum(np.linalg.norm(forward, axis=1, keepdims=True), 1e-9)
        local = motion.body.geometry.contact_points
        behind = float((local[[medial, lateral]].mean(axis=0) - local[heel])[0])
        for first, last in runs(motion.contacts[:, _COLUMNS[side]].any(axis=1)):
            frames = np.arange(first, last + 1)
            on_heel = frames[motion.contacts[frames, heel]]
            on_ball = frames[motion.contacts[frames, medial] | motion.contacts[frames, lateral]]
            if len(on_heel):
                place = points[on_heel, heel].mean(axis=0)
            else:
                chosen = on_ball if len(on_ball) else frames
                place = (ball[chosen] - behind * forward[chosen]).mean(axis=0)
            stances.append(Stance(side, first, last, place))
    return sorted(stances, key=lambda s: (s.first, s.last))


def foot_strikes(motion: Motion, side: str) -> list[int]:
    """Return the frames at which a foot's heel (or, where it never bears, any point) lands."""
    heel = motion.contacts[:, _COLUMNS[side][0]]
    strikes = []
    for stance in foot_stances(motion):
        if stance.side == side and stance.first > 0:
            on_heel = np.flatnonzero(heel[stance.first : stance.last + 1])
            strikes.append(stance.first + (int(on_heel[0]) if len(on_heel) else 0))
    return strikes


def gait_cycles(motion: Motion, side: str) -> list[Cycle]:
    """Return (first, last) frame of a foot's complete cycles, from heel strike to heel strike."""
    strikes = foot_strikes(motion, side)
    return list(itertools.pairwise(strikes))


def _stride_window(motion: Motion) -> int:
    """Return an odd number of frames close to one stride, at most the motion's length."""
    spans = [last - first for side in "rl" for first, last in gait_cycles(motion, side)]
    stride = float(np.median(spans)) if spans else USUAL_STRIDE_S * motion.rate_hz
    longest = motion.frames - 1 + motion.frames % 2
    return max(3, min(int(stride) // 2 * 2 + 1, longest))


def smooth_path(motion: Motion) -> Array:
    """Return the pelvis' horizontal path averaged over a stride, (F, 3), m, with y = 0."""
    return _averaged(motion, motion.coordinates[:, :3])


def feet_path(motion: Motion) -> Array:
    """Return the horizontal path of the middle of both feet, averaged over a stride, (F, 3), m.

    Footprints fix it, where the pelvis of a synthesis may drift at its free ends.
    """
    positions = motion.pose().positions
    feet = positions[:, NODE_INDEX["foot_r"]] + positions[:, NODE_INDEX["foot_l"]]
    return _averaged(motion, feet / 2)


def _averaged(motion: Motion, path: Array) -> Array:
    return savgol_filter(path * [1, 0, 1], _stride_window(motion), 1, axis=0, mode="interp")


def travel_directions(motion: Motion, path: Array | None = None) -> Array:
    """Return the horizontal unit vector of travel per frame, (F, 3).

    Where the path hardly goes on (below 0.1 m/s) it is the direction the pelvis faces.

    Parameters
    ----------
    path : whose direction is meant, (F, 3), m; by default `smooth_path`.
    """
    path = smooth_path(motion) if path is None else path
    velocity = np.gradient(path, 1 / motion.rate_hz, axis=0)
    facing = motion.pose().rotations[:, NODE_INDEX["pelvis"], :, 0] * [1, 0, 1]
    slow = np.linalg.norm(velocity, axis=1) < SLOWEST_TRAVEL_MPS
    direction = np.where(slow[:, None], facing, velocity)
    return direction / np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-9)


def _steps(motion: Motion) -> list[tuple[Stance, Stance, float]]:
    """Return (stance, next stance of the other foot, step length in m)."""
    directions = travel_directions(motion)
    steps = []
    stances = foot_stances(motion)
    for before, after in itertools.pairwise(stances):
        if before.side != after.side:
            along = directions[before.first : after.last + 1].mean(axis=0)
            along /= max(float(np.linalg.norm(along)), 1e-9)
            steps.append((before, after, float((after.place - before.place) @ along)))
    return steps


def step_lengths(motion: Motion) -> Array:
    """Return step lengths in m: between successive stances of opposite feet, along the travel."""
    return np.array([length for _before, _after, length in _steps(motion)])


def step_widths(motion: Motion) -> Array:
    """Return step widths in m: of each heel from the line through the other foot's two places.

    Negative where the feet cross.
    """
    widths = []
    stances = foot_stances(motion)
    for before, middle, after in zip(stances[:-2], stances[1:-1], stances[2:], strict=True):
        stride = (after.place - before.place) * [1, 0, 1]
        length = float(np.linalg.norm(stride))
        if before.side == after.side != middle.side and length > 0.1:
            right = np.cross(stride / length, _UP)
            away = float((middle.place - before.place) @ right)
            widths.append(away if middle.side == "r" else -away)
    return np.array(widths)


def mean_speed(motion: Motion) -> float:
    """Return the length of the smoothed horizontal pelvis path over its time, m/s."""
    steps = np.linalg.norm(np.diff(smooth_path(motion), axis=0), axis=1)
    return float(steps.sum() * motion.rate_hz / (motion.frames - 1))


def cadence(motion: Motion) -> float:
    """Return steps per minute, from the first strike of the clip to the last.

    Strikes within 0.1 s of each other, of a landing on both feet, count as one.
    """
    strikes: list[int] = []
    for stance in foot_stances(motion):
        earliest = strikes[-1] + SHORTEST_STEP_S * motion.rate_hz if strikes else 0
        if stance.first > earliest:
            strikes.append(stance.first)
    if len(strikes) < 2:
        return float("nan")
    return 60.0 * (len(strikes) - 1) * motion.rate_hz / (strikes[-1] - strikes[0])


def speed_error_pct(motion: Motion) -> float:
    """Return by how much step length times cadence exceeds the pelvis' speed, in percent.

    All three are taken over the same whole strides: between the first strike and the last one
    of the same foot.
    """
    landed = [step for step in _steps(motion) if step[0].first > 0]
    landed = landed[: len(landed) // 2 * 2]
    alternate = all(a[1] is b[0] for a, b in itertools.pairwise(landed))
    if not landed or not alternate:
        return float("nan")
    first, last = landed[0][0].first, landed[-1][1].first
    path = smooth_path(motion)[first : last + 1]
    travelled = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    stepped = sum(length for _before, _after, length in landed)
    return 100.0 * (stepped / travelled - 1.0) if travelled > 0.1 else float("nan")


def stance_fraction(motion: Motion) -> float:
    """Return the mean share of a cycle that a foot stands, over all complete cycles of both."""
    shares = []
    for side in "rl":
        own = [s for s in foot_stances(motion) if s.side == side]
        for stance, following in itertools.pairwise(own):
            if stance.first > 0:
                standing = stance.last + 1 - stance.first
                shares.append(standing / (following.first - stance.first))
    return float(np.mean(shares)) if shares else float("nan")


def double_support(motion: Motion) -> float:
    """Return the mean share of a complete cycle in which both feet stand."""
    feet = [motion.contacts[:, _COLUMNS[side]].any(axis=1) for side in "rl"]
    both = feet[0] & feet[1]
    shares = [both[a:b].mean() for side in "rl" for a, b in gait_cycles(motion, side)]
    return float(np.mean(shares)) if shares else float("nan")


def foot_slip_mm(motion: Motion) -> float:
    """Return the median over point contacts of the rms horizontal distance from their mean place.

    In mm; nan for a motion without contacts.
    """
    points = contact_points(motion.body, motion.pose())[..., [0, 2]]
    slips = []
    for p in range(points.shape[1]):
        for first, last in runs(motion.contacts[:, p]):
            path = points[first : last + 1, p]
            slips.append(np.sqrt(((path - path.mean(axis=0)) ** 2).sum(axis=1).mean()))
    return 1000.0 * float(np.median(slips)) if slips else float("nan")


def penetration_mm(motion: Motion) -> float:
    """Return how deep the deepest foot point lies below its ground, in mm; 0 if none does.

    The ground is y = 0, or, during a contact whose median height is 5 cm or more (a stair, a
    block), that height.
    """
    heights = contact_points(motion.body, motion.pose())[..., 1]
    ground = np.zeros_like(heights)
    for p in range(heights.shape[1]):
        for first, last in runs(motion.contacts[:, p]):
            level = float(np.median(heights[first : last + 1, p]))
            if level >= RAISED_GROUND_M:
                ground[first : last + 1, p] = level
    return 1000.0 * max(0.0, float((ground - heights).max()))


def clinical_angles(motion: Motion) -> dict[str, Array]:
    """Return joint angles in degrees, (F,) each, in the signs of clinical gait analysis.

    hip_flexion_r/l : first angle of the Cardan sequence z-x-y of the thigh relative to the
    pelvis. knee_flexion_r/l, ankle_dorsiflexion_r/l : 0 when straight and when the sole is square
    to the shank. trunk_lean : from mid-hip to neck against the vertical, forward positive, in
    the direction of travel.
    """
    pose = motion.pose()
    angles = {}
    pelvis = pose.rotations[:, NODE_INDEX["pelvis"]]
    for side in "rl":
        thigh = pose.rotations[:, NODE_INDEX[f"thigh_{side}"]]
        relative = Rotation.from_matrix(np.swapaxes(pelvis, 1, 2) @ thigh)
        flexion = relative.as_euler("ZXY")[:, 0]
        angles[f"hip_flexion_{side}"] = np.degrees(np.unwrap(flexion))
        for name in (f"knee_flexion_{side}", f"ankle_dorsiflexion_{side}"):
            angles[name] = np.degrees(motion.coordinates[:, COORDINATE_INDEX[name]])
    trunk = pose.positions[:, NODE_INDEX["head"]] - pose.positions[:, NODE_INDEX["pelvis"]]
    forward = (trunk * travel_directions(motion)).sum(axis=1)
    angles["trunk_lean"] = np.degrees(np.arctan2(forward, trunk[:, 1]))
    return angles


def normalised_cycles(signal: Array, cycles: Sequence[Cycle], count: int = 101) -> Array:
    """Return a signal (F,) over each cycle at `count` instants from 0 to 100 %, (C, count)."""
    frames = np.arange(len(signal))
    rows = [np.interp(np.linspace(a, b, count), frames, signal) for a, b in cycles]
    return np.array(rows).reshape(len(cycles), count)


def joint_cycles(motion: Motion, joint: str, count: int = 101) -> Array:
    """Return a joint angle's cycles of both legs, each from its own heel strike, (C, count), deg.

    joint : "hip_flexion", "knee_flexion" or "ankle_dorsiflexion".
    """
    angles = clinical_angles(motion)
    return np.concatenate(
        [
            normalised_cycles(angles[f"{joint}_{side}"], gait_cycles(motion, side), count)
            for side in "rl"
        ]
    )
