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


def solve(factor: Array, right: Array) -> Array:
    """Return A⁻¹ b from the Cholesky factor of A, in the shape of b."""
    found, info = dpbtrs(factor, right.ravel(), lower=1)
    if info:
        raise LinAlgError(f"banded solve failed with flag {info}")
    return found.reshape(right.shape)


def assemble_hessian(basis: SplineBasis, hessians: Array) -> BandedHessian:
    """Return Σ_t Φ_tᵀ H_t Φ_t of symmetric H (F, 3n, 3n) over (q, q̇, q̈)."""
    frames, wide = hessians.shape[:2]
    n = wide // 3
    turned = np.ascontiguousarray(basis.weights.swapaxes(1, 2))  # (F, 4, 3)
    half = turned @ hessians.reshape(frames, 3, n * wide)  # (F, 4, n·3n)
    half = half.reshape(frames, 4 * n, 3, n).swapaxes(1, 2).reshape(frames, 3, 4 * n * n)
    whole = (turned @ half).reshape(frames, 4, 4, n, n)  # (F, c', c, a, b)
    whole = whole.transpose(0, 1, 4, 2, 3).reshape(frames, 4 * n, 4 * n)
    controls = basis.controls
    height = 8 * n
    store = np.zeros(height * controls * n)
    step = store.itemsize
    for t, first in enumerate(basis.first):
        view = as_strided(
            store[height * first * n :], (4 * n, 4 * n), (step, step * (height - 1)), writeable=True
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


def spread(basis: SplineBasis, controls: Array) -> Array:
    """Return u = (q, q̇, q̈), (F, 3n), of control points (K, n)."""
    return np.concatenate(basis.evaluate(controls), axis=1)
