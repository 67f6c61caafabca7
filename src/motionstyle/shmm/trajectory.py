"""The most likely trajectory of a state sequence, in time linear in its length.

Brand & Hertzmann 2000, eqs. (20)–(23) as corrected in style_machines.md §7. Symbols: frames
y_1 … y_T of D coordinates and a latent y_0 before them; occupancies γ (T, N); per state μ, μ̇ (D)
and the precision of [y_t; y_t − y_{t−1}] in blocks [[A, B], [C, D]] with C = Bᵀ.

The system is symmetric, positive definite and block tridiagonal. Its rows are summed over the
states, and γ_t belongs to y_t throughout: the printed (21) shifts the index and, read as one
equation per pair of states, would be solved by least squares with a worse result.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dpotrs

from motionstyle.errors import MotionStyleError

Array = NDArray[np.float64]
CHUNK = 2048  # frames whose blocks are assembled at once


@dataclass(frozen=True)
class PoseStates:
    """Gaussians of [y_t; y_t − y_{t−1}] per state: means (N, 2D), covariances (N, 2D, 2D)."""

    means: Array
    covariances: Array

    @property
    def coordinates(self) -> int:
        """Number of coordinates D."""
        return self.means.shape[1] // 2


@dataclass(frozen=True)
class _Blocks:
    """Per state what eqs. (21)–(23) need, each weighted by γ and summed over states."""

    whole: Array  # A + B + C + D, (N, D, D)
    velocity: Array  # D
    coupling: Array  # C + D
    force: Array  # F, (N, D)
    pull: Array  # E


def _blocks(states: PoseStates) -> _Blocks:
    d = states.coordinates
    precision = np.linalg.inv(states.covariances)
    precision = (precision + np.swapaxes(precision, 1, 2)) / 2
    a, b = precision[:, :d, :d], precision[:, :d, d:]
    c, v = precision[:, d:, :d], precision[:, d:, d:]
    weighted = np.einsum("nab,nb->na", precision, states.means)
    pull = weighted[:, d:]  # E = [C D][μ; μ̇]
    return _Blocks(a + b + c + v, v, c + v, weighted[:, :d] + pull, pull)


def _assembled(occupancy: Array, blocks: _Blocks) -> Iterator[tuple[Array, Array, Array]]:
    """Yield, for frames 0 … T, the diagonal block, the block above it and the right side.

    Eq. (22) at t = 0, (21) between, (23) at t = T.
    """
    frames, states = occupancy.shape
    d = blocks.force.shape[1]
    for first in range(0, frames + 1, CHUNK):
        last = min(first + CHUNK, frames + 1)
        own = np.zeros((last - first, states))
        following = np.zeros((last - first, states))
        own[max(0, 1 - first) :] = occupancy[max(first, 1) - 1 : last - 1]
        following[: min(last, frames) - first] = occupancy[first : min(last, frames)]
        diagonal = own @ blocks.whole.reshape(states, -1)
        diagonal += following @ blocks.velocity.reshape(states, -1)
        above = -(following @ blocks.coupling.reshape(states, -1))
        right = own @ blocks.force - following @ blocks.pull
        shape = (-1, d, d)
        yield from zip(diagonal.reshape(shape), above.reshape(shape), right, strict=True)


def most_likely_trajectory(occupancy: Array, states: PoseStates) -> Array:
    """Return the trajectory y_1 … y_T that maximises eq. (20), (T, D); O(T D³).

    Block Cholesky from the latent first frame to the last, then back.

    Raises
    ------
    MotionStyleError
        If the occupancies do not fit the states, or the system is not positive definite.
    """
    frames, count = occupancy.shape
    if count != len(states.means) or frames == 0:
        raise MotionStyleError(
            f"occupancies of shape {occupancy.shape} do not fit {len(states.means)} states"
        )
    d = states.coordinates
    gains = np.empty((frames + 1, d, d))
    reduced = np.empty((frames + 1, d))
    former: Array | None = None
    for t, (diagonal, above, right) in enumerate(_assembled(occupancy, _blocks(states))):
        if former is None:
            schur, side = diagonal, right
        else:
            schur = diagonal - former.T @ gains[t - 1]
            side = right - former.T @ reduced[t - 1]
        factor, failed = dpotrf(schur, lower=1)
        if failed:
            raise MotionStyleError(f"the trajectory's system is not positive definite at frame {t}")
        gains[t] = dpotrs(factor, above, lower=1)[0]
        reduced[t] = dpotrs(factor, side, lower=1)[0]
        former = above
    y = reduced
    for t in range(frames - 1, -1, -1):
        y[t] -= gains[t] @ y[t + 1]
    return y[1:]


def dense_system(occupancy: Array, states: PoseStates) -> tuple[Array, Array]:
    """Return the whole matrix ((T+1)D square) and right side of eqs. (21)–(23), for tests."""
    d, frames = states.coordinates, len(occupancy)
    matrix = np.zeros(((frames + 1) * d, (frames + 1) * d))
    right = np.zeros((frames + 1) * d)
    for t, (diagonal, above, side) in enumerate(_assembled(occupancy, _blocks(states))):
        rows = slice(t * d, (t + 1) * d)
        matrix[rows, rows] = diagonal
        right[rows] = side
        if t < frames:
            after = slice((t + 1) * d, (t + 2) * d)
            matrix[rows, after] = above
            matrix[after, rows] = above.T
    return matrix, right


def with_differences(y: Array) -> Array:
    """Return [y_t; y_t − y_{t−1}], (T, 2D); the first frame repeats the second's difference."""
    step = np.diff(y, axis=0)
    if len(step) == 0:
        return np.concatenate([y, np.zeros_like(y)], axis=1)
    return np.concatenate([y, np.concatenate([step[:1], step])], axis=1)


def refitted_means(occupancy: Array, states: PoseStates, y: Array, ridge: float = 1e-3) -> Array:
    """Return state means (N, 2D) whose trajectory is closest to y (T, D); for small problems.

    Corrected form of the paper's appendix F: with R = G M and Q = L⁻¹ G minimise ‖Y − Q M‖², plus
    a small ridge towards the old means. The authors advise against it unless data abound.
    """
    d, count = states.coordinates, len(states.means)
    frames = len(occupancy)
    matrix, _ = dense_system(occupancy, states)
    precision = np.linalg.inv(states.covariances)
    g = np.zeros(((frames + 1) * d, count * 2 * d))
    for t in range(frames + 1):
        rows = slice(t * d, (t + 1) * d)
        for n in range(count):
            columns = slice(n * 2 * d, (n + 1) * 2 * d)
            if t > 0:
                g[rows, columns] += occupancy[t - 1, n] * (precision[n, :d] + precision[n, d:])
            if t < frames:
                g[rows, columns] -= occupancy[t, n] * precision[n, d:]
    q = np.linalg.solve(matrix, g)[d:]
    old = states.means.reshape(-1)
    normal = q.T @ q
    weight = ridge * np.trace(normal) / len(old)
    change = np.linalg.solve(normal + weight * np.eye(len(old)), q.T @ (y.reshape(-1) - q @ old))
    return (old + change).reshape(count, 2 * d)
