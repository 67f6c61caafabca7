"""Checks of the paper's schematic figures, the seeds, the schedule, and phases without labels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.style_machines.cycles import cycle_starts
from motionstyle.evaluation.style_machines.held_out import state_spread
from motionstyle.motion.motion import Motion
from motionstyle.shmm.features import learn_features
from motionstyle.shmm.gaussians import Gaussians, Moments, divergences, entropies, estimate
from motionstyle.shmm.machine import MachineSettings, MotionMachine, learn_machine, prepared
from motionstyle.shmm.schedule import Schedule
from motionstyle.shmm.training import TrainingSettings, model_entropy, train

Array = NDArray[np.float64]
CHECK_COLUMNS = ("config", "data", "figure", "quantity", "value", "seed")
SENSITIVITY_COLUMNS = (
    *("config", "data", "set", "change", "value", "seed", "states", "transitions", "steps"),
    *("log_likelihood_nat_per_frame", "explained_3_dof", "state_spread", "phase_purity"),
)
PHASE_BINS = 8


def prior_ellipses() -> dict[str, Array]:
    """Return Gaussians of one cloud under growing priors (Fig. 2, eq. (17)).

    Keys: points, reference_*, entropy_* for Z = 0 … 60 and holding_* for Z′ = 0 … 200.
    """
    rng = np.random.default_rng(0)
    x = rng.multivariate_normal([0.0, 0.0], [[1.0, 0.6], [0.6, 0.8]], 40)
    reference = Gaussians(np.array([[2.0, 1.0]]), np.array([[[0.3, -0.1], [-0.1, 0.5]]]))
    sums = Moments(np.array([40.0]), x.sum(axis=0)[None], (x.T @ x)[None])
    floor = np.full(2, 1e-9)
    entropy = np.array([0.0, 5.0, 15.0, 30.0, 60.0])
    holding = np.array([0.0, 5.0, 20.0, 60.0, 200.0])
    cold = [estimate(sums, np.zeros(2), floor, reference, 0.0, z) for z in entropy]
    held = [estimate(sums, np.zeros(2), floor, reference, h) for h in holding]
    return {
        "points": x,
        "reference_mean": reference.means[0],
        "reference_covariance": reference.covariances[0],
        "entropy": entropy,
        "entropy_means": np.stack([g.means[0] for g in cold]),
        "entropy_covariances": np.stack([g.covariances[0] for g in cold]),
        "holding": holding,
        "holding_means": np.stack([g.means[0] for g in held]),
        "holding_covariances": np.stack([g.covariances[0] for g in held]),
    }


def prior_numbers(data: Mapping[str, Array]) -> dict[str, float]:
    """Return the shares of steps in which volume and divergence fall."""
    volumes = entropies(data["entropy_covariances"])
    reference = Gaussians(data["reference_mean"][None], data["reference_covariance"][None])
    away = [
        float(divergences(reference, Gaussians(m[None], k[None]))[0])
        for m, k in zip(data["holding_means"], data["holding_covariances"], strict=True)
    ]
    return {
        "share_volume_falls": float((np.diff(volumes) < 0).mean()),
        "share_divergence_falls": float((np.diff(away) < 0).mean()),
    }


def annealing_runs(
    features: Sequence[Array], states: int, seeds: Sequence[int], steps: int
) -> tuple[list[dict[str, object]], dict[str, Array]]:
    """Return final log-posteriors per frame with and without annealing, and their courses (Fig. 8).

    One entropic model of all sequences from random starts; both kinds of run end with the same
    objective, log p(X|θ) − H(θ), and get the same number of steps.
    """
    frames = sum(len(f) for f in features)
    rows: list[dict[str, object]] = []
    courses: dict[str, Array] = {}
    kinds = {
        "annealed": Schedule(steps=steps, start_temperature=20.0, decay=0.85, trim_above=2.0),
        "plain": Schedule(steps=steps, start_temperature=0.0, trim_above=2.0),
    }
    for kind, schedule in kinds.items():
        lines = []
        for seed in seeds:
            settings = TrainingSettings(states, start="random", seed=int(seed), schedule=schedule)
            found = train(features, settings, owners=[0] * len(features))
            course = np.full(steps, np.nan)
            for step in found.steps:
                course[step.step] = step.log_posterior / frames
            course[len(found.steps) :] = course[len(found.steps) - 1]
            lines.append(course)
            final = found.steps[-1].log_likelihood - model_entropy(found.generic)
            rows.append(
                {
                    "figure": "sm-F8",
                    "quantity": f"final_log_posterior_{kind}",
                    "value": final / frames,
                    "seed": seed,
                }
            )
        courses[kind] = np.array(lines)
    return rows, courses


def phase_purity(occupancy: Sequence[Array], motions: Sequence[Motion]) -> tuple[float, float]:
    """Return how well states separate eighths of the gait cycle, and the chance level.

    Purity: share of frames whose state's most frequent phase is their own. A state lies anywhere
    between two eighths, so that each state's phases are counted relative to its circular mean:
    a frame is right within ± 1/16 cycle of it. Chance: the same with states shuffled.
    """
    states, phases = [], []
    for gamma, motion in zip(occupancy, motions, strict=True):
        starts = cycle_starts(motion)
        if len(starts) < 2:
            continue
        frames = np.arange(motion.frames)
        phase = np.interp(frames, starts, np.arange(len(starts)))
        inside = (frames >= starts[0]) & (frames <= starts[-1])
        states.append(gamma.argmax(axis=1)[inside])
        phases.append(phase[inside] % 1.0)
    if not states:
        raise MotionStyleError("no gait cycle to tell phases by")
    state, phase = np.concatenate(states), np.concatenate(phases)

    def purity(labels: NDArray[np.int64]) -> float:
        right = 0
        for one in np.unique(labels):
            angles = 2 * np.pi * phase[labels == one]
            centre = np.angle(np.exp(1j * angles).mean())
            away = np.abs(np.angle(np.exp(1j * (angles - centre))))
            right += int((away <= np.pi / PHASE_BINS).sum())
        return right / len(labels)

    shuffled = np.random.default_rng(0).permutation(state)
    return purity(state), purity(shuffled)


def sensitivity_rows(
    motions: Sequence[Motion],
    settings: MachineSettings,
    changes: Sequence[Mapping[str, Any]],
    seeds: Sequence[int],
    facts: Mapping[str, object],
) -> list[dict[str, object]]:
    """Return rows for ten random starts, and for one change of the schedule at a time."""
    names = [m.id for m in motions]

    def row(machine: MotionMachine, change: str, value: object, seed: object) -> dict[str, object]:
        learnt = machine.machine
        frames = sum(len(g) for g in learnt.occupancy)
        shares = np.cumsum(machine.space.shares)
        purity, _ = phase_purity(learnt.occupancy, machine.motions)
        return {
            **facts,
            "change": change,
            "value": value,
            "seed": seed,
            "states": learnt.states,
            "transitions": int((learnt.generic.transitions > 0).sum()),
            "steps": len(learnt.steps),
            "log_likelihood_nat_per_frame": learnt.steps[-1].log_likelihood / frames,
            "explained_3_dof": float(shares[min(2, len(shares) - 1)]),
            "state_spread": state_spread(learnt.specifics.means),
            "phase_purity": purity,
        }

    rows = [row(learn_machine(motions, names, settings), "none", None, None)]
    for seed in seeds:
        random = replace(settings, start="random", seed=int(seed))
        rows.append(row(learn_machine(motions, names, random), "seed", None, seed))
    for change in changes:
        altered = replace(settings, schedule=replace(settings.schedule, **change))
        (name, value), *_ = change.items()
        rows.append(row(learn_machine(motions, names, altered), name, value, None))
    return rows


def pooled_features(motions: Sequence[Motion], settings: MachineSettings) -> list[Array]:
    """Return the features of motions for models of all of them."""
    ready = [prepared(m, settings) for m in motions]
    space = learn_features(ready, settings.dimensions, own_mean=settings.own_mean)
    return [space.features(m) for m in ready]
