"""The sums over frames that a Newton step is made of: in C, or in NumPy where no compiler is.

A frame's matrices over u = (q, q̇, q̈) meet the control points through the four splines alive at it,
so that what they sum up to is blocks between each control point and itself and the next three.

λ is eliminated by Cholesky factors, never by an inverse: what is left, H − C A⁻¹ Cᵀ, is a small
difference of large numbers (stiff root rows that λ nearly balances, 10¹⁰, against valleys of
10⁻³), and only as (L⁻¹Cᵀ)ᵀ(L⁻¹Cᵀ) are its errors those of a slightly changed matrix. With inverses
Newton's steps were wrong by percents along the valleys, and convergence near an optimum linear.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from motionstyle.spacetime.banded import laid_out
from motionstyle.spacetime.kernels import FORCES, HIGH, SIZE, WIDE, Whole, compiled_kernels, plain
from motionstyle.spacetime.splines import SplineBasis

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ForceBlocks:
    """λ's parts of the Newton matrix.

    At δ: A = (1 + δ) inner + diag(diagonal + δ), Cᵀ = (1 + δ) mixed + (mixed_place, 0, 0).

    inner : (F, 32, 32). diagonal : (F, 32). mixed : λ × u, (F, 32, 105). mixed_place : λ × q,
    (F, 32, 35), as forces enter the dynamics by place alone.
    """

    inner: Array
    diagonal: Array
    mixed: Array
    mixed_place: Array


@dataclass(frozen=True)
class Curvature:
    """Symmetric second derivatives over u = (q, q̇, q̈), as the few numbers that are not 0.

    numbers : (F, n), at `pattern`, rows and columns (n,), of one triangle of (105, 105). Those
    over q alone do not count: they are in `place`, whole, (F, 35, 35). concave : what springs add
    to the diagonal of `place` where it is below 0, else 0, (F, 35).
    """

    numbers: Array
    pattern: tuple[Whole, Whole]
    place: Array
    concave: Array

    def dense(self) -> Array:
        """Return them as matrices (F, 105, 105)."""
        rows, columns = self.pattern
        found = np.zeros((len(self.numbers), 3 * SIZE, 3 * SIZE))
        found[:, rows, columns] = found[:, columns, rows] = self.numbers
        found[:, :SIZE, :SIZE] = self.place
        return found


class FrameSums:
    """Sums over the frames of one basis.

    Blocks are (K, 4, 36, 40): at [k, e, :35, :35] the block of control points k and k + e.

    Attributes
    ----------
    library : the compiled loops, or None for NumPy.
    count, at : how many coefficients may push (F,), and their indices, first in each row (F, 32).
    """

    def __init__(
        self, basis: SplineBasis, bearing: NDArray[np.bool_], *, compiled: bool = True
    ) -> None:
        self.basis = basis
        self.library = compiled_kernels() if compiled else None
        self.count = bearing.sum(axis=1).astype(np.intp)
        # Stable, so that those that bear come first and in order.
        self.at = np.argsort(~bearing, axis=1, kind="stable").astype(np.intp)
        self.first = basis.first.astype(np.intp)
        self.weights = np.ascontiguousarray(basis.weights)

    def nothing(self) -> Array:
        """Return blocks of zeros."""
        return np.zeros((self.basis.controls, 4, HIGH, WIDE))

    def add_products(self, matrices: Array, blocks: Array) -> None:
        """Add Σ_t Φᵀ Mᵀ M Φ of M (F, rows ≤ 35, 105), or (F, rows ≤ 35, 35) over q alone."""
        frames, rows, wide = matrices.shape
        if self.library is not None:
            self.library.add_products(
                *plain(frames, self.first, self.weights, rows, wide, matrices, blocks)
            )
            return
        for t in range(frames):
            self._add_gram(t, matrices[t], 1.0, blocks)

    def add_curvature(self, curvature: Curvature, blocks: Array) -> None:
        """Add Σ_t Φᵀ H Φ of symmetric H (F, 105, 105)."""
        if self.library is not None:
            parts, (rows, columns) = curvature, curvature.pattern
            sizes = plain(len(parts.numbers), self.first, self.weights, len(rows))
            self.library.add_curvature(
                *sizes, *plain(rows, columns, parts.numbers, parts.place, blocks)
            )
            return
        for t, hessian in enumerate(curvature.dense()):
            w, split = self.weights[t], hessian.reshape(3, SIZE, 3, SIZE)
            local = np.einsum("dc,danb,nk->ckab", w, split, w, optimize=True)
            self._add_local(t, local, blocks)

    def diagonals(self, values: Array) -> Array:
        """Return the diagonals (K, 4, 35) of the blocks Σ_t Φᵀ diag(d) Φ of d (F, 35) over q."""
        found = np.zeros((self.basis.controls, 4, SIZE))
        for c, e, products in self.basis.pairs():
            np.add.at(found[:, e], self.first + c, products[:, :1] * values)
        return found

    def banded(self, blocks: Array, shift: Array, added: Array) -> Array:
        """Return a matrix's blocks as a lower band (140, K·35), see `banded`.

        shift : added to each block's diagonal, (K, 4). added : to the whole's, (K·35,).
        """
        if self.library is None:
            band = laid_out(blocks[:, :, :SIZE, :SIZE], shift)
            band[0] += added
            return band
        store = np.empty((len(added), 4 * SIZE))
        self.library.lay_out(*plain(len(blocks), blocks, shift, added, store))
        return store.T

    def eliminate(self, blocks: Array, delta: float, forces: ForceBlocks) -> Eliminated:
        """Take λ out of a Hessian's blocks at δ, in place, and return how.

        Raises
        ------
        FloatingPointError
            If λ's own block is not positive definite, which means it is not finite.
        """
        frames = len(self.count)
        lower = np.zeros((frames, FORCES, FORCES))
        half = np.zeros((frames, FORCES, 3 * SIZE))
        if self.library is not None:
            failed = self.library.eliminate(
                *plain(frames, self.first, self.weights, self.count, self.at, delta),
                *plain(forces.inner, forces.diagonal, forces.mixed, forces.mixed_place),
                *plain(lower, half, blocks),
            )
        else:
            failed = self._eliminate(blocks, delta, forces, lower, half)
        if failed:
            raise FloatingPointError("the Newton matrix has entries that are not finite")
        return Eliminated(self, lower, half)

    def _eliminate(
        self, blocks: Array, delta: float, forces: ForceBlocks, lower: Array, half: Array
    ) -> bool:
        for t, n in enumerate(self.count):
            at = self.at[t, :n]
            own = (1 + delta) * forces.inner[t][np.ix_(at, at)]
            own += np.diag(forces.diagonal[t, at] + delta)
            cross = (1 + delta) * forces.mixed[t, at]
            cross[:, :SIZE] += forces.mixed_place[t, at]
            try:
                lower[t, :n, :n] = np.linalg.cholesky(own)
            except np.linalg.LinAlgError:
                return True
            if n:
                half[t, at] = _triangular(lower[t, :n, :n], cross)
            self._add_gram(t, half[t, at], -1.0, blocks)
        return not np.isfinite(lower).all()

    def _add_gram(self, frame: int, matrix: Array, sign: float, blocks: Array) -> None:
        depth = matrix.shape[1] // SIZE
        split = matrix.reshape(len(matrix), depth, SIZE)
        rows = np.einsum("dc,rda->cra", self.weights[frame, :depth], split)
        self._add_local(frame, sign * (rows.swapaxes(1, 2)[:, None] @ rows[None]), blocks)

    def _add_local(self, frame: int, local: Array, blocks: Array) -> None:
        for c in range(4):
            for e in range(4 - c):
                blocks[self.first[frame] + c, e, :SIZE, :SIZE] += local[c, c + e]


@dataclass(frozen=True)
class Eliminated:
    """The λ blocks A = L Lᵀ and L⁻¹Cᵀ, by frame.

    Attributes
    ----------
    lower : L of the coefficients that bear, in the first rows and columns, (F, 32, 32).
    half : L⁻¹Cᵀ, (F, 32, 105), 0 where nothing bears.
    """

    sums: FrameSums
    lower: Array
    half: Array

    def forward(self, right: Array) -> Array:
        """Return L⁻¹ b of b (F, 32, k)."""
        return self._solved(right, 0)

    def backward(self, right: Array) -> Array:
        """Return L⁻ᵀ b of b (F, 32, k)."""
        return self._solved(right, 1)

    def _solved(self, right: Array, transposed: int) -> Array:
        sums, found = self.sums, np.zeros(right.shape)
        if sums.library is not None:
            sums.library.substitute(
                *plain(len(right), sums.count, sums.at, self.lower, right.shape[2], transposed),
                *plain(right, found),
            )
            return found
        for t, n in enumerate(sums.count):
            at, lower = sums.at[t, :n], self.lower[t, :n, :n]
            if n:
                found[t, at] = _triangular(lower, right[t, at], transposed)
        return found


def _triangular(lower: Array, right: Array, transposed: int = 0) -> Array:
    return solve_triangular(lower, right, transposed, lower=True, check_finite=False)
