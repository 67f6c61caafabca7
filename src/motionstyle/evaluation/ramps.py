"""Walking on ramps against walking on the level: rows of `tables/ramp_gait.csv`.

biomechanics.md §5.4: signs and bands of angles, and the exact laws of the mean forces. Changes are
ramp minus level, of motions of the same style, made in the same way.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.layout import COORDINATE_INDEX
from motionstyle.evaluation.gait import (
    clinical_angles,
    foot_stances,
    foot_strikes,
    gait_cycles,
    travel_directions,
)
from motionstyle.motion.motion import Motion

Array = NDArray[np.float64]
Torques = Callable[[Motion], Array]

GRAVITY = 9.81
LATE_STANCE = (0.4, 0.8)  # of a stance: 25 to 50 % of the cycle
FIRST_HALF = 0.5  # of a stance, in which the first peak of the support moment lies
_JOINTS = ("hip_flexion", "knee_flexion", "ankle_dorsiflexion")
RAMP_COLUMNS = (
    *("config", "id", "level_id", "kind", "status", "mood", "subject", "direction", "slope_deg"),
    *("trunk_pitch_change_deg", "hip_heel_strike_change_deg", "knee_heel_strike_change_deg"),
    *("ankle_heel_strike_change_deg", "knee_stance_change_deg"),
    *("peak_normal_force_change_pctbw", "support_moment_change_nm_per_kg"),
    *("impulse_law_error_pctbw", "mean_tangential_error_pctbw", "mean_normal_error_pctbw"),
    "momentum_change_pctbw",
)


def heel_strike_angle(motion: Motion, joint: str) -> float:
    """Return a joint's mean angle at the heel strikes of both feet, degrees; nan without one."""
    angles = clinical_angles(motion)
    found = [angles[f"{joint}_{side}"][f] for side in "rl" for f in foot_strikes(motion, side)]
    return float(np.mean(found)) if found else float("nan")


def _whole_stances(motion: Motion) -> list[tuple[str, NDArray[np.int64]]]:
    """Return side and frames of the stances that begin and end within the motion."""
    return [
        (s.side, np.arange(s.first, s.last + 1))
        for s in foot_stances(motion)
        if s.first > 0 and s.last < motion.frames - 1
    ]


def late_stance_knee(motion: Motion) -> float:
    """Return the mean knee flexion in mid to late stance, degrees; nan without a whole stance."""
    angles = clinical_angles(motion)
    means = []
    for side, frames in _whole_stances(motion):
        low, high = (round(share * (len(frames) - 1)) for share in LATE_STANCE)
        means.append(angles[f"knee_flexion_{side}"][frames[low : high + 1]].mean())
    return float(np.mean(means)) if means else float("nan")


def peak_normal_force(motion: Motion) -> float:
    """Return the mean over whole stances of a foot's peak normal force, % of body weight."""
    if motion.contact_forces is None:
        return float("nan")
    normal = (motion.contact_forces * motion.contact_normals).sum(axis=-1)
    columns = {"r": slice(0, 4), "l": slice(4, 8)}
    peaks = [normal[f, columns[s]].sum(axis=1).max() for s, f in _whole_stances(motion)]
    weight = motion.body.mass * GRAVITY
    return 100 * float(np.mean(peaks)) / weight if peaks else float("nan")


def support_moment(motion: Motion, torques: Array) -> float:
    """Return the first peak of hip and knee extensor plus plantarflexor moment, N·m/kg.

    torques : net joint torques (F, 35), positive as the coordinates are. The mean over whole
    stances of the peak in their first half.
    """
    peaks = []
    for side, frames in _whole_stances(motion):
        columns = [COORDINATE_INDEX[f"{joint}_{side}"] for joint in _JOINTS]
        moment = -torques[:, columns].sum(axis=1)
        half = frames[: max(1, round(FIRST_HALF * len(frames)))]
        peaks.append(moment[half].max())
    return float(np.mean(peaks)) / motion.body.mass if peaks else float("nan")


def mean_forces(motion: Motion, slope_deg: float) -> dict[str, float]:
    """Return how far the mean forces of whole cycles are from their exact laws, % of body weight.

    tangential : along the slope, against m g sin β. normal : against m g cos β. impulse :
    propulsive minus braking impulse over the time, against the same as tangential. momentum : what
    a change of speed over the cycles, which the laws take to be none, adds to tangential.
    """
    cycles = [c for side in "rl" for c in gait_cycles(motion, side)]
    names = ("tangential", "normal", "impulse", "momentum")
    if motion.contact_forces is None or not cycles:
        return dict.fromkeys(names, float("nan"))
    slope = np.radians(slope_deg)
    way = travel_directions(motion).mean(axis=0)
    way /= np.linalg.norm(way)
    up = np.array([0.0, 1.0, 0.0])
    along, square = (
        np.cos(slope) * way + np.sin(slope) * up,
        np.cos(slope) * up - np.sin(slope) * way,
    )
    total = motion.contact_forces.sum(axis=1)
    weight = motion.body.mass * GRAVITY
    speed = np.gradient(motion.coordinates[:, :3] @ along, 1 / motion.rate_hz)
    rows = []
    for first, last in cycles:
        force = total[first:last] @ along / weight
        propulsion, braking = np.maximum(force, 0).mean(), np.maximum(-force, 0).mean()
        rows.append(
            (
                force.mean() - np.sin(slope),
                (total[first:last] @ square / weight).mean() - np.cos(slope),
                propulsion - braking - np.sin(slope),
                (speed[last] - speed[first]) * motion.rate_hz / (last - first) / GRAVITY,
            )
        )
    return {n: 100 * float(v) for n, v in zip(names, np.mean(rows, axis=0), strict=True)}


def ramp_row(
    motion: Motion, level: Motion, slope_deg: float, torques: Torques | None = None
) -> dict[str, object]:
    """Return the measured columns of a row: a motion on a ramp against one on the level.

    torques : net joint torques (F, 35) of a motion, in N·m; without it, or without contact
    forces, the support moment stays empty.
    """
    pair = (motion, level)

    def change(measure: Callable[[Motion], float]) -> float:
        return measure(motion) - measure(level)

    row: dict[str, object] = {
        "direction": "up" if slope_deg > 0 else "down",
        "slope_deg": slope_deg,
        "trunk_pitch_change_deg": change(lambda m: float(clinical_angles(m)["trunk_lean"].mean())),
        "knee_stance_change_deg": change(late_stance_knee),
        "peak_normal_force_change_pctbw": change(peak_normal_force),
    }
    for name, joint in zip(("hip", "knee", "ankle"), _JOINTS, strict=True):
        row[f"{name}_heel_strike_change_deg"] = change(lambda m, j=joint: heel_strike_angle(m, j))
    if torques is not None and all(m.contact_forces is not None for m in pair):
        row["support_moment_change_nm_per_kg"] = change(lambda m: support_moment(m, torques(m)))
    laws: Mapping[str, float] = mean_forces(motion, slope_deg)
    row["mean_tangential_error_pctbw"] = laws["tangential"]
    row["mean_normal_error_pctbw"] = laws["normal"]
    row["impulse_law_error_pctbw"] = laws["impulse"]
    row["momentum_change_pctbw"] = laws["momentum"]
    return row
