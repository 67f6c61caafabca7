"""The ground of an adaptation task: steps and obstacles across the direction of travel.

Height h(u) = Σ Δ_k σ((u − u_k)/w) with u the distance along the direction of travel and σ the
logistic function: edges are rounded over some centimetres, so that h is smooth.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
EDGE_M = 0.012


@dataclass(frozen=True)
class Surface:
    """Edges at distances `places` (m) with rises (m), along `direction` (x, z) from `origin`."""

    places: tuple[float, ...]
    rises: tuple[float, ...]
    origin: tuple[float, float]
    direction: tuple[float, float]

    def along(self, points: Array) -> Array:
        """Return u of points (…, 3)."""
        x, z = points[..., 0] - self.origin[0], points[..., 2] - self.origin[1]
        return x * self.direction[0] + z * self.direction[1]

    def height_at(self, u: Array) -> Array:
        """Return the height (m) at distances u."""
        total = np.zeros_like(u, dtype=float)
        for place, rise in zip(self.places, self.rises, strict=True):
            total += rise / (1 + np.exp(-np.clip((u - place) / EDGE_M, -60, 60)))
        return total

    def heights(self, points: Array) -> Array:
        """Return the height (m) of the ground under points (…, 3)."""
        return self.height_at(self.along(points))

    def symbolic(self, points: ca.SX) -> ca.SX:
        """Return the heights under points (3, P) as a row, for CasADi."""
        u = (points[0, :] - self.origin[0]) * self.direction[0]
        u += (points[2, :] - self.origin[1]) * self.direction[1]
        total = ca.SX.zeros(1, points.shape[1])
        for place, rise in zip(self.places, self.rises, strict=True):
            # tanh does not overflow where the logistic function's exponential does
            total += rise * (1 + ca.tanh((u - place) / (2 * EDGE_M))) / 2
        return total
