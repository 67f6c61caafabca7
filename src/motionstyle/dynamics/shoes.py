"""Spring shoes under the heels: Liu et al. 2005, eq. (9)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionstyle.dynamics.passive import SIGMOID_GAIN, sigmoid, sigmoid_slopes

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Shoes:
    """Shoes of both feet: stiffness k_shoe in N/m, rest length h̄ in m, gain of γ in 1/m."""

    stiffness: float
    rest_length: float
    gain: float = SIGMOID_GAIN

    def force(self, heights: Array) -> Array:
        """Return γ(h̄ − h) k (h̄ − h) of eq. (9) in N for heel heights h in m, along the normal.

        As a force at the heel along the ground's normal it does the work of eq. (9), since ∂h/∂q
        is the normal's component of the heel's Jacobian.
        """
        squeeze = self.rest_length - heights
        return sigmoid(squeeze, self.gain) * self.stiffness * squeeze

    def force_by_height(self, heights: Array) -> Array:
        """Return the force's slope in N/m over the heel's height."""
        squeeze = self.rest_length - heights
        on, steep, _bend = sigmoid_slopes(squeeze, self.gain)
        return -self.stiffness * (on + steep * squeeze)

    def force_by_height_twice(self, heights: Array) -> Array:
        """Return the force's second derivative in N/m² over the heel's height."""
        squeeze = self.rest_length - heights
        _on, steep, bend = sigmoid_slopes(squeeze, self.gain)
        return self.stiffness * (2 * steep + bend * squeeze)

    def force_by_parameters(self, heights: Array) -> Array:
        """Return the force's slopes over stiffness and rest length, (..., 2) (nio.md §4.6)."""
        squeeze = self.rest_length - heights
        by_stiffness = sigmoid(squeeze, self.gain) * squeeze
        return np.stack([by_stiffness, -self.force_by_height(heights)], axis=-1)
