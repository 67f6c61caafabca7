"""Normal equations of splines as one banded matrix, assembled by blocks and factored by LAPACK."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray
from scipy.linalg import LinAlgError
from scipy.linalg.lapack import dpbtrf, dpbtrs

from motionstyle.spacetime.splines import SplineBasis

Array = NDArray[np.float64]


def factor(band: Array) -> Array | None:
    """Return the Cholesky factor of a lower band, in its place; None if it is not positive."""
    found, info = dpbtrf(band, lower=1, overwrite_ab=1)
    return None if info else found


def solve(factor: Array, right: Array, columns: bool = False) -> Array:
    """Return A⁻¹ b from the Cholesky factor of A, in the shape of b.

    columns : b is (N, k), one right-hand side a column; else its numbers are one side in order.
    """
    found, info = dpbtrs(factor, right if columns else right.ravel(), lower=1)
    if info:
        raise LinAlgError(f"banded solve failed with flag {info}")
    return found.reshape(right.shape)


def laid_out(blocks: Array, shift: Array) -> Array:
    """Return blocks (K, 4, n, n) of control points k and k + e as a lower band, (4n, K·n).

    Half-bandwidth 4n − 1, in Fortran order, as LAPACK wants it. shift (K, 4) is added to each
    block's diagonal.

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
    as_strided(store, (controls, n, n), strides)[...] = np.triu(blocks[:, 0])
    for e in range(1, 4):
        as_strided(store[e * n :], (controls, n, n), strides)[...] = blocks[:, e]
    band = store.reshape(controls * n, height).T
    band[::n] += np.repeat(shift, n, axis=0).T
    return band


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
