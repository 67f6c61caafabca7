"""What synthesised motions show, as the claims ask for it: lean, twist, swing, flight, style.

Pure functions of a motion. Angles in degrees, lengths in cm, as the names say; nan where a motion
does not show the quantity.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.kinematics import centre_of_mass, contact_points, end_points
from motionstyle.body.layout import COORDINATE_INDEX, COORDINATES, JOINT_COORDINATES, NODE_INDEX
from motionstyle.evaluation.gait import (
    clinical_angles,
    feet_path,
    gait_cycles,
    mean_speed,
    normalised_cycles,
    travel_directions,
)
from motionstyle.mocap.fitting.floor import runs
from motionstyle.motion.motion import Motion

Array = NDArray[np.float64]

GRAVITY = 9.81
WIDEST_TURN_M = 15.0  # where the path's radius is larger, the motion does not turn
LEAST_TURN_DEG = 10.0  # a motion whose path turns less from first to last does not turn at all
UNLOADED_BW = 0.05  # a foot that bears less than this share of body weight flies
_UP = np.array([0.0, 1.0, 0.0])


# ------------------------------------------------------------------------------ turns and leans
def turn_rates(motion: Motion) -> Array:
    """Return how fast the feet's path turns, rad/s, left positive, (F,)."""
    directions = travel_directions(motion, feet_path(motion))
    headings = np.unwrap(np.arctan2(-directions[:, 2], directions[:, 0]))
    return np.gradient(headings, 1 / motion.rate_hz)


def turning_frames(motion: Motion) -> NDArray[np.bool_]:
    """Return where the feet's path has a radius below 15 m, (F,); nowhere if it goes straight."""
    rates = turn_rates(motion)
    if abs(rates.sum()) / motion.rate_hz < np.radians(LEAST_TURN_DEG):
        return np.zeros(motion.frames, dtype=bool)
    speed = np.linalg.norm(np.gradient(feet_path(motion), 1 / motion.rate_hz, axis=0), axis=1)
    return np.abs(rates) * WIDEST_TURN_M > np.maximum(speed, 0.1)


def _trunk(motion: Motion) -> Array:
    """Return mid-hip to neck, (F, 3), m."""
    pose = motion.pose()
    hips = [pose.positions[:, NODE_INDEX[f"thigh_{side}"]] for side in "rl"]
    return pose.positions[:, NODE_INDEX["head"]] - (hips[0] + hips[1]) / 2


def lateral_leans(motion: Motion) -> Array:
    """Return the trunk's lean to the left of the way the feet go, degrees, (F,)."""
    trunk = _trunk(motion)
    left = np.cross(_UP, travel_directions(motion, feet_path(motion)))
    return np.degrees(np.arctan2((trunk * left).sum(axis=1), trunk[:, 1]))


def lean_left_deg(motion: Motion) -> float:
    """Return the trunk's mean lean to the left."""
    return float(lateral_leans(motion).mean())


def lean_to_centre_deg(motion: Motion) -> float:
    """Return the trunk's mean lean towards the centre of the turn, over the frames that turn."""
    turning = turning_frames(motion)
    if not turning.any():
        return float("nan")
    rates = turn_rates(motion)[turning]
    return float((lateral_leans(motion)[turning] * np.sign(rates.sum())).mean())


def turn_radius_m(motion: Motion) -> float:
    """Return the radius of the circle through the whole path of the pelvis; nan if it is straight.

    Least squares on x² + z² = 2ax + 2bz + c, over all frames, so that the sway of single steps
    averages out; for motions that turn all the way.
    """
    if not turning_frames(motion).any():
        return float("nan")
    path = motion.coordinates[:, [0, 2]]
    middle = path.mean(axis=0)
    x, z = (path - middle).T
    a, b, c = np.linalg.lstsq(
        np.column_stack([2 * x, 2 * z, np.ones(len(x))]), x**2 + z**2, rcond=None
    )[0]
    return float(np.sqrt(max(c + a**2 + b**2, 0.0)))


def balance_lean_deg(motion: Motion) -> float:
    """Return atan(v²/(r g)) of a motion that turns all the way: mean speed, and `turn_radius_m`."""
    radius = turn_radius_m(motion)
    return float(np.degrees(np.arctan(mean_speed(motion) ** 2 / (radius * GRAVITY))))


