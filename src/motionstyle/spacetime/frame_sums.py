"""The sums over frames that a Newton step is made of: in C, or in NumPy where no compiler is.

A frame's matrices over u = (q, q̇, q̈) meet the control points through the four splines alive at it,
so that what they sum up to is blocks between each control point and itself and the next three. As
BLAS calls frame by frame these sums took half of a solve; in C (`frame_sums.c`) a fifth of that.

λ is eliminated by Cholesky factors, never by an inverse: what is left, H − C A⁻¹ Cᵀ, is a small
difference of large numbers (stiff root rows that λ nearly balances, 10¹⁰, against valleys of
10⁻³), and only as (L⁻¹Cᵀ)ᵀ(L⁻¹Cᵀ) are its errors those of a slightly changed matrix. With inverses
Newton's steps were wrong by percents along the valleys, and convergence near an optimum linear.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from motionstyle.cache import cache_folder
from motionstyle.dynamics.codegen import compile_source, find_compiler
from motionstyle.spacetime.splines import SplineBasis

Array = NDArray[np.float64]
Whole = NDArray[np.intp]
SIZE, HIGH, WIDE = 35, 36, 40  # of a block, and of the memory it lies in: whole vectors
FORCES = 32
FLAGS = ("-O3", "-march=native", "-fno-math-errno", "-Wno-psabi", "-fPIC", "-shared")


@lru_cache(maxsize=1)
def compiled_kernels() -> ctypes.CDLL | None:
    """Return the compiled sums, built on first use, or None where there is no compiler."""
    compiler = find_compiler()
    if compiler is None:
        return None
    source = Path(__file__).with_suffix(".c").read_text(encoding="utf-8")
    return ctypes.CDLL(
        str(compile_source(source, FLAGS, compiler, cache_folder(), lambda _line: None))
    )


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
                *_plain(len(right), sums.count, sums.at, self.lower, right.shape[2], transposed),
                *_plain(right, found),
            )
            return found
        for t, n in enumerate(sums.count):
            at, lower = sums.at[t, :n], self.lower[t, :n, :n]
            if n:
                found[t, at] = _triangular(lower, right[t, at], transposed)
        return found


@dataclass(frozen=True)
class FrameSums:
    """Sums over the frames of one basis; the coefficients in `bearing` (F, 32) may push.

    Blocks are (K, 4, 36, 40): at [k, e, :35, :35] the block of control points k and k + e.
    """

    basis: SplineBasis
    bearing: NDArray[np.bool_]
    library: ctypes.CDLL | None = field(default_factory=compiled_kernels)

    def __post_init__(self) -> None:
        at = np.zeros(self.bearing.shape, dtype=np.intp)
        for t, row in enumerate(self.bearing):
            at[t, : row.sum()] = np.flatnonzero(row)
        for name, value in (
            ("at", at),
            ("count", self.bearing.sum(axis=1).astype(np.intp)),
            ("first", self.basis.first.astype(np.intp)),
            ("weights", np.ascontiguousarray(self.basis.weights)),
        ):
            object.__setattr__(self, name, value)

    at: Whole = field(init=False, repr=False)
    count: Whole = field(init=False, repr=False)
    first: Whole = field(init=False, repr=False)
    weights: Array = field(init=False, repr=False)

    def nothing(self) -> Array:
        """Return blocks of zeros."""
        return np.zeros((self.basis.controls, 4, HIGH, WIDE))

    def add_products(self, matrices: Array, blocks: Array) -> None:
        """Add Σ_t Φᵀ Mᵀ M Φ of M (F, rows ≤ 35, 105), or (F, rows ≤ 35, 35) over q alone."""
        frames, rows, wide = matrices.shape
        if self.library is not None:
            self.library.add_products(
                *_plain(frames, self.first, self.weights, rows, wide, matrices, blocks)
            )
            return
        for t in range(frames):
            self._add_gram(t, matrices[t], 1.0, blocks)

    def add_matrices(self, hessians: Array, blocks: Array) -> None:
        """Add Σ_t Φᵀ H Φ of symmetric H (F, 105, 105)."""
        if self.library is not None:
            self.library.add_matrices(
                *_plain(len(hessians), self.first, self.weights, hessians, blocks)
            )
            return
        for t, hessian in enumerate(hessians):
            w, split = self.weights[t], hessian.reshape(3, SIZE, 3, SIZE)
            local = np.einsum("dc,danb,nk->ckab", w, split, w, optimize=True)
            self._add_local(t, local, blocks)

    def eliminate(
        self,
        blocks: Array,
        delta: float,
        inner: tuple[Array, Array],
        mixed: tuple[Array, Array],
    ) -> Eliminated:
        """Take λ out of a Hessian's blocks, in place, and return how.

        Parameters
        ----------
        delta : A = (1 + δ) Aₘ + diag(d + δ), C = (1 + δ) Cₘ + C_q.
        inner : Aₘ over λ, (F, 32, 32), and d (F, 32). mixed : Cₘ, λ × u, (F, 32, 105), and C_q,
            λ × q, (F, 32, 35).

        Raises
        ------
        FloatingPointError
            If an inner block is not positive definite, which means it is not finite.
        """
        frames = len(self.bearing)
        lower = np.zeros((frames, FORCES, FORCES))
        half = np.zeros((frames, FORCES, 3 * SIZE))
        if self.library is not None:
            failed = self.library.eliminate(
                *_plain(frames, self.first, self.weights, self.count, self.at, delta),
                *_plain(*inner, *mixed, lower, half, blocks),
            )
        else:
            failed = self._eliminate(blocks, delta, inner, mixed, lower, half)
        if failed:
            raise FloatingPointError("the Newton matrix has entries that are not finite")
        return Eliminated(self, lower, half)

    def _eliminate(
        self,
        blocks: Array,
        delta: float,
        inner: tuple[Array, Array],
        mixed: tuple[Array, Array],
        lower: Array,
        half: Array,
    ) -> bool:
        for t, n in enumerate(self.count):
            at = self.at[t, :n]
            own = (1 + delta) * inner[0][t][np.ix_(at, at)] + np.diag(inner[1][t, at] + delta)
            cross = (1 + delta) * mixed[0][t, at]
            cross[:, :SIZE] += mixed[1][t, at]
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


def _triangular(lower: Array, right: Array, transposed: int = 0) -> Array:
    return solve_triangular(lower, right, transposed, lower=True, check_finite=False)


def scatter(numbers: Array, places: Whole, to: Array) -> None:
    """Put numbers (F, n) to places (n,) of each frame's matrix of `to` (F, rows, columns)."""
    library = compiled_kernels()
    if library is None:
        to.reshape(len(to), -1)[:, places] = numbers
    else:
        size = to.shape[1] * to.shape[2]
        library.scatter(*_plain(len(to), len(places), size, places, numbers, to))


def _plain(*values: Array | Whole | float | int) -> list[ctypes._SimpleCData]:
    """Return arguments as C takes them; arrays must lie in memory without gaps."""
    plain = []
    for value in values:
        if isinstance(value, np.ndarray):
            if not (value.flags.c_contiguous and value.dtype in (np.float64, np.intp)):
                raise ValueError("arrays for C must be contiguous, of 8-byte numbers")
            plain.append(ctypes.c_void_p(value.ctypes.data))
        elif isinstance(value, float):
            plain.append(ctypes.c_double(value))
        else:
            plain.append(ctypes.c_ssize_t(value))
    return plain
