"""What synthesised motions show, as the claims ask for it: lean, twist, swing, feet, forces.

Pure functions of a motion (and, for soundness, of the constraints it was made under). Angles in
degrees, lengths in cm or mm as the names say; nan where a motion does not show the quantity.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.kinematics import centre_of_mass, contact_points, end_points
from motionstyle.body.layout import COORDINATE_INDEX, COORDINATES, JOINT_COORDINATES, NODE_INDEX
from motionstyle.evaluation.gait import (
    clinical_angles,
    gait_cycles,
    normalised_cycles,
    smooth_path,
    travel_directions,
)
from motionstyle.mocap.floor import runs
from motionstyle.motion.motion import Motion
from motionstyle.spacetime.foot_constraints import FootConstraints
from motionstyle.spacetime.synthesis_plan import Plan
from motionstyle.spacetime.synthesis_sheet import SynthesisRow

Array = NDArray[np.float64]

GRAVITY = 9.81
WIDEST_TURN_M = 15.0  # where the path's radius is larger, the motion does not turn
LEAST_TURN_DEG = 20.0  # a motion whose path turns less from first to last does not turn at all
UNLOADED_BW = 0.05  # a foot that bears less than this share of body weight flies
CONE_TOLERANCE_N = 0.5
RANGE_TOLERANCE_DEG = 0.1
_UP = np.array([0.0, 1.0, 0.0])


# ------------------------------------------------------------------------------ turns and leans
def turn_rates(motion: Motion) -> Array:
    """Return how fast the path turns, rad/s, left positive, (F,)."""
    directions = travel_directions(motion)
    headings = np.unwrap(np.arctan2(-directions[:, 2], directions[:, 0]))
    return np.gradient(headings, 1 / motion.rate_hz)


def turning_frames(motion: Motion) -> NDArray[np.bool_]:
    """Return in which frames the path's radius is below 15 m, (F,); none of a straight motion."""
    rates = turn_rates(motion)
    if abs(rates.sum()) / motion.rate_hz < np.radians(LEAST_TURN_DEG):
        return np.zeros(motion.frames, dtype=bool)
    speed = np.linalg.norm(np.gradient(smooth_path(motion), 1 / motion.rate_hz, axis=0), axis=1)
    return np.abs(rates) * WIDEST_TURN_M > np.maximum(speed, 0.1)


def _trunk(motion: Motion) -> Array:
    """Return mid-hip to neck, (F, 3), m."""
    pose = motion.pose()
    hips = [pose.positions[:, NODE_INDEX[f"thigh_{side}"]] for side in "rl"]
    return pose.positions[:, NODE_INDEX["head"]] - (hips[0] + hips[1]) / 2


def lateral_leans(motion: Motion) -> Array:
    """Return the trunk's lean to the left of the direction of travel, degrees, (F,)."""
    trunk = _trunk(motion)
    left = np.cross(_UP, travel_directions(motion))
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


def balance_lean_deg(motion: Motion) -> float:
    """Return atan(v²/(r g)) of the turn: mean speed and radius over the frames that turn."""
    turning = turning_frames(motion)
    if not turning.any():
        return float("nan")
    speed = np.linalg.norm(np.gradient(smooth_path(motion), 1 / motion.rate_hz, axis=0), axis=1)
    v, rate = float(speed[turning].mean()), abs(float(turn_rates(motion)[turning].mean()))
    return float(np.degrees(np.arctan2(v * rate, GRAVITY)))  # v²/r = v·ω


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


# ----------------------------------------------------------------------------------- soundness
def foot_errors_mm(motion: Motion, feet: FootConstraints) -> Array:
    """Return how far each held point is from its target, or a sliding one from its surface."""
    away = contact_points(motion.body, motion.pose()) - feet.targets
    normal = np.abs((away * feet.normals).sum(axis=-1))
    error = np.where(feet.sliding, normal, np.linalg.norm(away, axis=-1))
    return 1000 * error[feet.held]


def foot_error_mm(motion: Motion, feet: FootConstraints) -> float:
    """Return the largest distance of a held point from its target."""
    errors = foot_errors_mm(motion, feet)
    return float(errors.max()) if len(errors) else 0.0


def depth_mm(motion: Motion, feet: FootConstraints, *, allowed: bool = False) -> float:
    """Return how deep the deepest foot point lies below its surface; 0 if none does.

    allowed : count only what is deeper than the clearance allows (a captured motion's own sinking).
    """
    above = (contact_points(motion.body, motion.pose()) - feet.ground) * feet.normals
    heights = above.sum(axis=-1)
    if allowed:
        heights = heights - np.where(feet.held, 0.0, np.minimum(feet.clearance, 0.0))
    return 1000 * max(0.0, -float(heights.min()))


def slide_cm(motion: Motion) -> float:
    """Return the median over contacts of the distance between a point's first and last place."""
    points = contact_points(motion.body, motion.pose())
    slides = [
        np.linalg.norm(points[b, p] - points[a, p])
        for p in range(points.shape[1])
        for a, b in runs(motion.contacts[:, p])
    ]
    return 100 * float(np.median(slides)) if slides else float("nan")


