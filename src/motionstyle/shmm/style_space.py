"""Style space: the specific models as a low-dimensional cloud about the generic one.

Brand & Hertzmann 2000, §4.3, §4.4 and appendix B; style_machines.md A3, A4. A model's vector
holds, per state, its mean, the signed square roots of the upper triangle of its covariance, and
its dwell time. The origin is the generic model, not the mean of the specific ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError
from motionstyle.shmm.gaussians import estimate, moments, raised
from motionstyle.shmm.inference import expectations, pack
from motionstyle.shmm.model import HiddenMarkovModel, dwell_times, normalised
from motionstyle.shmm.training import StyleMachine

Array = NDArray[np.float64]


def signed_roots(values: Array) -> Array:
    """Return sign(K) √|K|, the space in which covariances are mixed."""
    return np.sign(values) * np.sqrt(np.abs(values))


def from_signed_roots(roots: Array, floor: Array) -> Array:
    """Return covariances (..., d, d) of signed roots, with absolute eigenvalues and a floor."""
    values = roots * np.abs(roots)
    sizes, vectors = np.linalg.eigh((values + np.swapaxes(values, -1, -2)) / 2)
    mended = (vectors * np.abs(sizes)[..., None, :]) @ np.swapaxes(vectors, -1, -2)
    return raised(mended, floor)


def model_blocks(model: HiddenMarkovModel) -> tuple[Array, Array, Array]:
    """Return means, covariance roots and dwell times as rows (R, ·) of a stack's vectors."""
    a, b = np.triu_indices(model.dimensions)
    roots = signed_roots(model.covariances[..., a, b])
    count = len(model.means) if model.means.ndim == 3 else 1
    return (
        model.means.reshape(count, -1),
        roots.reshape(count, -1),
        dwell_times(model).reshape(count, -1),
    )


@dataclass(frozen=True)
class StyleSpace:
    """Directions of style about a generic model.

    Attributes
    ----------
    generic : the origin, (P,), blocks scaled. basis : (P, S) orthonormal. coordinates : v of each
        specific model, (R, S). shares : part of the sum of squares about the generic model that
        each possible direction explains, (min(R, P),).
    scales : factors of the blocks means, covariances, dwell times. sizes : their lengths.
    """

    generic: Array
    basis: Array
    coordinates: Array
    shares: Array
    scales: tuple[float, float, float]
    sizes: tuple[int, int, int]

    @property
    def dof(self) -> int:
        """Number of style degrees of freedom S."""
        return self.basis.shape[1]

    def vector(self, model: HiddenMarkovModel) -> Array:
        """Return a model's vector, (P,)."""
        parts = [s * rows[0] for s, rows in zip(self.scales, model_blocks(model), strict=True)]
        return np.concatenate(parts)

    def coordinates_of(self, model: HiddenMarkovModel) -> Array:
        """Return the style v of a model with the same state graph, (S,)."""
        return (self.vector(model) - self.generic) @ self.basis

    def weights(self, v: Array) -> Array:
        """Return the least weights of the specific models' differences that give style v, (R,)."""
        return np.linalg.pinv(self.coordinates.T) @ np.asarray(v, dtype=float)


def style_space(
    generic: HiddenMarkovModel,
    specifics: HiddenMarkovModel,
    dof: int,
    *,
    scale_blocks: bool = True,
    block_weights: Sequence[float] = (1.0, 1.0, 1.0),
) -> StyleSpace:
    """Return the principal directions of the specific models about the generic one.

    Parameters
    ----------
    dof : S, number of directions kept.
    scale_blocks : bring the blocks of means, covariances and dwell times, whose units differ, to
        equal sums of squares; otherwise they enter as they are.
    block_weights : factors on the blocks after that, each more than 0.

    Raises
    ------
    MotionStyleError
        If more degrees of freedom are asked for than there are models.
    """
    own, origin = model_blocks(specifics), model_blocks(generic)
    count = len(own[0])
    if not 1 <= dof <= count:
        raise MotionStyleError(
            f"{dof} style degrees of freedom cannot be had from {count} "
            f"model{'s' if count != 1 else ''}: ask for 1 to {count} ('style_dof' in "
            "config/style_machines.yaml), or add clips"
        )
    scales = []
    for mine, base, weight in zip(own, origin, block_weights, strict=True):
        size = float(np.sqrt(((mine - base) ** 2).sum()))
        scales.append(weight * (1.0 / size if scale_blocks and size > 1e-12 else 1.0))
    rows = np.concatenate([s * m for s, m in zip(scales, own, strict=True)], axis=1)
    base = np.concatenate([s * b for s, b in zip(scales, origin, strict=True)], axis=1)[0]
    _, sizes, directions = np.linalg.svd(rows - base, full_matrices=False)
    total = float((sizes**2).sum())
    basis = directions[:dof].T
    strongest = np.abs(basis).argmax(axis=0)
    basis = basis * np.where(basis[strongest, np.arange(dof)] < 0, -1.0, 1.0)
    return StyleSpace(
        base,
        basis,
        (rows - base) @ basis,
        sizes**2 / total if total > 0 else np.zeros(len(sizes)),
        tuple(scales),
        tuple(part.shape[1] for part in own),
    )


