"""Elimination of the cone coefficients λ, frame by frame, from a Newton matrix.

By Cholesky factors, never by an inverse: what is left, H − C A⁻¹ Cᵀ, is a small difference of large
numbers (stiff root rows that λ nearly balances, 10¹⁰, against valleys of 10⁻³), and only as
(L⁻¹Cᵀ)ᵀ(L⁻¹Cᵀ) are its errors those of a slightly changed matrix. With inverses Newton's steps were
wrong by percents along the valleys, and convergence near an optimum linear.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import dgemm, dtrsm
from scipy.linalg.lapack import dpotrf

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Eliminated:
    """The λ blocks A = L Lᵀ and L⁻¹Cᵀ, by frame.

    Attributes
    ----------
    bearing_at : indices of the coefficients that count, by frame. lower : L of those, by frame.
    half : L⁻¹Cᵀ, (F, 32, 105), 0 where nothing bears.
    """

    bearing_at: Sequence[NDArray[np.int64]]
    lower: Sequence[Array]
    half: Array

    def forward(self, right: Array) -> Array:
        """Return L⁻¹ b of b (F, 32, k)."""
        return self._solved(right, 0)

    def backward(self, right: Array) -> Array:
        """Return L⁻ᵀ b of b (F, 32, k)."""
        return self._solved(right, 1)

    def _solved(self, right: Array, transposed: int) -> Array:
        found = np.zeros_like(right)
        for t, (at, lower) in enumerate(zip(self.bearing_at, self.lower, strict=True)):
            if len(at):
                found[t, at] = dtrsm(1.0, lower, right[t, at], lower=1, trans_a=transposed)
        return found


def eliminate(
    hessians: Iterable[Array],
    inner: Array,
    cross: Array,
    bearing_at: Sequence[NDArray[np.int64]],
    left: Callable[[int, Array], None] | None = None,
) -> Eliminated:
    """Take λ out of a Hessian, in place, and return how.

    Parameters
    ----------
    hessians : over u, F of (105, 105); each becomes H − C A⁻¹ Cᵀ, in place. An array, or made one
        by one in the same memory.
    inner : A over λ, (F, 32, 32), positive definite. cross : C, u × λ, (F, 105, 32); fastest if u
        runs along memory.
    left : told each frame and what its Hessian became, before the next is made.

    Raises
    ------
    FloatingPointError
        If an inner block is not positive definite, which means it is not finite.
    """
    half = np.zeros((len(cross), cross.shape[2], cross.shape[1]))
    lowers = []
    for t, (at, hessian) in enumerate(zip(bearing_at, hessians, strict=True)):
        lowers.append(_eliminate_frame(hessian, inner[t], cross[t], at, half[t]))
        if left:
            left(t, hessian)
    return Eliminated(bearing_at, lowers, half)


def _eliminate_frame(
    hessian: Array, inner: Array, cross: Array, at: NDArray[np.int64], half: Array
) -> Array:
    """Take one frame's λ out of its Hessian, fill in L⁻¹Cᵀ (32, 105), and return L."""
    if not len(at):
        return np.zeros((0, 0))
    lower, info = dpotrf(inner[at[:, None], at].T, lower=1, overwrite_a=1)
    if info or not np.isfinite(lower[-1, -1]):
        raise FloatingPointError("the Newton matrix has entries that are not finite")
    # C L⁻ᵀ, in place: as BLAS sees it the rows that were picked are columns.
    found = dtrsm(1.0, lower, cross.T[at].T, side=1, lower=1, trans_a=1, overwrite_b=1)
    dgemm(-1.0, found, found, beta=1.0, c=hessian.T, trans_b=1, overwrite_c=1)
    half[at] = found.T
    return lower
