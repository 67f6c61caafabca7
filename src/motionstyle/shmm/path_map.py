"""Driving a motion by another signal: a path map (Brand & Hertzmann 2000, appendix E; A8).

The target's states get Gaussians over a cue that was seen in the same frames; a new cue then gives
occupancies with the target's transitions, and those a trajectory.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from motionstyle.shmm.gaussians import Gaussians, estimate, moments
from motionstyle.shmm.inference import expectations, pack
from motionstyle.shmm.model import HiddenMarkovModel, normalised

Array = NDArray[np.float64]


def cue_model(
    target: HiddenMarkovModel, cues: Sequence[Array], occupancy: Sequence[Array]
) -> HiddenMarkovModel:
    """Return the target's state graph with Gaussians over cues (T_r, C); eqs. (9), (10).

    occupancy : γ of the target over the same frames, (T_r, N).
    """
    packed = pack(cues)
    gamma = np.zeros((*packed.frames.shape[:2], target.states))
    for row, one in zip(gamma, occupancy, strict=True):
        row[: len(one)] = one
    everything = np.concatenate(list(cues))
    variance = np.maximum(everything.var(axis=0), 1e-12)
    wide = Gaussians(
        np.broadcast_to(everything.mean(axis=0), (target.states, everything.shape[1])),
        np.broadcast_to(np.diag(variance), (target.states, *np.diag(variance).shape)),
    )
    # one frame's worth of the whole cue keeps rare states broad
    found = estimate(moments(gamma, packed).pooled(), packed.centre, 1e-3 * variance, wide, 1.0)
    begins = normalised(target.start + 1.0 / target.states)
    return HiddenMarkovModel(begins, target.transitions, found.means, found.covariances)


def drive(model: HiddenMarkovModel, cue: Array) -> Array:
    """Return the occupancies (T, N) that a new cue (T, C) asks for; eq. (7)."""
    return expectations(model, pack([cue])).occupancy[0]
