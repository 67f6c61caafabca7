"""Finishing synthesised motions, and the table that judges all of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.kinematics import contact_points, end_points
from motionstyle.body.layout import CONTACT_POINTS, JOINT_COORDINATES
from motionstyle.body.ranges import joint_ranges
from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.gait import foot_stances, step_widths
from motionstyle.evaluation.style_machines.cycles import gait_numbers
from motionstyle.mocap.fitting.contacts import detect_contacts
from motionstyle.mocap.fitting.floor import StanceThresholds, runs
from motionstyle.motion.motion import Motion
from motionstyle.shmm.contact_cleanup import clean_up

Array = NDArray[np.float64]
SYNTHESIS_COLUMNS = (
    *("id", "config", "data", "experiment", "role", "style", "content", "status", "reason"),
    *("frames", "rate_hz", "speed_mps", "cadence", "step_length_m", "step_width_cm"),
    *("arm_swing_deg", "trunk_lean_deg", "hip_roll_deg"),
    *("skate_mm", "skate_after_cleanup_mm", "peak_acceleration_ratio"),
    *("joint_range_violation_pct", "style_recognised"),
)
STANDING_M = 0.015
RANGE_MARGIN_DEG = 5.0


def finished(motion: Motion, thresholds: StanceThresholds) -> Motion:
    """Return a synthesised motion on the floor, with its contacts detected.

    The pelvis is lowered or raised by one constant, so that a foot's lowest point lies at y = 0 in
    the median frame of the lower half.
    """
    lowest = contact_points(motion.body, motion.pose())[..., 1].min(axis=1)
    floor = float(np.quantile(lowest, 0.25))
    moved = motion.coordinates.copy()
    moved[:, 1] -= floor
    motion = replace(motion, coordinates=moved)
    points = contact_points(motion.body, motion.pose())
    ground = np.zeros(points.shape[:2])  # a level floor
    return replace(motion, contacts=detect_contacts(points, motion.rate_hz, thresholds, ground))


def skate_mm(motion: Motion) -> float:
    """Return how far a low foot slides: median over stretches of the rms about their mean, mm.

    A stretch is when the lowest point of a foot is below 1.5 cm, whatever its speed; contacts that
    are found by speed would hide sliding.
    """
    points = contact_points(motion.body, motion.pose())
    found = []
    for side in "rl":
        columns = [i for i, name in enumerate(CONTACT_POINTS) if name.endswith(f"_{side}")]
        foot = points[:, columns]
        low = foot[..., 1].min(axis=1) < STANDING_M
        for first, last in runs(low):
            if last - first + 1 < 0.05 * motion.rate_hz:
                continue
            part = foot[first : last + 1]
            # the point that bears most of the stretch
            bearing = int((part[..., 1] < STANDING_M).sum(axis=0).argmax())
            down = part[:, bearing, 1] < STANDING_M
            path = part[down, bearing][:, [0, 2]]
            found.append(float(np.sqrt(((path - path.mean(axis=0)) ** 2).sum(axis=1).mean())))
    return 1000.0 * float(np.median(found)) if found else float("nan")


def peak_acceleration(motion: Motion) -> float:
    """Return the 99.9 % quantile of the acceleration of hands, head and feet, m/s²."""
    pose = motion.pose()
    points = np.concatenate(
        [contact_points(motion.body, pose), end_points(motion.body, pose)], axis=1
    )
    if motion.frames < 4:
        return float("nan")
    acceleration = np.diff(points, 2, axis=0) * motion.rate_hz**2
    return float(np.quantile(np.linalg.norm(acceleration, axis=-1), 0.999))


def range_violation_pct(motion: Motion, training: Sequence[Motion]) -> float:
    """Return the share of frames with a joint outside its range widened to the training's, %."""
    bounds = joint_ranges()[JOINT_COORDINATES]
    seen = np.concatenate([m.coordinates[:, JOINT_COORDINATES] for m in training])
    margin = np.radians(RANGE_MARGIN_DEG)
    low = np.minimum(bounds[:, 0], seen.min(axis=0) - margin)
    high = np.maximum(bounds[:, 1], seen.max(axis=0) + margin)
    joints = motion.coordinates[:, JOINT_COORDINATES]
    return 100.0 * float(((joints < low) | (joints > high)).any(axis=1).mean())


def hip_roll_deg(motion: Motion) -> float:
    """Return the range of the pelvis' obliquity, deg: the hips' line against the level."""
    pose = motion.pose()
    across = pose.rotations[:, 0, :, 2]
    roll = np.degrees(np.arcsin(np.clip(across[:, 1], -1, 1)))
    return float(np.quantile(roll, 0.95) - np.quantile(roll, 0.05))


def step_width_cm(motion: Motion) -> float:
    """Return the median step width, cm; from low feet where contacts are missing."""
    if len(foot_stances(motion)) >= 3:
        widths = step_widths(motion)
        if len(widths):
            return 100.0 * float(np.median(widths))
    pose = motion.pose()
    points = contact_points(motion.body, pose)
    lateral = []
    for side, sign in (("r", 1.0), ("l", -1.0)):
        columns = [i for i, name in enumerate(CONTACT_POINTS) if name.endswith(f"_{side}")]
        foot = points[:, columns]
        low = foot[..., 1].min(axis=1)
        down = low <= np.quantile(low, 0.3)
        yaw = pose.rotations[:, 0, :, 0] * [1, 0, 1]
        yaw /= np.maximum(np.linalg.norm(yaw, axis=1, keepdims=True), 1e-9)
        right = np.cross(yaw, [0.0, 1.0, 0.0])
        off = ((foot.mean(axis=1) - pose.positions[:, 0]) * right).sum(axis=1)
        lateral.append(sign * float(off[down].mean()))
    return 100.0 * sum(lateral)


def synthesis_row(
    motion: Motion, training: Sequence[Motion], facts: Mapping[str, object], *, gait: bool
) -> dict[str, object]:
    """Return a motion's row with `SYNTHESIS_COLUMNS`; gait numbers only for walks and runs."""
    reference = max(peak_acceleration(m) for m in training)
    row: dict[str, object] = {
        "id": motion.id,
        "status": "ok",
        "frames": motion.frames,
        "rate_hz": motion.rate_hz,
        "skate_mm": skate_mm(motion),
        "skate_after_cleanup_mm": skate_mm(clean_up(motion)),
        "peak_acceleration_ratio": peak_acceleration(motion) / reference,
        "joint_range_violation_pct": range_violation_pct(motion, training),
        **facts,
    }
    if gait:
        try:
            numbers = gait_numbers(motion)
        except MotionStyleError as error:
            return row | {"status": "no gait cycle", "reason": str(error)}
        row |= {
            "speed_mps": numbers.speed_mps,
            "cadence": numbers.cadence,
            "step_length_m": numbers.step_length_m,
            "arm_swing_deg": numbers.arm_swing_deg,
            "trunk_lean_deg": numbers.trunk_lean_deg,
            "step_width_cm": step_width_cm(motion),
            "hip_roll_deg": hip_roll_deg(motion),
        }
    return row
