"""Known truth: sequences of a known stylistic model, learnt again (E9)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import subspace_angles
from scipy.optimize import linear_sum_assignment

from motionstyle.shmm.model import HiddenMarkovModel, normalised
from motionstyle.shmm.schedule import Schedule
from motionstyle.shmm.style_space import style_space
from motionstyle.shmm.training import TrainingSettings, train

Array = NDArray[np.float64]
TWIN_COLUMNS = (
    *("config", "data", "seed", "noise", "noise_sd", "states_true", "states_start", "states_found"),
    *("state_count_error", "subspace_angle_deg", "v_correlation", "explained_true_dof"),
)
START_FACTOR = 1.5  # more states are offered than there are


def true_machine(
    rng: np.random.Generator, states: int, dimensions: int, dof: int, noise: float
) -> tuple[HiddenMarkovModel, Array]:
    """Return a cyclic generic model and the style directions U (N, d, S) of its means."""
    angle = 2 * np.pi * np.arange(states) / states
    basis = np.linalg.qr(rng.normal(size=(dimensions, 2)))[0]
    means = 2.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1) @ basis.T
    means += 0.2 * rng.normal(size=means.shape)
    stay, go = 0.7, 0.3
    transitions = stay * np.eye(states) + go * np.roll(np.eye(states), 1, axis=1)
    directions = rng.normal(size=(states, dimensions, dof)) * 0.3
    covariances = np.broadcast_to(np.eye(dimensions) * noise**2, (states, dimensions, dimensions))
    model = HiddenMarkovModel(normalised(np.ones(states)), transitions, means, covariances.copy())
    return model, directions


def sample(
    model: HiddenMarkovModel, means: Array, frames: int, rng: np.random.Generator
) -> tuple[Array, NDArray[np.int64]]:
    """Return a sequence (T, d) of the model with other means, and its state path."""
    path = np.empty(frames, dtype=np.int64)
    path[0] = rng.choice(model.states, p=model.start)
    for t in range(1, frames):
        path[t] = rng.choice(model.states, p=model.transitions[path[t - 1]])
    roots = np.linalg.cholesky(model.covariances)
    noise = np.einsum("tab,tb->ta", roots[path], rng.normal(size=(frames, model.dimensions)))
    return means[path] + noise, path


def twin_row(
    seed: int, noise_name: str, noise: float, settings: Mapping[str, int]
) -> dict[str, object]:
    """Return how well a known stylistic model is learnt from its sequences.

    The subspace angle is the largest principal angle between true and learnt directions of the
    means, states matched by their generic means; v is compared through the best linear map, as
    only the space and not its axes are identifiable.
    """
    rng = np.random.default_rng([seed, round(1e6 * noise)])
    states, d, dof = settings["states"], settings["dimensions"], settings["style_dof"]
    model, directions = true_machine(rng, states, d, dof, noise)
    v = rng.normal(size=(settings["models"], dof))
    v -= v.mean(axis=0)
    sequences = [
        sample(model, model.means + directions @ one, settings["frames"], rng)[0] for one in v
    ]
    start = round(START_FACTOR * states)
    training = TrainingSettings(
        start,
        start="seeded",
        seed=seed,
        schedule=Schedule(
            start_temperature=20.0, steps=120, holding_final=0.05, trim_every=3, state_cost=1.0
        ),
    )
    found = train(sequences, training)
    occupied = found.generic.means
    cost = np.linalg.norm(occupied[:, None] - model.means[None], axis=-1)
    mine, theirs = linear_sum_assignment(cost)
    space = style_space(found.generic, found.specifics, dof, scale_blocks=False)
    learnt = (found.specifics.means - found.generic.means)[:, mine].reshape(len(v), -1)
    _, _, main = np.linalg.svd(learnt, full_matrices=False)
    truth = directions[theirs].reshape(-1, dof)
    angle = float(np.degrees(subspace_angles(main[:dof].T, truth).max()))
    coordinates = learnt @ main[:dof].T
    fit = coordinates @ np.linalg.lstsq(coordinates, v, rcond=None)[0]
    correlation = float(np.mean([np.corrcoef(fit[:, k], v[:, k])[0, 1] for k in range(dof)]))
    return {
        "seed": seed,
        "noise": noise_name,
        "noise_sd": noise,
        "states_true": states,
        "states_start": start,
        "states_found": found.states,
        "state_count_error": found.states - states,
        "subspace_angle_deg": angle,
        "v_correlation": abs(correlation),
        "explained_true_dof": float(space.shares[:dof].sum()),
    }
