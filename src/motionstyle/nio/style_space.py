"""θ in coordinates that suit an optimiser: log α, the rest by a usual size, with bounds."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.layout import JOINT_COORDINATES
from motionstyle.dynamics.passive import LARGEST_DAMPING, LARGEST_STIFFNESS
from motionstyle.nio.derivatives import JOINTS, SIZE
from motionstyle.spacetime.style import Style

Array = NDArray[np.float64]

LARGEST_SHOE_STIFFNESS, LARGEST_SHOE_LENGTH = 1e5, 0.05  # N/m, m (nio.md §9)
REST_MARGIN_RAD = 0.3  # how far outside a joint's range its spring may rest
UNITS = (1.0, 50.0, 50.0, 3.0, 0.2)  # of log α, k_s1, k_s2, k_d, q̄
SHOE_UNITS = (1e3, 5e-4)  # small: X_T's root residual follows a shoe's force at once


@dataclass(frozen=True)
class StyleSpace:
    """Scaled coordinates y of θ, and their bounds.

    Attributes
    ----------
    unit, low, high : (147,), of the unscaled coordinates (log α, k_s1, …).
    """

    unit: Array
    low: Array
    high: Array

    @staticmethod
    def of(ranges: Array, least_preference: float, largest_preference: float) -> StyleSpace:
        """Return the space for joint ranges (35, 2), rad.

        Parameters
        ----------
        least_preference, largest_preference : bounds of 29 α: 1 is an even share.
        """
        low, high = ranges[JOINT_COORDINATES].T
        none = np.zeros(JOINTS)
        stiff = np.full(JOINTS, LARGEST_STIFFNESS)
        return StyleSpace(
            unit=np.concatenate([np.repeat(UNITS, JOINTS), SHOE_UNITS]),
            low=np.concatenate(
                [none + np.log(least_preference / JOINTS), none, none, none,
                 low - REST_MARGIN_RAD, [0.0, 0.0]]
            ),
            high=np.concatenate(
                [none + np.log(largest_preference / JOINTS), stiff, stiff,
                 none + LARGEST_DAMPING, high + REST_MARGIN_RAD,
                 [LARGEST_SHOE_STIFFNESS, LARGEST_SHOE_LENGTH]]
            ),
        )  # fmt: skip

    def keeping_shoes(self, style: Style) -> StyleSpace:
        """Return the space of styles that have the shoes of one."""
        shoes = style.vector()[-2:]
        return replace(
            self,
            low=np.concatenate([self.low[:-2], shoes]),
            high=np.concatenate([self.high[:-2], shoes]),
        )

    def coordinates(self, style: Style) -> Array:
        """Return y of a style, moved inside the bounds, (147,)."""
        vector = style.vector()
        vector[:JOINTS] = np.log(np.maximum(vector[:JOINTS], 1e-300))
        return np.clip(vector, self.low, self.high) / self.unit

    def style(self, coordinates: Array, like: Style) -> Style:
        """Return the style at y, its α scaled to sum 1."""
        vector = np.clip(coordinates * self.unit, self.low, self.high)
        share = np.exp(vector[:JOINTS])
        vector[:JOINTS] = share / share.sum()
        return like.with_vector(vector)

    def chain(self, style: Style) -> Array:
        """Return ∂θ/∂y at a style, (147, 147)."""
        found = np.zeros((SIZE, SIZE))
        share = style.preferences
        found[:JOINTS, :JOINTS] = np.diag(share) - np.outer(share, share)
        rest = np.arange(JOINTS, SIZE)
        found[rest, rest] = 1.0
        return found * self.unit

    def room(self, coordinates: Array) -> tuple[Array, Array]:
        """Return how far y may move down (≤ 0) and up (≥ 0), (147,) each."""
        return self.low / self.unit - coordinates, self.high / self.unit - coordinates
