"""Hidden Markov models with Gaussian emissions, one or a stack of them.

Symbols, shapes (style_machines.md §2): N states, d feature dimensions, "..." nothing or R models.
Rows of a transition matrix are sources: `transitions[j, i]` is P(j → i) and rows sum to one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class HiddenMarkovModel:
    """Start probabilities (..., N), transitions (..., N, N), means (..., N, d), covariances."""

    start: Array
    transitions: Array
    means: Array
    covariances: Array

    def __post_init__(self) -> None:
        *stack, states, dimensions = self.means.shape
        expected = {
            "start": (*stack, states),
            "transitions": (*stack, states, states),
            "covariances": (*stack, states, dimensions, dimensions),
        }
        for name, shape in expected.items():
            found = getattr(self, name).shape
            if found != shape:
                raise MotionStyleError(f"hidden Markov model: {name} is {found}, expected {shape}")
            if not np.isfinite(getattr(self, name)).all():
                raise MotionStyleError(
                    f"hidden Markov model: {name} holds values that are no number"
                )

    @property
    def states(self) -> int:
        """Number of states N."""
        return self.means.shape[-2]

    @property
    def dimensions(self) -> int:
        """Number of feature dimensions d."""
        return self.means.shape[-1]

    def __getitem__(self, which: int | slice | NDArray[np.int64]) -> HiddenMarkovModel:
        """Return one model, or some, of a stack."""
        return HiddenMarkovModel(
            self.start[which], self.transitions[which], self.means[which], self.covariances[which]
        )

    def keep(self, states: NDArray[np.bool_]) -> HiddenMarkovModel:
        """Return the model with only some states (N,) left, its probabilities renormalised."""
        start = self.start[..., states]
        transitions = self.transitions[..., states, :][..., states]
        return HiddenMarkovModel(
            normalised(start),
            normalised(transitions),
            self.means[..., states, :],
            self.covariances[..., states, :, :],
        )

    def with_transitions(self, transitions: Array) -> HiddenMarkovModel:
        """Return the model with other transitions."""
        return replace(self, transitions=transitions)


def stack(models: Sequence[HiddenMarkovModel]) -> HiddenMarkovModel:
    """Return R models of one shape as a stack."""
    return HiddenMarkovModel(
        *(
            np.stack([getattr(model, name) for model in models])
            for name in ("start", "transitions", "means", "covariances")
        )
    )


def repeat(model: HiddenMarkovModel, count: int) -> HiddenMarkovModel:
    """Return a stack of `count` copies of one model."""
    return stack([model] * count)


def normalised(weights: Array) -> Array:
    """Return weights scaled to sum to one along the last axis; an empty row becomes uniform."""
    total = weights.sum(axis=-1, keepdims=True)
    uniform = 1.0 / weights.shape[-1]
    return np.where(total > 0, weights / np.where(total > 0, total, 1.0), uniform)


def count_parameters(model: HiddenMarkovModel) -> int:
    """Return means, upper triangles of covariances and live transitions (style_machines.md §8)."""
    d = model.dimensions
    return model.states * (d + d * (d + 1) // 2) + int((model.transitions > 0).sum())


def dwell_times(model: HiddenMarkovModel) -> Array:
    """Return the mean dwell in each state, δ = 1/(1 − P(i → i)), (..., N), frames."""
    stay = np.diagonal(model.transitions, axis1=-2, axis2=-1)
    return 1.0 / np.maximum(1.0 - stay, 1e-3)
