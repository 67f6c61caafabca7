"""Uniform cubic B-splines in time, and the banded normal equations they lead to.

A motion of F frames is K control points of 35 coordinates; every frame depends on four neighbouring
control points, so that sums of squares over frames have banded normal equations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SplineBasis:
    """Values and derivatives of the four B-splines alive at each frame.

    first : index of the first of the four control points, (F,). weights : their values, first
    and second derivatives, (F, 3, 4), in 1, 1/s and 1/s². controls : number of control points K.
    """

    first: NDArray[np.int64]
    weights: Array
    controls: int

    @staticmethod
    def uniform(frames: int, rate_hz: float, frames_per_knot: float) -> SplineBasis:
        """Return the basis for frames at `rate_hz` with a knot every `frames_per_knot` frames."""
        place = np.arange(frames) / frames_per_knot
        spans = max(1, int(np.ceil(place[-1] - 1e-9)))
        first = np.minimum(np.floor(place + 1e-9).astype(np.int64), spans - 1)
        u = place - first
        per_second = rate_hz / frames_per_knot
        values = [(1 - u) ** 3, 3 * u**3 - 6 * u**2 + 4, -3 * u**3 + 3 * u**2 + 3 * u + 1, u**3]
        slopes = [-3 * (1 - u) ** 2, 9 * u**2 - 12 * u, -9 * u**2 + 6 * u + 3, 3 * u**2]
        bends = [6 * (1 - u), 18 * u - 12, -18 * u + 6, 6 * u]
        weights = np.stack(
            [
                np.stack(values, axis=1) / 6,
                np.stack(slopes, axis=1) / 6 * per_second,
                np.stack(bends, axis=1) / 6 * per_second**2,
            ],
            axis=1,
        )
        return SplineBasis(first, weights, spans + 3)

    @property
    def end_controls(self) -> int:
        """Number of control points at each end that decide the first and last poses."""
        return 3 if np.isclose(self.weights[-1, 0, 0], 0.0) else 4  # the last frame on a knot

    def pairs(self) -> Iterator[tuple[int, int, Array]]:
        """Yield c, e and the products (F, 3) of the weights of control points c and c + e.

        c counts from each frame's first; all pairs of the four with e ≥ 0, for q, q̇, q̈.
        """
        for c in range(4):
            for e in range(4 - c):
                yield c, e, self.weights[:, :, c] * self.weights[:, :, c + e]

    def evaluate(self, controls: Array) -> tuple[Array, Array, Array]:
        """Return q, q̇, q̈, each (F, n), of control points (K, n)."""
        local = controls[self.first[:, None] + np.arange(4)]
        values = np.einsum("fdc,fcn->dfn", self.weights, local)
        return values[0], values[1], values[2]

    def fit(self, coordinates: Array) -> Array:
        """Return the control points (K, n) whose values come closest to coordinates (F, n)."""
        design = np.zeros((len(coordinates), self.controls))
        rows = np.arange(len(coordinates))[:, None]
        design[rows, self.first[:, None] + np.arange(4)] = self.weights[:, 0]
        bend = np.diff(np.eye(self.controls), 3, axis=0) * 1e-4  # settles what no frame sees
        stacked = np.concatenate([design, bend])
        wanted = np.concatenate([coordinates, np.zeros((len(bend), coordinates.shape[1]))])
        return np.linalg.lstsq(stacked, wanted, rcond=None)[0]


@dataclass(frozen=True)
class Border:
    """S variables beside the control points, such as the shoes.

    cross : how they meet the control points in the Hessian, (K·n, S). hessian : (S, S).
    gradient : (S,). bounds : of their step, two of (S,).
    """

    cross: Array
    hessian: Array
    gradient: Array
    bounds: tuple[Array, Array]


@dataclass
class BandedSystem:
    """Normal equations Σ_t Φ_tᵀ H_t Φ_t x = −Σ_t Φ_tᵀ g_t over control points of n coordinates."""

    basis: SplineBasis
    size: int

    def assemble(self, hessians: Array, gradients: Array) -> tuple[Array, Array]:
        """Return the upper band and the gradient over control points.

        Parameters
        ----------
        hessians : per frame over (q, q̇, q̈), (F, 3n, 3n). gradients : (F, 3n).
        """
        basis, n = self.basis, self.size
        frames = len(gradients)
        split = hessians.reshape(frames, 3, n, 3, n)
        half = np.einsum("fdanb,fdc->fcanb", split.swapaxes(2, 2), basis.weights, optimize=True)
        whole = np.einsum("fcanb,fnk->fcakb", half, basis.weights, optimize=True)
        blocks = np.zeros((basis.controls - 3, 4 * n, 4 * n))
        np.add.at(blocks, basis.first, whole.reshape(frames, 4 * n, 4 * n))
        width = 4 * n - 1
        band = np.zeros((width + 1, basis.controls * n))
        rows, columns = np.triu_indices(4 * n)
        for span, block in enumerate(blocks):
            band[width + rows - columns, columns + span * n] += block[rows, columns]
        local = np.einsum("fdn,fdc->fcn", gradients.reshape(frames, 3, n), basis.weights)
        gradient = np.zeros((basis.controls, n))
        for c in range(4):
            np.add.at(gradient, basis.first + c, local[:, c])
        return band, gradient

    def gather(self, cross: Array) -> Array:
        """Return per-frame columns over (q, q̇, q̈), (F, 3n, S), over control points, (K·n, S)."""
        basis, n, columns = self.basis, self.size, cross.shape[2]
        local = np.einsum("fdns,fdc->fcns", cross.reshape(len(cross), 3, n, columns), basis.weights)
        total = np.zeros((basis.controls, n, columns))
        for c in range(4):
            np.add.at(total, basis.first + c, local[:, c])
        return total.reshape(-1, columns)

    def solve(self, band: Array, gradient: Array, damping: Array) -> Array:
        """Return −(H + diag(damping))⁻¹ g over control points (K, n)."""
        return self._factored(band, damping)(-gradient.ravel()).reshape(gradient.shape)

    def solve_bordered(
        self, band: Array, gradient: Array, damping: Array, border: Border
    ) -> tuple[Array, Array]:
        """Return the step over control points (K, n) and over S further variables (S,).

        The further variables are eliminated by their Schur complement and kept within bounds;
        the control points answer to where that leaves them.
        """
        solve = self._factored(band, damping)
        step, answer = solve(-gradient.ravel()), solve(border.cross)
        own = border.hessian - border.cross.T @ answer
        further = np.linalg.solve(own, -border.gradient - border.cross.T @ step)
        further = np.clip(further, *border.bounds)
        return (step - answer @ further).reshape(gradient.shape), further

    def _factored(self, band: Array, damping: Array) -> Callable[[Array], Array]:
        """Return the solver of the damped system for right-hand sides."""
        damped = band.copy()
        damped[-1] += damping
        factor = cholesky_banded(damped, check_finite=False)
        return lambda right: cho_solve_banded((factor, False), right, check_finite=False)
