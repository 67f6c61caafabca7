"""Full poses behind the states: remapping, mixing by style, timing, synthesis.

Brand & Hertzmann 2000, §3.3 (remapping), §4.3, appendices B and F; style_machines.md A2.7, A5,
A6. D pose channels, standardised; a state's Gaussian is of [y_t; y_t − y_{t−1}], 2D.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError
from motionstyle.shmm.style_space import from_signed_roots, signed_roots
from motionstyle.shmm.trajectory import PoseStates, most_likely_trajectory, with_differences

Array = NDArray[np.float64]
Dwell = Literal["linear", "log"]


@dataclass(frozen=True)
class RemapSettings:
    """How full poses are estimated behind the states.

    prior_frames : weight of the generic state, moved by the sequence's mean difference from it,
    in each specific state. covariance_frames : weight of the pooled covariance in each specific
    one. shrinkage : ε towards the diagonal of the mean covariance within states.
    dwell : whether dwell times are mixed as they are or by their logarithms.
    """

    prior_frames: float = 1.0
    covariance_frames: float = 20.0
    shrinkage: float = 0.1
    dwell: Dwell = "linear"


@dataclass(frozen=True)
class PoseMachine:
    """Pose states of the generic and the R specific models.

    Attributes
    ----------
    centre, spread : mean and standard deviation of the channels, (D,).
    generic : PoseStates. means : (R, N, 2D). roots : signed roots of covariances, (R, N, 2D, 2D).
    generic_dwell : (N,), dwell : (R, N), frames a visit. settings : how it was made.
    """

    centre: Array
    spread: Array
    generic: PoseStates
    means: Array
    roots: Array
    generic_dwell: Array
    dwell: Array
    settings: RemapSettings

    @property
    def states(self) -> int:
        """Number of states N."""
        return len(self.generic.means)


def visits(path: NDArray[np.int64]) -> list[tuple[int, int, int]]:
    """Return (state, first frame, last frame) of each stay of a path (T,) in a state."""
    edges = np.flatnonzero(np.diff(path)) + 1
    firsts = np.concatenate([[0], edges])
    lasts = np.concatenate([edges - 1, [len(path) - 1]])
    return [(int(path[a]), int(a), int(b)) for a, b in zip(firsts, lasts, strict=True)]


def mean_dwell(paths: Sequence[NDArray[np.int64]], states: int) -> tuple[Array, Array]:
    """Return frames and visits per state, (N,) each; a clip's first and last visit are cut short.

    They count only for states that have no whole visit.
    """
    whole, cut = np.zeros((2, states)), np.zeros((2, states))
    for path in paths:
        stays = visits(path)
        for k, (state, first, last) in enumerate(stays):
            target = whole if 0 < k < len(stays) - 1 else cut
            target[:, state] += (last - first + 1, 1)
    unknown = whole[1] == 0
    whole[:, unknown] = cut[:, unknown]
    return whole[0], whole[1]


def remap(
    channels: Sequence[Array],
    occupancy: Sequence[Array],
    owners: NDArray[np.int64],
    settings: RemapSettings,
) -> PoseMachine:
    """Return the pose states behind fixed occupancies; eqs. (9), (10), (16).

    Parameters
    ----------
    channels : (T_r, D), synchronous with `occupancy`, (T_r, N). owners : model of each sequence.
    """
    if len(channels) != len(occupancy) or any(
        len(c) != len(o) for c, o in zip(channels, occupancy, strict=False)
    ):
        raise MotionStyleError("remapping needs one occupancy for each frame of each sequence")
    everything = np.concatenate(channels)
    centre, spread = everything.mean(axis=0), everything.std(axis=0)
    spread = np.where(spread > 1e-9, spread, 1.0)
    y = [with_differences((c - centre) / spread) for c in channels]
    models, n, size = int(owners.max()) + 1, occupancy[0].shape[1], y[0].shape[1]
    counts, first = np.zeros((models, n)), np.zeros((models, n, size))
    for own, gamma, one in zip(owners, occupancy, y, strict=True):
        counts[own] += gamma.sum(axis=0)
        first[own] += gamma.T @ one
    generic = first.sum(axis=0) / np.maximum(counts.sum(axis=0), 1e-9)[:, None]
    means = _specific_means(counts, first, generic, settings)
    scatter = np.zeros((models, n, size, size))
    for own, gamma, one in zip(owners, occupancy, y, strict=True):
        for state in np.flatnonzero(gamma.sum(axis=0) > 1e-6):
            seen = gamma[:, state] > 1e-6
            away = one[seen] - means[own, state]
            scatter[own, state] += (gamma[seen, state][:, None] * away).T @ away
    pooled_counts = np.maximum(counts.sum(axis=0), 1e-9)[:, None, None]
    pooled = scatter.sum(axis=0) / pooled_counts
    within = np.diag(np.diagonal(scatter.sum(axis=(0, 1))) / counts.sum())
    within = within + np.diag(np.full(size, 1e-6))
    eps = settings.shrinkage
    pooled = (1 - eps) * pooled + eps * within
    weight = settings.covariance_frames
    own_covariances = (scatter + weight * pooled) / (counts[..., None, None] + weight)
    own_covariances = (1 - eps) * own_covariances + eps * within
    dwell = np.empty((models, n))
    paths = [gamma.argmax(axis=1) for gamma in occupancy]
    frames, stays = mean_dwell(paths, n)
    overall = np.where(stays > 0, frames / np.maximum(stays, 1), 1.0)
    tempo = np.ones(models)
    for model in range(models):
        own_frames, own_stays = mean_dwell(
            [p for p, o in zip(paths, owners, strict=True) if o == model], n
        )
        seen = own_stays > 0
        tempo[model] = own_frames.sum() / max(float((own_stays * overall).sum()), 1e-9)
        # one visit's worth of the generic dwell at the model's own tempo
        prior = overall * tempo[model]
        dwell[model] = np.where(seen, (own_frames + prior) / (own_stays + 1), prior)
    return PoseMachine(
        centre,
        spread,
        PoseStates(generic, pooled),
        means,
        signed_roots(own_covariances),
        overall,
        dwell,
        settings,
    )


def _specific_means(counts: Array, first: Array, generic: Array, settings: RemapSettings) -> Array:
    """Return state means (R, N, 2D), drawn to the generic ones moved by the mean difference."""
    prior = settings.prior_frames
    total = np.maximum(counts.sum(axis=1), 1e-9)
    moved = (first - counts[..., None] * generic).sum(axis=1) / total[:, None]
    goal = generic + moved[:, None, :]
    return (first + prior * goal) / (counts + prior)[..., None]


@dataclass(frozen=True)
class StyledPoses:
    """Pose states and dwell times (N,) of one style."""

    states: PoseStates
    dwell: Array


def styled_means(machine: PoseMachine, weights: Array) -> Array:
    """Return the state means (N, 2D) of a style given as weights of the specific models, (R,)."""
    w = np.asarray(weights, dtype=float)
    if w.shape != (len(machine.means),):
        raise MotionStyleError(f"a style needs {len(machine.means)} weights, found {w.shape}")
    return machine.generic.means + np.tensordot(w, machine.means - machine.generic.means, 1)


def styled_poses(machine: PoseMachine, weights: Array) -> StyledPoses:
    """Return pose states of a style given as weights of the specific models, (R,).

    generic + Σ w_r (specific_r − generic), in means, signed roots of covariances, and dwell.
    """
    w = np.asarray(weights, dtype=float)
    means = styled_means(machine, w)
    generic = machine.generic
    origin = signed_roots(generic.covariances)
    roots = origin + np.tensordot(w, machine.roots - origin, 1)
    floor = 0.05 * np.diagonal(generic.covariances, axis1=1, axis2=2).min(axis=0) + 1e-9
    covariances = from_signed_roots(roots, floor)
    if machine.settings.dwell == "log":
        base = np.log(machine.generic_dwell)
        dwell = np.exp(base + w @ (np.log(machine.dwell) - base))
    else:
        dwell = machine.generic_dwell + w @ (machine.dwell - machine.generic_dwell)
    return StyledPoses(PoseStates(means, covariances), np.maximum(dwell, 1.0))


def warped_occupancy(occupancy: Array, old_dwell: Array, new_dwell: Array) -> Array:
    """Return γ with every stay scaled by new/old dwell of its state; A6.

    Ends of stays are rounded cumulatively, so that the length follows the sum.
    """
    path = occupancy.argmax(axis=1)
    factor = new_dwell / old_dwell
    ends = np.cumsum(factor[path])
    count = max(1, round(float(ends[-1])))
    source = np.searchsorted(ends, np.arange(count) + 0.5 * ends[-1] / count)
    return occupancy[np.minimum(source, len(path) - 1)]


def path_occupancy(states: Sequence[int], dwell: Array) -> Array:
    """Return γ (T, N) of a sequence of stays, each as long as its state's dwell."""
    order = np.asarray(states, dtype=np.int64)
    ends = np.maximum.accumulate(np.round(np.cumsum(dwell[order])).astype(int))
    firsts = np.concatenate([[0], ends[:-1]])
    path = np.repeat(order, np.maximum(ends - firsts, 0))
    return np.eye(len(dwell))[path]


def synthesise(machine: PoseMachine, occupancy: Array, poses: StyledPoses) -> Array:
    """Return pose channels (T, D) of a state sequence in a style; eqs. (20)–(23)."""
    return most_likely_trajectory(occupancy, poses.states) * machine.spread + machine.centre


def restyled(
    machine: PoseMachine, occupancy: Array, own: int | None, weights: Array
) -> tuple[Array, StyledPoses]:
    """Return pose channels of a content γ (T, N) in another style, with its timing warped.

    own : the specific model whose dwell times the content has; None for the generic one.
    """
    poses = styled_poses(machine, weights)
    old = machine.generic_dwell if own is None else machine.dwell[own]
    return synthesise(machine, warped_occupancy(occupancy, old, poses.dwell), poses), poses
