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


def assemble_hessian(basis: SplineBasis, hessians: Array) -> BandedHessian:
    """Return Σ_t Φ_tᵀ H_t Φ_t of symmetric H (F, 3n, 3n) over (q, q̇, q̈)."""
    frames, wide = hessians.shape[:2]
    n = wide // 3
    pairs = basis.weights[:, :, None, :, None] * basis.weights[:, None, :, None, :]
    pairs = pairs.reshape(frames, 9, 16).swapaxes(1, 2)
    blocks = hessians.reshape(frames, 3, n, 3, n).transpose(0, 1, 3, 2, 4).reshape(frames, 9, n * n)
    whole = (pairs @ blocks).reshape(frames, 4, 4, n, n)  # (F, c, c', a, b)
    controls = basis.controls
    # Columns in store are 8n long; steps of 8n − 1 lay the blocks out as a lower band. Each goes to
    # its mirror place, the same by symmetry, where the inner loop runs along memory.
    height = 8 * n
    store = np.zeros(height * controls * n)
    step = store.itemsize
    down, along = step, step * (height - 1)
    for t, first in enumerate(basis.first):
        view = as_strided(
            store[height * first * n :], (4, 4, n, n), (n * along, n * down, along, down)
        )
        view += whole[t]
    band = store.reshape(controls * n, height)[:, : 4 * n].T
    return BandedHessian(np.asfortranarray(band), n)


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
