"""Subspaces of leg segments (paper §4.1): principal components, standardised and invertible.

a = Λ^(−1/2) Uᵀ (y − ȳ) and y = ȳ + U Λ^(1/2) a, with y (175) rad, U (175, k) and Λ the variances.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError
from motionstyle.similarity.features import LEG_DIMENSION

Array = NDArray[np.float64]
FEWEST = 3


@dataclass(frozen=True)
class LegSpace:
    """Mean (175) rad, axes (175, k), deviations (k,) rad along them, and all variances (rad²)."""

    mean: Array
    axes: Array
    deviations: Array
    variances: Array

    @property
    def size(self) -> int:
        """Number of axes kept."""
        return len(self.deviations)

    def standardise(self, vectors: Array, count: int) -> Array:
        """Return the first `count` standardised components of vectors (…, 175), (…, count)."""
        return (vectors - self.mean) @ self.axes[:, :count] / self.deviations[:count]

    def restore(self, components: Array) -> Array:
        """Return angles (…, 175) of standardised components (…, count)."""
        count = components.shape[-1]
        return self.mean + (components * self.deviations[:count]) @ self.axes[:, :count].T

    def cumulative_variance(self) -> Array:
        """Return the share of variance in the first 1, 2, … 175 components."""
        full = np.zeros(LEG_DIMENSION)
        full[: len(self.variances)] = self.variances
        return np.cumsum(full) / full.sum()


def fit_leg_space(vectors: Array, leg: str) -> LegSpace:
    """Return the principal components of leg segments (N, 175).

    Raises
    ------
    MotionStyleError
        If there are fewer than three segments, or all of them are equal.
    """
    if len(vectors) < FEWEST:
        raise MotionStyleError(
            f"{leg}: {len(vectors)} leg segments, at least {FEWEST} are needed for a subspace; "
            "mark more clips with contacts as `similarity` in the sheet"
        )
    mean = vectors.mean(axis=0)
    _, singular, axes = np.linalg.svd(vectors - mean, full_matrices=False)
    # a fixed sign, so that the same data give the same components everywhere
    signs = np.sign(axes[np.arange(len(axes)), np.abs(axes).argmax(axis=1)])
    variances = singular**2 / (len(vectors) - 1)
    kept = variances > 1e-12 * variances[0]
    if variances[0] <= 0 or not kept.any():
        raise MotionStyleError(f"{leg}: all leg segments are equal, they span no subspace")
    return LegSpace(mean, (axes * signs[:, None])[kept].T, np.sqrt(variances[kept]), variances)
