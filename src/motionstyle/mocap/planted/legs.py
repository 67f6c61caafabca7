"""Legs in closed form: six coordinates from the poses of pelvis and foot, all frames at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from motionstyle.body.body import Body
from motionstyle.body.layout import COORDINATE_INDEX, JOINTS, NODE_INDEX
from motionstyle.body.rotations import exponential, logarithm

Array = NDArray[np.float64]
UP = np.array([0.0, 1.0, 0.0])
DROP_WINDOW_S = 0.2  # s over which the pelvis sinks before and rises after a far reach


@dataclass(frozen=True)
class Leg:
    """One leg's lengths: offsets of hip, knee and ankle in their parents' frames, m."""

    side: str
    hip: Array
    knee: Array
    ankle: Array

    @staticmethod
    def of(body: Body, side: str) -> Leg:
        """Return the leg of a body; `side` is "r" or "l"."""
        nodes = (f"{name}_{side}" for name in ("thigh", "shank", "foot"))
        return Leg(side, *(body.joint_offsets[NODE_INDEX[node]] for node in nodes))

    @property
    def columns(self) -> list[int]:
        """Hip flexion, adduction, rotation, knee flexion, ankle dorsiflexion, foot inversion."""
        names = ("hip_flexion", "hip_adduction", "hip_rotation", "knee_flexion")
        names += ("ankle_dorsiflexion", "foot_inversion")
        return [COORDINATE_INDEX[f"{name}_{self.side}"] for name in names]

    def reach(self, knee_rad: float) -> float:
        """Return the distance from hip to ankle, m, at a knee angle."""
        bent = exponential(np.array([0.0, 0.0, -knee_rad])) @ self.ankle
        return float(np.linalg.norm(self.knee + bent))

    def knee_angle(self, distance: Array) -> Array:
        """Return the knee flexion, rad, at distances from hip to ankle; too far is straight."""
        upper, lower = self.knee[:2], self.ankle[:2]
        lengths = np.linalg.norm(upper) * np.linalg.norm(lower)
        rest = self.knee @ self.knee + self.ankle @ self.ankle + 2 * self.knee[2] * self.ankle[2]
        cosine = np.clip((distance**2 - rest) / (2 * lengths), -1.0, 1.0)
        between = np.arctan2(lower[1], lower[0]) - np.arctan2(upper[1], upper[0])
        return np.arccos(cosine) + np.remainder(between + np.pi, 2 * np.pi) - np.pi


def hip_positions(leg: Leg, pelvis: Array, turns: Array) -> Array:
    """Return the hip's path (F, 3) from pelvis positions (F, 3) and rotations (F, 3, 3)."""
    return pelvis + turns @ leg.hip


def needed_drop(leg: Leg, hips: Array, ankles: Array, least_knee: float) -> Array:
    """Return how far, m, the hip must sink in each frame (F,) to reach the ankle, or infinity.

    `least_knee` is the smallest knee flexion allowed, rad.
    """
    apart = np.linalg.norm((hips - ankles)[:, [0, 2]], axis=1)
    square = leg.reach(least_knee) ** 2 - apart**2
    height = np.sqrt(np.maximum(square, 0.0))
    drop = np.maximum(hips[:, 1] - ankles[:, 1] - height, 0.0)
    return np.where(square > 0, drop, np.inf)


def smooth_drop(needed: Array, rate_hz: float) -> Array:
    """Return a smooth path of sinking (F,), m, nowhere less than `needed`."""
    radius = max(2, round(DROP_WINDOW_S * rate_hz))
    highest = maximum_filter1d(needed, 2 * radius + 1, mode="nearest")
    return gaussian_filter1d(highest, radius / 2, mode="nearest", radius=radius)


def solve_leg(
    leg: Leg, pelvis: Array, turns: Array, ankles: Array, feet: Array
) -> NDArray[np.float64]:
    """Return the six coordinates (F, 6), rad, that put the foot where it is wanted.

    The knee angle follows from the distance; the turn about the line from hip to ankle from the
    ankle's having two axes only. Exact where the ankle is within reach.

    Parameters
    ----------
    pelvis, turns : positions (F, 3), m, and rotations (F, 3, 3) of the pelvis.
    ankles, feet : positions (F, 3), m, and rotations (F, 3, 3) of the foot.
    """
    line = ankles - hip_positions(leg, pelvis, turns)
    distance = np.linalg.norm(line, axis=1)
    knee = leg.knee_angle(distance)
    bend = exponential(knee[:, None] * [0.0, 0.0, -1.0])
    local = leg.knee + bend @ leg.ankle
    local /= np.linalg.norm(local, axis=1)[:, None]
    along = line / distance[:, None]
    # the knee's axis: at a known angle to the line, and at right angles to the foot's long axis
    forward = feet[:, :, 0]
    first = forward - (forward * along).sum(axis=1)[:, None] * along
    size = np.linalg.norm(first, axis=1)
    first /= size[:, None]
    second = np.cross(first, along)
    cosine = local[:, 2]
    sine = np.sqrt(1 - cosine**2)
    inward = -cosine * (forward * along).sum(axis=1) / (size * sine)
    inward = np.clip(inward, -1.0, 1.0)
    across = np.sqrt(1 - inward**2)
    right = turns[:, :, 2]
    across *= np.where((second * right).sum(axis=1) < 0, -1.0, 1.0)
    axis = cosine[:, None] * along
    axis += sine[:, None] * (inward[:, None] * first + across[:, None] * second)
    thigh = _frame(along, axis) @ np.swapaxes(_frame(local, np.array([0.0, 0.0, 1.0])), 1, 2)
    hip_axes = np.array(JOINTS[NODE_INDEX[f"thigh_{leg.side}"]].axes)
    foot_axes = np.array(JOINTS[NODE_INDEX[f"foot_{leg.side}"]].axes)
    hip = logarithm(np.swapaxes(turns, 1, 2) @ thigh) @ hip_axes.T
    relative = np.swapaxes(thigh @ bend, 1, 2) @ feet
    dorsiflexion = np.arctan2(relative[:, 1, 0], relative[:, 0, 0])
    inversion = np.arctan2(relative[:, 2, 1], relative[:, 2, 2]) * foot_axes[1, 0]
    return np.column_stack([hip, knee, dorsiflexion, inversion])


def _frame(first: Array, towards: Array) -> Array:
    """Return right-handed frames (F, 3, 3) with a column along `first` and one near `towards`."""
    other = towards - (first * towards).sum(axis=1)[:, None] * first
    other = other / np.linalg.norm(other, axis=1)[:, None]
    return np.stack([first, other, np.cross(first, other)], axis=2)
