"""Spring shoes under the heels: Liu et al. 2005, eq. (9)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionstyle.dynamics.passive import SIGMOID_GAIN, sigmoid

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Shoes:
    """Shoes of both feet: stiffness k_shoe in N/m and rest length h̄ in m."""

    stiffness: float
    rest_length: float

    def force(self, heights: Array) -> Array:
        """Return γ(h̄ − h) k (h̄ − h) of eq. (9) in N for heel heights h in m, along the normal.

        As a force at the heel along the ground's normal it does the work of eq. (9), since ∂h/∂q
        is the normal's component of the heel's Jacobian.
        """
        squeeze = self.rest_length - heights
        return sigmoid(squeeze) * self.stiffness * squeeze

    def force_by_height(self, heights: Array) -> Array:
        """Return the force's slope in N/m over the heel's height."""
        squeeze = self.rest_length - heights
        return -self.stiffness * (sigmoid(squeeze) + _sigmoid_slope(squeeze) * squeeze)

    def force_by_parameters(self, heights: Array) -> Array:
        """Return the force's slopes over stiffness and rest length, (..., 2) (nio.md §4.6)."""
        squeeze = self.rest_length - heights
        return np.stack([sigmoid(squeeze) * squeeze, -self.force_by_height(heights)], axis=-1)


def _sigmoid_slope(x: Array) -> Array:
    """Return γ'(x) = 250 sech²(500 x)."""
    return 0.5 * SIGMOID_GAIN * (1 - np.tanh(SIGMOID_GAIN * x) ** 2)
