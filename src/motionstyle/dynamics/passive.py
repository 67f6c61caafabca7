"""Springs and dampers at the joints: Liu et al. 2005, eqs. (6), (7), and their start (22)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

Array = NDArray[np.float64]
SIGMOID_GAIN = 500.0  # 1/rad, of eq. (7)
LARGEST_STIFFNESS, LARGEST_DAMPING = 500.0, 50.0  # N·m/rad, N·m·s/rad (nio.md §9, our bounds)


@dataclass(frozen=True)
class PassiveParameters:
    """Springs and dampers of the 29 joint coordinates, each (29,).

    stiffness_above acts where the angle exceeds the rest angle (k_s1), stiffness_below where it
    is less (k_s2), in N·m/rad; damping (k_d) in N·m·s/rad; rest_angle in rad.
    """

    stiffness_above: Array
    stiffness_below: Array
    damping: Array
    rest_angle: Array


def sigmoid(x: Array, gain: float = SIGMOID_GAIN) -> Array:
    """Return γ(x) = ½(tanh(gain·x) + 1) of eq. (7), in the paper with a gain of 500."""
    return 0.5 * (np.tanh(gain * x) + 1)


def sigmoid_slopes(x: Array, gain: float = SIGMOID_GAIN) -> tuple[Array, Array, Array]:
    """Return γ(x), γ′(x) and γ″(x)."""
    turn = np.tanh(gain * x)
    steep = 0.5 * gain * (1 - turn**2)
    return 0.5 * (turn + 1), steep, -2 * gain * turn * steep


def passive_forces(parameters: PassiveParameters, angles: Array, rates: Array) -> Array:
    """Return Q_p of eq. (6) in N·m for joint angles (F, 29) in rad and rates in rad/s."""
    away = angles - parameters.rest_angle
    above = sigmoid(away)
    stiffness = above * parameters.stiffness_above + (1 - above) * parameters.stiffness_below
    return -stiffness * away - parameters.damping * rates


def initial_passive(angles: Array, rates: Array, joint_forces: Array) -> PassiveParameters:
    """Return the springs and dampers that leave least to the muscles, eq. (22) with A3.

    The rest pose is the mean pose; each joint is a bounded linear least-squares problem over all
    frames (the printed equation lacks the sum over time).

    Parameters
    ----------
    angles, rates : of the joints, (F, 29). joint_forces : inertia − gravity − contacts, (F, 29).
    """
    rest = angles.mean(axis=0)
    away = angles - rest
    above = sigmoid(away)
    bounds = (np.zeros(3), [LARGEST_STIFFNESS, LARGEST_STIFFNESS, LARGEST_DAMPING])
    found = np.zeros((angles.shape[1], 3))
    for j in range(angles.shape[1]):
        design = np.stack(
            [above[:, j] * away[:, j], (1 - above[:, j]) * away[:, j], rates[:, j]], 1
        )
        if np.abs(design).max() > 1e-9:
            found[j] = lsq_linear(design, -joint_forces[:, j], bounds=bounds).x
    return PassiveParameters(found[:, 0], found[:, 1], found[:, 2], rest)