def cone_excess_n(motion: Motion, feet: FootConstraints) -> float:
    """Return by how much the worst contact force leaves its friction cone, N; nan without forces.

    Pulling on the ground and pushing with a point that is not held count in full.
    """
    return (
        float("nan") if motion.contact_forces is None else feet.cone_excess(motion.contact_forces)
    )


def range_excess_deg(motion: Motion, ranges: Array) -> float:
    """Return by how much the worst joint angle leaves its range (35, 2)."""
    q = motion.coordinates
    excess = np.maximum(ranges[:, 0] - q, q - ranges[:, 1])[:, JOINT_COORDINATES]
    return float(np.degrees(max(0.0, float(excess.max()))))


# --------------------------------------------------------------------------------------- rows
MEASURES = {
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
SYNTHESIS_COLUMNS = (
    *("config", "id", "kind", "experiment", "task", "example", "style", "mood", "action"),
    *("subject", "data", "status", "reason", "frames", "rate_hz", "seconds", "iterations"),
    *("E", "optimality", "root_share_of_E_pct"),
    *("foot_error_mm", "foot_rms_mm", "penetration_mm", "penetration_beyond_clearance_mm"),
    *("cone_excess_n", "cone_kept", "joint_range_excess_deg", "joint_ranges_kept"),
    *MEASURES,
    *("style_distance_own_deg", "closer_to_own_style", "closer_to_own_subject"),
    "joint_rms_to_captured_deg",
)


def synthesis_measures(
    motion: Motion,
    feet: FootConstraints,
    ranges: Array,
    *,
    own: Motion | None = None,
    others: Sequence[Motion] = (),
    captured: Motion | None = None,
) -> dict[str, object]:
    """Return the measured columns of a row of `tables/syntheses.csv`.

    Parameters
    ----------
    feet, ranges : what the motion was made under.
    own : the captured motion of the style's clip. others : captured motions of other styles, or of
        the same style by other subjects.
    captured : the captured motion with the same footprints, if there is one.
    """
    errors = foot_errors_mm(motion, feet)
    cone, excess = cone_excess_n(motion, feet), range_excess_deg(motion, ranges)
    row: dict[str, object] = {
        "frames": motion.frames,
        "rate_hz": motion.rate_hz,
        "foot_error_mm": foot_error_mm(motion, feet),
        "foot_rms_mm": float(np.sqrt((errors**2).mean())) if len(errors) else 0.0,
        "penetration_mm": depth_mm(motion, feet),
        "penetration_beyond_clearance_mm": depth_mm(motion, feet, allowed=True),
        "cone_excess_n": cone,
        "cone_kept": None if np.isnan(cone) else cone <= CONE_TOLERANCE_N,
        "joint_range_excess_deg": excess,
        "joint_ranges_kept": excess <= RANGE_TOLERANCE_DEG,
        **{name: measure(motion) for name, measure in MEASURES.items()},
    }
    if captured is not None:
        row["joint_rms_to_captured_deg"] = joint_rms_deg(motion, captured)
    if own is None:
        return row
    row["style_distance_own_deg"] = style_distance_deg(motion, own)
    subject = own.provenance.get("subject")
    same = [one for one in others if one.provenance.get("subject") == subject]
    foreign = [one for one in others if one.provenance.get("subject") != subject]
    row["closer_to_own_style"] = closer_to_own(motion, own, same)
    row["closer_to_own_subject"] = closer_to_own(motion, own, foreign)
    return row


def synthesis_rows(
    row: SynthesisRow,
    plan: Plan | None,
    motions: Mapping[str, Motion],
    reports: Mapping[str, Mapping[str, Any]],
    config: str,
    *,
    own: Motion | None,
    others: Sequence[Motion],
    captured: Motion | None,
) -> list[dict[str, object]]:
    """Return the rows of one synthesis: the motion itself (`nio`), `warp` and `copied`.

    Parameters
    ----------
    plan : None where the footprints have failed; the rows then give the reason.
    motions : by kind, those that could be made. reports : of the solvers, by kind.
    own, others, captured : see `synthesis_measures`.
    """
    about = own.provenance if own is not None else {}
    rows = []
    for kind in ("nio", "warp", "copied"):
        report = reports.get(kind, reports["warp"] if kind == "copied" else {})
        result: dict[str, object] = {
            "config": config,
            "id": row.id,
            "kind": kind,
            "task": row.task,
            "example": row.example,
            "style": row.style,
            "mood": row.mood,
            "action": about.get("action"),
            "subject": about.get("subject"),
            "data": "captured",
        }
        if plan is not None and kind in motions:
            result |= synthesis_measures(
                motions[kind], plan.feet, plan.ranges, own=own, others=others, captured=captured
            )
        if kind != "copied":
            known = {name: report[name] for name in SYNTHESIS_COLUMNS if name in report}
            result |= known
        elif kind in motions:
            result["status"] = "ok"
        else:
            result |= {"status": "failed", "reason": report.get("reason")}
        if "cone_excess_n" in report:
            result["cone_kept"] = report["cone_excess_n"] <= CONE_TOLERANCE_N
        rows += [{**result, "experiment": one} for one in row.experiment or ("",)]
    return rows
