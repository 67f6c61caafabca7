"""The E step: scaled forward–backward over many sequences at once, and Viterbi.

Brand & Hertzmann 2000, eqs. (2)–(7). Symbols: R sequences of lengths T_r, padded to T frames;
N states; d dimensions. Sequence r is explained by model r of a stack, or all by one model.

Emissions are evaluated as one matrix product with the monomials of degree 0, 1 and 2 of the
features; forward and backward recursions advance all sequences in one loop over time. A sequence
whose scaled recursion leaves the range of floating point is done again in the log domain.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from motionstyle.errors import MotionStyleError
from motionstyle.shmm.model import HiddenMarkovModel

Array = NDArray[np.float64]
LOWEST = -690.0  # of a log emission density below the best state's in that frame


@dataclass(frozen=True)
class Sequences:
    """Feature sequences padded to one length.

    Attributes
    ----------
    frames : (R, T, d), zero beyond a sequence's end. lengths : (R,).
    monomials : (R, T, 1 + d + d(d+1)/2) of `frames` less `centre` (d,): 1, x, and products.
    """

    frames: Array
    lengths: NDArray[np.int64]
    centre: Array
    monomials: Array

    @property
    def mask(self) -> NDArray[np.bool_]:
        """Which frames belong to a sequence, (R, T)."""
        return np.arange(self.frames.shape[1]) < self.lengths[:, None]

    @property
    def total(self) -> int:
        """Number of frames of all sequences."""
        return int(self.lengths.sum())

    def split(self, values: Array) -> list[Array]:
        """Return padded values (R, T, ...) as one array a sequence."""
        return [v[:n] for v, n in zip(values, self.lengths, strict=True)]


def pack(sequences: Sequence[Array]) -> Sequences:
    """Pad sequences (T_r, d) of features for the functions of this module.

    Raises
    ------
    MotionStyleError
        If there is none, one is empty or not finite, or their dimensions differ.
    """
    if not sequences:
        raise MotionStyleError("no sequence to learn from")
    dimensions = sequences[0].shape[-1]
    for index, one in enumerate(sequences):
        if one.ndim != 2 or one.shape[1] != dimensions or len(one) == 0:
            raise MotionStyleError(
                f"sequence {index} has shape {one.shape}, expected frames x {dimensions}"
            )
        if not np.isfinite(one).all():
            raise MotionStyleError(f"sequence {index} holds values that are no number")
    lengths = np.array([len(one) for one in sequences])
    centre = np.concatenate(sequences).mean(axis=0)
    frames = np.zeros((len(sequences), int(lengths.max()), dimensions))
    for row, one in zip(frames, sequences, strict=True):
        row[: len(one)] = one
    return Sequences(frames, lengths, centre, _monomials(frames - centre))


def _monomials(x: Array) -> Array:
    """Return 1, x and the products x_a x_b for a ≤ b, (..., 1 + d + d(d+1)/2)."""
    a, b = np.triu_indices(x.shape[-1])
    ones = np.ones((*x.shape[:-1], 1))
    return np.concatenate([ones, x, x[..., a] * x[..., b]], axis=-1)


def log_emissions(model: HiddenMarkovModel, sequences: Sequences) -> Array:
    """Return log N(x_t; μ_i, K_i), (R, T, N).

    Raises
    ------
    MotionStyleError
        If a covariance is not positive definite.
    """
    d = model.dimensions
    try:
        factor = np.linalg.cholesky(model.covariances)
    except np.linalg.LinAlgError:
        raise MotionStyleError(
            "hidden Markov model: a covariance is not positive definite"
        ) from None
    root = np.linalg.solve(factor, np.broadcast_to(np.eye(d), factor.shape))
    precision = np.swapaxes(root, -1, -2) @ root
    mean = model.means - sequences.centre
    pulled = np.einsum("...ab,...b->...a", precision, mean)
    log_det = 2 * np.log(np.diagonal(factor, axis1=-2, axis2=-1)).sum(axis=-1)
    constant = -0.5 * (d * np.log(2 * np.pi) + log_det + (mean * pulled).sum(axis=-1))
    a, b = np.triu_indices(d)
    quadratic = -precision[..., a, b] * np.where(a == b, 0.5, 1.0)
    weights = np.concatenate([constant[..., None], pulled, quadratic], axis=-1)
    return sequences.monomials @ np.swapaxes(weights, -1, -2)


@dataclass(frozen=True)
class Expectations:
    """What the E step finds.

    log_likelihood : log p(X_r|θ), (R,). occupancy : γ (R, T, N), zero beyond a sequence's end.
    transitions : expected counts C (R, N, N), source × destination.
    """

    log_likelihood: Array
    occupancy: Array
    transitions: Array


def expectations(model: HiddenMarkovModel, sequences: Sequences) -> Expectations:
    """Return log-likelihoods, occupancies and expected transition counts, eqs. (2)–(7).

    Parameters
    ----------
    model : one for all sequences, or a stack of R.

    Raises
    ------
    MotionStyleError
        If a model cannot produce a sequence at all (its transitions do not allow it).
    """
    log_b = log_emissions(model, sequences)
    return expectations_of(model.start, model.transitions, log_b, sequences.lengths)


def expectations_of(
    start: Array, transitions: Array, log_b: Array, lengths: NDArray[np.int64]
) -> Expectations:
    """Return what `expectations` does from log emission densities (R, T, N)."""
    count, frames, states = log_b.shape
    start = np.broadcast_to(start, (count, states))
    inside = (np.arange(frames) < lengths[:, None])[..., None]
    peak = log_b.max(axis=-1, keepdims=True)
    b = np.where(inside, np.exp(np.maximum(log_b - peak, LOWEST)), 1.0)
    alpha, scale, beta = _recursions(start, transitions, b, lengths)
    with np.errstate(divide="ignore"):
        logs = np.where(inside[..., 0], np.log(scale) + peak[..., 0], 0.0)
    log_likelihood = logs.sum(axis=1)
    occupancy = alpha * beta
    total = occupancy.sum(axis=-1, keepdims=True)
    # where α and β hardly overlap the products leave floating point; those sequences are redone
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        occupancy = np.where(inside, occupancy / total, 0.0)
        # what comes after a transition into i at t, over the total weight of frame t
        after = np.where(inside, b * beta / (scale[..., None] * total), 0.0)[:, 1:]
        counts = transitions * (np.swapaxes(alpha[:, :-1], 1, 2) @ after)
    each = np.broadcast_to(transitions, counts.shape)
    bad = ~(np.isfinite(log_likelihood) & np.isfinite(occupancy).all(axis=(1, 2)))
    bad |= ~np.isfinite(counts).all(axis=(1, 2))
    for r in np.flatnonzero(bad):
        n = int(lengths[r])
        found = _in_logs(start[r], each[r], log_b[r, :n])
        if not np.isfinite(found[0]):
            raise MotionStyleError(
                f"sequence {r} of {n} frames cannot come from its model: no path of states "
                "that the transitions allow has its length"
            )
        log_likelihood[r], occupancy[r, :n], counts[r] = found
    return Expectations(log_likelihood, occupancy, counts)


def _recursions(
    start: Array, transitions: Array, b: Array, lengths: NDArray[np.int64]
) -> tuple[Array, Array, Array]:
    """Return scaled α (R, T, N), its scales (R, T) and β up to a factor a frame (R, T, N).

    Eqs. (4) and (5). β is computed in each sequence's own reversed time, together with α. Where
    one matrix of transitions serves all sequences they advance in one product.
    """
    count, frames, states = b.shape
    groups, members = (1, count) if transitions.ndim == 2 else (count, 1)
    reverse = np.maximum(lengths[:, None] - 1 - np.arange(frames), 0)
    rows = np.arange(count)[:, None]
    shape = (groups, members, states)
    both = np.empty((frames, 2, *shape))  # time first: the loop walks along memory
    both[:, 0] = np.swapaxes(b, 0, 1).reshape(frames, *shape)
    both[:, 1] = np.swapaxes(b[rows, reverse], 0, 1).reshape(frames, *shape)
    forward = transitions.reshape(groups, states, states)
    matrices = np.stack([forward, np.swapaxes(forward, 1, 2)])
    values = np.empty_like(both)
    scales = np.empty((frames, 2, groups, members, 1))
    values[0, 0] = (start * b[:, 0]).reshape(shape)
    values[0, 1] = 1.0
    moved = np.empty((2, *shape))
    add = np.add.reduce
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        scales[0] = add(values[0], axis=-1, keepdims=True)
        values[0] /= scales[0]
        for t in range(1, frames):
            former, now, scale = values[t - 1], values[t], scales[t]
            np.multiply(former[1], both[t - 1, 1], out=moved[1])
            moved[0] = former[0]
            np.matmul(moved, matrices, out=now)
            now[0] *= both[t, 0]
            add(now, axis=-1, keepdims=True, out=scale)
            now /= scale
    values = values.reshape(frames, 2, count, states)
    alpha = np.swapaxes(values[:, 0], 0, 1)
    scale = np.swapaxes(scales[:, 0].reshape(frames, count), 0, 1)
    beta = np.swapaxes(values[:, 1], 0, 1)[rows, reverse]
    return np.ascontiguousarray(alpha), np.ascontiguousarray(scale), beta


def _in_logs(start: Array, transitions: Array, log_b: Array) -> tuple[float, Array, Array]:
    """Return log-likelihood, occupancy and counts of one sequence, all in the log domain."""
    frames, states = log_b.shape
    with np.errstate(divide="ignore"):
        log_p, first = np.log(transitions), np.log(start)
    alpha, beta = np.empty((frames, states)), np.zeros((frames, states))
    alpha[0] = first + log_b[0]
    with np.errstate(invalid="ignore"):
        for t in range(1, frames):
            alpha[t] = logsumexp(alpha[t - 1][:, None] + log_p, axis=0) + log_b[t]
        for t in range(frames - 2, -1, -1):
            beta[t] = logsumexp(log_p + (log_b[t + 1] + beta[t + 1]), axis=1)
        total = float(logsumexp(alpha[-1]))
        if not np.isfinite(total):
            return total, np.zeros((frames, states)), np.zeros((states, states))
        counts = np.zeros((states, states))
        for t in range(1, frames):
            counts += np.exp(alpha[t - 1][:, None] + log_p + log_b[t] + beta[t] - total)
        return total, np.exp(alpha + beta - total), counts


def viterbi(model: HiddenMarkovModel, sequences: Sequences) -> list[NDArray[np.int64]]:
    """Return the most probable state path of each sequence, (T_r,) each."""
    log_b = log_emissions(model, sequences)
    count, frames, states = log_b.shape
    with np.errstate(divide="ignore"):
        log_p = np.broadcast_to(np.log(model.transitions), (count, states, states))
        best = np.log(np.broadcast_to(model.start, (count, states))) + log_b[:, 0]
    pointers = np.zeros((count, frames, states), dtype=np.int64)
    ends = np.array(best)
    for t in range(1, frames):
        arriving = best[:, :, None] + log_p
        pointers[:, t] = arriving.argmax(axis=1)
        best = np.take_along_axis(arriving, pointers[:, t][:, None], axis=1)[:, 0] + log_b[:, t]
        ends = np.where((sequences.lengths == t + 1)[:, None], best, ends)
    paths = []
    for r, length in enumerate(sequences.lengths):
        path = np.empty(length, dtype=np.int64)
        path[-1] = ends[r].argmax()
        for t in range(length - 1, 0, -1):
            path[t - 1] = pointers[r, t, path[t]]
        paths.append(path)
    return paths