def lean_over_balance_ratio(motion: Motion) -> float:
    """Return the lean towards the centre over the one that balances the centripetal force."""
    balance = balance_lean_deg(motion)
    return lean_to_centre_deg(motion) / balance if balance > 1e-6 else float("nan")


def trunk_lean_deg(motion: Motion) -> float:
    """Return the trunk's mean forward lean in the direction of travel."""
    return float(clinical_angles(motion)["trunk_lean"].mean())


def torso_twist_range_deg(motion: Motion) -> float:
    """Return the range of the angle between hip line and shoulder line, seen from above."""
    pose = motion.pose()
    headings = []
    for joint in ("thigh", "upper_arm"):
        line = (
            pose.positions[:, NODE_INDEX[f"{joint}_r"]]
            - pose.positions[:, NODE_INDEX[f"{joint}_l"]]
        )
        headings.append(np.arctan2(-line[:, 2], line[:, 0]))
    return float(np.degrees(np.ptp(np.unwrap(headings[1] - headings[0]))))


# ----------------------------------------------------------------------------- arms and centre
def right_arm_swing_deg(motion: Motion) -> float:
    """Return the range of the right shoulder's flexion."""
    return float(np.degrees(np.ptp(motion.coordinates[:, COORDINATE_INDEX["shoulder_flexion_r"]])))


def elbow_flexion_deg(motion: Motion) -> float:
    """Return the mean flexion of both elbows."""
    columns = [COORDINATE_INDEX[f"elbow_flexion_{side}"] for side in "rl"]
    return float(np.degrees(motion.coordinates[:, columns].mean()))


def _right_hand_forward(motion: Motion) -> Array:
    """Return how far the right hand's middle is before the shoulder, m, (F,)."""
    pose = motion.pose()
    hand = pose.positions[:, NODE_INDEX["hand_r"]]
    middle = (hand + end_points(motion.body, pose)[:, 1]) / 2
    away = middle - pose.positions[:, NODE_INDEX["upper_arm_r"]]
    return (away * travel_directions(motion)).sum(axis=1)


def right_hand_forward_mean_cm(motion: Motion) -> float:
    """Return the right hand's mean place before (positive) or behind the shoulder."""
    return 100 * float(_right_hand_forward(motion).mean())


def right_hand_forward_range_cm(motion: Motion) -> float:
    """Return how far the right hand swings to and fro, relative to the shoulder."""
    return 100 * float(np.ptp(_right_hand_forward(motion)))


def com_vertical_range_cm(motion: Motion) -> float:
    """Return the vertical travel of the centre of mass, less a steady rise or fall."""
    height = centre_of_mass(motion.body, motion.pose())[:, 1]
    times = motion.times
    if motion.frames > 2:
        height = height - np.polyval(np.polyfit(times, height, 1), times)
    return 100 * float(np.ptp(height))


def flight_s(motion: Motion) -> float:
    """Return the mean time in the air between two steps; 0 if a foot is always down.

    A foot is down while it bears more than 5 % of body weight, or, where forces are unknown, while
    it is in contact. Flights cut off by the motion's ends do not count.
    """
    if motion.contact_forces is None:
        down = motion.contacts.any(axis=1)
    else:
        vertical = (motion.contact_forces * motion.contact_normals).sum(axis=(1, 2))
        down = vertical > UNLOADED_BW * motion.body.mass * GRAVITY
    flights = [b + 1 - a for a, b in runs(~down) if a > 0 and b < motion.frames - 1]
    return float(np.mean(flights)) / motion.rate_hz if flights else 0.0


def peak_normal_force_bw(motion: Motion) -> float:
    """Return the mean over stances of a foot's peak normal force, in body weights."""
    if motion.contact_forces is None:
        return float("nan")
    normal = (motion.contact_forces * motion.contact_normals).sum(axis=-1)
    peaks = []
    for columns in (slice(0, 4), slice(4, 8)):
        foot = normal[:, columns].sum(axis=1)
        stances = runs(motion.contacts[:, columns].any(axis=1))
        peaks += [foot[a : b + 1].max() for a, b in stances if a > 0 and b < motion.frames - 1]
    return float(np.mean(peaks)) / (motion.body.mass * GRAVITY) if peaks else float("nan")


