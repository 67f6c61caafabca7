"""Gait cycles without contacts: the phase of a walk or run, mean cycles, and distances.

The phase is taken from the difference of both thighs' flexion, which crosses zero once upwards in
each cycle of walking and of running. Contacts are not used: synthesised feet may skate.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.layout import COORDINATE_INDEX, JOINT_COORDINATES
from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.gait import clinical_angles, mean_speed
from motionstyle.motion.motion import Motion
from motionstyle.motion.resample import lowpass
from motionstyle.shmm.features import JOINTS_COUNT, pose_channels

Array = NDArray[np.float64]
PHASES = 100
SHORTEST_CYCLE_S, LONGEST_CYCLE_S = 0.3, 2.5
LARGEST_SHIFT = 0.15  # of a cycle, when two are aligned
_SEEN = slice(0, JOINTS_COUNT)


def cycle_starts(motion: Motion) -> Array:
    """Return the times, in frames, at which the right thigh overtakes the left one."""
    hips = [COORDINATE_INDEX[f"hip_flexion_{side}"] for side in "rl"]
    lead = motion.coordinates[:, hips[0]] - motion.coordinates[:, hips[1]]
    smooth = lowpass(lead, motion.rate_hz, 4.0)
    middle = (np.quantile(smooth, 0.05) + np.quantile(smooth, 0.95)) / 2
    smooth = smooth - middle
    before = np.flatnonzero((smooth[:-1] < 0) & (smooth[1:] >= 0))
    starts = before + smooth[before] / (smooth[before] - smooth[before + 1])
    kept: list[float] = []
    for start in starts:
        if not kept or start - kept[-1] >= SHORTEST_CYCLE_S * motion.rate_hz:
            kept.append(float(start))
    return np.array(kept)


@dataclass(frozen=True)
class MeanCycle:
    """A mean gait cycle: pose channels at equal phases (P, 36), its length in s, its count."""

    channels: Array
    period_s: float
    count: int

    @property
    def joints(self) -> Array:
        """Joint angles (P, 29), rad."""
        return self.channels[:, _SEEN]


def mean_cycle(*motions: Motion) -> MeanCycle:
    """Return the mean of all complete gait cycles of some motions.

    Raises
    ------
    MotionStyleError
        If none of them has a complete cycle.
    """
    cycles, periods = [], []
    for motion in motions:
        channels, starts = pose_channels(motion), cycle_starts(motion)
        frames = np.arange(motion.frames)
        for a, b in itertools.pairwise(starts):
            if b - a > LONGEST_CYCLE_S * motion.rate_hz:
                continue
            at = np.linspace(a, b, PHASES, endpoint=False)
            cycles.append(np.stack([np.interp(at, frames, c) for c in channels.T], axis=1))
            periods.append((b - a) / motion.rate_hz)
    if not cycles:
        names = ", ".join(m.id for m in motions)
        raise MotionStyleError(f"{names}: no complete gait cycle (two strides are needed)")
    return MeanCycle(np.mean(cycles, axis=0), float(np.mean(periods)), len(cycles))


def best_shift(a: MeanCycle, b: MeanCycle) -> int:
    """Return by how many phases b must be rolled to fit a best, within ±15 % of a cycle."""
    reach = round(LARGEST_SHIFT * PHASES)
    shifts = np.arange(-reach, reach + 1)
    errors = [((a.joints - np.roll(b.joints, s, axis=0)) ** 2).mean() for s in shifts]
    return int(shifts[int(np.argmin(errors))])


def pose_distance_deg(
    a: MeanCycle, b: MeanCycle, observed: NDArray[np.bool_] | None = None
) -> float:
    """Return the rms difference of joint angles of two aligned cycles, deg.

    observed : which of the 35 coordinates count; by default all joints.
    """
    difference = a.joints - np.roll(b.joints, best_shift(a, b), axis=0)
    if observed is not None:
        difference = difference[:, observed[JOINT_COORDINATES]]
    return float(np.degrees(np.sqrt((difference**2).mean())))


def repeated(cycle: MeanCycle, cycles: int, rate_hz: float) -> Array:
    """Return the channels (F, 36) of a mean cycle repeated some times at a rate."""
    frames = round(cycles * cycle.period_s * rate_hz) + 1
    phase = (np.arange(frames) / (cycle.period_s * rate_hz)) % 1.0
    wrapped = np.concatenate([cycle.channels, cycle.channels[:1]])
    at = np.linspace(0, 1, PHASES + 1)
    return np.stack([np.interp(phase, at, column) for column in wrapped.T], axis=1)


@dataclass(frozen=True)
class GaitNumbers:
    """Speed m/s, cadence steps/min, arm swing deg, trunk lean deg, step length m."""

    speed_mps: float
    cadence: float
    arm_swing_deg: float
    trunk_lean_deg: float
    step_length_m: float


def arm_swing_deg(motion: Motion) -> float:
    """Return the range of shoulder flexion over a mean cycle, mean of both sides, deg."""
    cycle = mean_cycle(motion)
    columns = [COORDINATE_INDEX[f"shoulder_flexion_{s}"] - JOINT_COORDINATES.start for s in "rl"]
    return float(np.degrees(np.ptp(cycle.joints[:, columns], axis=0)).mean())


def gait_numbers(motion: Motion) -> GaitNumbers:
    """Return the numbers by which analogies are compared."""
    cycle = mean_cycle(motion)
    speed = mean_speed(motion)
    lean = float(clinical_angles(motion)["trunk_lean"].mean())
    return GaitNumbers(
        speed, 120.0 / cycle.period_s, arm_swing_deg(motion), lean, speed * cycle.period_s / 2
    )
