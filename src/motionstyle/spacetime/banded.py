"""Normal equations of splines as one banded matrix, assembled by blocks and factored by LAPACK."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray
from scipy.linalg import LinAlgError
from scipy.linalg.lapack import dpbtrf, dpbtrs

from motionstyle.spacetime.splines import SplineBasis

Array = NDArray[np.float64]
_LEFT, _RIGHT = np.triu_indices(4)  # pairs of the control points alive at a frame
_STARTS = (0, 4, 7, 9, 10)  # where pairs begin, by the first of the two


@dataclass(frozen=True)
class BandedHessian:
    """A symmetric matrix over control points of n coordinates, half-bandwidth 4n − 1.

    band : lower band as LAPACK wants it, (4n, K·n), Fortran order.
    """

    band: Array
    size: int

    def factor(self, added: Array | float = 0.0) -> Array | None:
        """Return the Cholesky factor of matrix + diag(added), or None if it is not positive."""
        band = self.band.copy(order="F")
        band[0] += added
        factor, info = dpbtrf(band, lower=1, overwrite_ab=1)
        return None if info else factor


def solve(factor: Array, right: Array, columns: bool = False) -> Array:
    """Return A⁻¹ b from the Cholesky factor of A, in the shape of b.

    columns : b is (N, k), one right-hand side a column; else its numbers are one side in order.
    """
    found, info = dpbtrs(factor, right if columns else right.ravel(), lower=1)
    if info:
        raise LinAlgError(f"banded solve failed with flag {info}")
    return found.reshape(right.shape)


class BandAssembly:
    """Adds up Σ_t Φ_tᵀ H_t Φ_t of symmetric H (3n, 3n) over (q, q̇, q̈), frame by frame.

    One frame at a time stays within the processor's cache.
    """

    def __init__(self, basis: SplineBasis, size: int) -> None:
        self.first, self.size = basis.first.tolist(), size
        self._pairs = np.ascontiguousarray(_pair_weights(basis))
        # Of each control point with itself and the next three; all others follow by symmetry.
        self._blocks = np.zeros((basis.controls, 4, size * size))
        self._split = np.empty((3, 3, size, size))
        self._local = np.empty((10, size * size))

    def add(self, frame: int, hessian: Array) -> None:
        """Add a frame's Hessian (3n, 3n)."""
        n, first, local = self.size, self.first[frame], self._local
        self._split[...] = hessian.reshape(3, n, 3, n).swapaxes(1, 2)
        np.matmul(self._pairs[frame], self._split.reshape(9, n * n), out=local)
        for c in range(4):
            self._blocks[first + c, : 4 - c] += local[_STARTS[c] : _STARTS[c + 1]]

    def whole(self) -> BandedHessian:
        """Return the sum."""
        n = self.size
        return BandedHessian(_laid_out(self._blocks.reshape(-1, 4, n, n)), n)


def assemble_hessian(basis: SplineBasis, hessians: Array) -> BandedHessian:
    """Return Σ_t Φ_tᵀ H_t Φ_t of symmetric H (F, 3n, 3n) over (q, q̇, q̈)."""
    assembly = BandAssembly(basis, hessians.shape[1] // 3)
    for t, hessian in enumerate(hessians):
        assembly.add(t, hessian)
    return assembly.whole()


def _pair_weights(basis: SplineBasis) -> Array:
    """Return w_dc w_d'c' of the control points c ≤ c' of a frame, (F, 10, 9)."""
    weights = basis.weights
    left, right = weights[:, :, _LEFT], weights[:, :, _RIGHT]
    products = left[:, :, None] * right[:, None]
    return products.reshape(len(weights), 9, -1).swapaxes(1, 2)


def _laid_out(blocks: Array) -> Array:
    """Return a lower band, (4n, K·n), Fortran order, from blocks (K, 4, n, n).

    blocks : H[k·n + b, (k + e)·n + a] at [k, e, b, a]: by symmetry also what the band holds in
    column k·n + b, where a runs along memory.
    """
    controls, _offsets, n, _n = blocks.shape
    height = 4 * n
    store = np.zeros(height * controls * n)
    # Columns are 4n long, so that steps of 4n − 1 lay blocks out as a band. What is above the
    # diagonal would come to lie in the column before.
    step = store.itemsize
    strides = (step * height * n, step * (height - 1), step)
    blocks[:, 0] = np.tril(blocks[:, 0].swapaxes(1, 2)).swapaxes(1, 2)
    for e in range(4):
        as_strided(store[e * n :], (controls, n, n), strides)[...] = blocks[:, e]
    return store.reshape(controls * n, height).T


def assemble_gradient(basis: SplineBasis, gradients: Array) -> Array:
    """Return Σ_t Φ_tᵀ g_t (K, n) of g (F, 3n)."""
    frames, wide = gradients.shape
    n = wide // 3
    local = basis.weights.swapaxes(1, 2) @ gradients.reshape(frames, 3, n)
    total = np.zeros((basis.controls, n))
    for c in range(4):
        np.add.at(total, basis.first + c, local[:, c])
    return total


def gather(basis: SplineBasis, columns: Array) -> Array:
    """Return Σ_t Φ_tᵀ G_t (K·n, k) of G (F, 3n, k)."""
    frames, wide, k = columns.shape
    n = wide // 3
    return assemble_gradient(basis, columns.reshape(frames, 3, n * k).reshape(frames, -1)).reshape(
        -1, k
    )


def spread(basis: SplineBasis, controls: Array) -> Array:
    """Return u = (q, q̇, q̈), (F, 3n), of control points (K, n)."""
    return np.concatenate(basis.evaluate(controls), axis=1)