# ------------------------------------------------------------------------------ style distance
def _scored(motion: Motion, other: Motion) -> NDArray[np.bool_]:
    """Return which of the 29 joints both motions show, toes left out."""
    toes = np.array([name.startswith("toes") for name in COORDINATES])
    return (motion.observed & other.observed & ~toes)[JOINT_COORDINATES]


def mean_cycle(motion: Motion, count: int = 51) -> Array | None:
    """Return the joints' mean gait cycle from right heel strike, rad, (count, 29); None if none.

    Where only the left foot shows a whole cycle it is shifted by half of one.
    """
    joints = motion.coordinates[:, JOINT_COORDINATES]
    for side in "rl":
        cycles = gait_cycles(motion, side)
        if cycles:
            signals = [normalised_cycles(s, cycles, count).mean(axis=0) for s in joints.T]
            mean = np.stack(signals, axis=1)
            if side == "l":
                mean = np.roll(mean[:-1], (count - 1) // 2, axis=0)
                mean = np.concatenate([mean, mean[:1]])
            return mean
    return None


def style_distance_deg(motion: Motion, reference: Motion) -> float:
    """Return how far apart two movements are in joint angles, rms over joints and gait cycle.

    Mean cycles from right heel strike are compared; where a motion shows no whole cycle, each
    joint's mean and standard deviation over the motion are.
    """
    keep = _scored(motion, reference)
    own, other = mean_cycle(motion), mean_cycle(reference)
    if own is None or other is None:
        a, b = (m.coordinates[:, JOINT_COORDINATES] for m in (motion, reference))
        shift, spread = a.mean(axis=0) - b.mean(axis=0), a.std(axis=0) - b.std(axis=0)
        return float(np.degrees(np.sqrt((shift**2 + spread**2)[keep].mean())))
    return float(np.degrees(np.sqrt(((own - other)[:, keep] ** 2).mean())))


def closer_to_own(motion: Motion, own: Motion, others: Sequence[Motion]) -> bool | None:
    """Return whether a motion is closer to its own style (or subject) than to any other's."""
    if not others:
        return None
    distance = style_distance_deg(motion, own)
    return all(distance < style_distance_deg(motion, other) for other in others)


def joint_rms_deg(motion: Motion, reference: Motion) -> float:
    """Return the rms difference of joint angles, frame by frame, over joints that both show.

    Nan if the motions differ in length.
    """
    if motion.frames != reference.frames:
        return float("nan")
    keep = _scored(motion, reference)
    away = (motion.coordinates - reference.coordinates)[:, JOINT_COORDINATES][:, keep]
    return float(np.degrees(np.sqrt((away**2).mean())))


# ----------------------------------------------------------------------------------------- feet
def slide_cm(motion: Motion) -> float:
    """Return the median over contacts of the distance between a point's first and last place."""
    points = contact_points(motion.body, motion.pose())
    slides = [
        np.linalg.norm(points[b, p] - points[a, p])
        for p in range(points.shape[1])
        for a, b in runs(motion.contacts[:, p])
    ]
    return 100 * float(np.median(slides)) if slides else float("nan")


MEASURES: dict[str, Callable[[Motion], float]] = {
    "lean_to_centre_deg": lean_to_centre_deg,
    "lean_over_balance_ratio": lean_over_balance_ratio,
    "lean_left_deg": lean_left_deg,
    "trunk_lean_deg": trunk_lean_deg,
    "torso_twist_range_deg": torso_twist_range_deg,
    "right_arm_swing_deg": right_arm_swing_deg,
    "right_hand_forward_mean_cm": right_hand_forward_mean_cm,
    "right_hand_forward_range_cm": right_hand_forward_range_cm,
    "elbow_flexion_deg": elbow_flexion_deg,
    "com_vertical_range_cm": com_vertical_range_cm,
    "flight_s": flight_s,
    "peak_normal_force_bw": peak_normal_force_bw,
    "slide_cm": slide_cm,
}
