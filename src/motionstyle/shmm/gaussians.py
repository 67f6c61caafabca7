"""Gaussians under the entropic and the cross-entropic prior.

Brand & Hertzmann 2000, eqs. (9), (10), (14)–(17), with (15) as corrected in style_machines.md.
Symbols: n occupancy of a state, frames; Z, Z′ strengths of the entropy and the cross-entropy
prior, in data points; μ•, K• the reference.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionstyle.shmm.inference import Sequences
from motionstyle.shmm.model import HiddenMarkovModel

Array = NDArray[np.float64]
# However hot, a state keeps a tenth of its evidence (style_machines.md §5).
HOTTEST_SHARE = 0.9


@dataclass(frozen=True)
class Moments:
    """Weighted sums of features: counts n (..., N), first (..., N, d), second (..., N, d, d)."""

    counts: Array
    first: Array
    second: Array

    def pooled(self) -> Moments:
        """Return the sums over a stack."""
        return Moments(self.counts.sum(0), self.first.sum(0), self.second.sum(0))


def moments(occupancy: Array, sequences: Sequences) -> Moments:
    """Return the sums of 1, x − c and (x − c)(x − c)ᵀ weighted by γ (R, T, N), per sequence.

    c is the sequences' centre, which keeps the digits of small covariances.
    """
    d = sequences.frames.shape[-1]
    sums = np.swapaxes(occupancy, 1, 2) @ sequences.monomials
    a, b = np.triu_indices(d)
    second = np.empty((*sums.shape[:-1], d, d))
    second[..., a, b] = second[..., b, a] = sums[..., 1 + d :]
    return Moments(sums[..., 0], sums[..., 1 : 1 + d], second)


@dataclass(frozen=True)
class Gaussians:
    """Means (..., N, d) and covariances (..., N, d, d)."""

    means: Array
    covariances: Array


def estimate(
    sums: Moments,
    centre: Array,
    floor: Array,
    reference: HiddenMarkovModel | Gaussians,
    holding: Array | float = 0.0,
    entropy: Array | float = 0.0,
) -> Gaussians:
    """Return the MAP Gaussians, eqs. (16), (17); with both strengths 0, eqs. (9), (10).

    Parameters
    ----------
    sums : about `centre` (d,).
    floor : least variance of each feature (d,): covariances are raised to it where singular.
    reference : μ• and K•; also what a state without any evidence keeps.
    holding, entropy : Z′ and Z, for all states or each (..., N). A hot Z < 0 is limited so that
        the denominator of (17) stays positive.
    """
    n, held = sums.counts, np.broadcast_to(np.asarray(holding, dtype=float), sums.counts.shape)
    goal = reference.means - centre
    weight = n + held
    known = weight > 1e-9
    safe = np.where(known, weight, 1.0)
    means = (sums.first + held[..., None] * goal) / safe[..., None]
    means = np.where(known[..., None], means, goal)
    crossed = sums.first[..., :, None] * means[..., None, :]
    scatter = sums.second - crossed - np.swapaxes(crossed, -1, -2)
    scatter = scatter + n[..., None, None] * means[..., :, None] * means[..., None, :]
    away = means - goal
    pull = away[..., :, None] * away[..., None, :] + reference.covariances
    entropic = np.maximum(entropy, -HOTTEST_SHARE * weight)
    bottom = np.where(known, weight + entropic, 1.0)
    covariances = (scatter + held[..., None, None] * pull) / bottom[..., None, None]
    covariances = np.where(known[..., None, None], covariances, reference.covariances)
    return Gaussians(means + centre, raised(covariances, floor))


def raised(covariances: Array, floor: Array) -> Array:
    """Return covariances with no eigenvalue, in units of `floor` (d,), below one.

    Also makes them exactly symmetric. The entropy prior alone would drive variances to zero, and
    one-frame states have none.
    """
    root = np.sqrt(floor)
    scaled = covariances / np.outer(root, root)
    scaled = (scaled + np.swapaxes(scaled, -1, -2)) / 2
    values, vectors = np.linalg.eigh(scaled)
    low = values[..., 0] < 1.0
    if not low.any():
        return scaled * np.outer(root, root)
    lifted = (vectors * np.maximum(values, 1.0)[..., None, :]) @ np.swapaxes(vectors, -1, -2)
    lifted = (lifted + np.swapaxes(lifted, -1, -2)) / 2
    return np.where(low[..., None, None], lifted, scaled) * np.outer(root, root)


def entropies(covariances: Array) -> Array:
    """Return ½(d log 2πe + log|K|), nat; eq. (14)."""
    d = covariances.shape[-1]
    return 0.5 * (d * np.log(2 * np.pi * np.e) + np.linalg.slogdet(covariances)[1])


def divergences(
    reference: HiddenMarkovModel | Gaussians, own: HiddenMarkovModel | Gaussians
) -> Array:
    """Return D(θ•‖θ) of Gaussians, nat, (..., N); eq. (15) with tr(K⁻¹K•).

    The printed equation has the inverse of K• in the trace and is not zero at θ = θ•.
    """
    inverse = np.linalg.inv(own.covariances)
    away = own.means - reference.means
    d = away.shape[-1]
    trace = (inverse * reference.covariances).sum(axis=(-1, -2))
    quadratic = np.einsum("...a,...ab,...b->...", away, inverse, away)
    volumes = np.linalg.slogdet(own.covariances)[1] - np.linalg.slogdet(reference.covariances)[1]
    return 0.5 * (volumes + trace + quadratic - d)