def styled_model(
    space: StyleSpace, generic: HiddenMarkovModel, v: Array, floor: Array
) -> HiddenMarkovModel:
    """Return the hidden Markov model of style v, (S,), with mended covariances; A3.3.

    Dwell times are at least one frame; the other transitions keep their proportions.
    """
    vector = space.generic + space.basis @ np.asarray(v, dtype=float)
    means, roots, dwell = np.split(vector, np.cumsum(space.sizes)[:-1])
    means, roots, dwell = (
        part / scale for part, scale in zip((means, roots, dwell), space.scales, strict=True)
    )
    n, d = generic.states, generic.dimensions
    a, b = np.triu_indices(d)
    full = np.empty((n, d, d))
    full[:, a, b] = full[:, b, a] = roots.reshape(n, -1)
    return HiddenMarkovModel(
        generic.start,
        with_dwell(generic.transitions, np.maximum(dwell, 1.0)),
        means.reshape(n, d),
        from_signed_roots(full, floor),
    )


def with_dwell(transitions: Array, dwell: Array) -> Array:
    """Return transitions (N, N) whose states are left after `dwell` (N,) frames on average."""
    n = np.arange(len(transitions))
    away = transitions.copy()
    away[n, n] = 0.0
    leaving = away.sum(axis=1) > 0
    stay = np.where(leaving, 1.0 - 1.0 / np.maximum(dwell, 1.0), 1.0)
    result = normalised(away) * (1.0 - stay)[:, None]
    result[~leaving] = 0.0
    result[n, n] = stay
    return result


@dataclass(frozen=True)
class Analysis:
    """Style and content of new data: v (S,), the adapted model, γ per sequence, log-likelihood."""

    v: Array
    model: HiddenMarkovModel
    occupancy: tuple[Array, ...]
    log_likelihood: float


def analyse(
    sequences: Sequence[Array],
    machine: StyleMachine,
    space: StyleSpace,
    *,
    floor: Array,
    holding: float = 0.5,
    steps: int = 30,
) -> Analysis:
    """Return the style of new sequences (T, d) of one performer; A4.

    Starts from the specific model (or the generic one) of highest likelihood, and retrains with
    the cross-entropy prior towards the generic model.
    """
    packed = pack(sequences)
    generic = machine.generic
    candidates = [generic] + [machine.specifics[r] for r in range(len(machine.specifics.means))]
    likelihoods = [float(expectations(c, packed).log_likelihood.sum()) for c in candidates]
    model = candidates[int(np.argmax(likelihoods))]
    model = replace(model, start=normalised(generic.start + 1e-3))
    found = expectations(model, packed)
    for _ in range(steps):
        sums = moments(found.occupancy, packed).pooled()
        best = estimate(sums, packed.centre, floor, generic, holding * sums.counts)
        counts = found.transitions.sum(axis=0)
        out_of = counts.sum(axis=1)
        stay = np.diagonal(generic.transitions)
        weight = np.where(out_of > 1e-9, out_of * (1.0 + holding), 1.0)
        own = np.where(
            out_of > 1e-9, (np.diagonal(counts) + holding * out_of * stay) / weight, stay
        )
        dwell = 1.0 / np.maximum(1.0 - own, 1e-6)
        model = HiddenMarkovModel(
            model.start, with_dwell(generic.transitions, dwell), best.means, best.covariances
        )
        former = found.log_likelihood.sum()
        found = expectations(model, packed)
        if abs(found.log_likelihood.sum() - former) < 1e-6 * abs(former):
            break
    return Analysis(
        space.coordinates_of(model),
        model,
        tuple(packed.split(found.occupancy)),
        float(found.log_likelihood.sum()),
    )
