"""Unseen takes: log-likelihood of ordinary, entropic and cross-entropy models, and retrieval.

Every style is learnt from its learning takes. Ordinary EM gives each style a model of its own that
knows nothing of the others; the entropic one as well, with the entropy prior; the cross-entropy
models are the specific models of one style machine.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.style_machines.cycles import mean_cycle, pose_distance_deg
from motionstyle.motion.motion import Motion
from motionstyle.shmm.features import learn_features
from motionstyle.shmm.inference import expectations, pack
from motionstyle.shmm.machine import MachineSettings, MotionMachine, learn_machine, prepared
from motionstyle.shmm.model import HiddenMarkovModel
from motionstyle.shmm.schedule import PLAIN
from motionstyle.shmm.style_space import analyse, style_space
from motionstyle.shmm.training import StyleMachine, floor_of, train

Array = NDArray[np.float64]
HELD_OUT_COLUMNS = (
    *("config", "data", "set", "test", "method", "style", "take", "motion", "frames"),
    *("loglik_nat_per_frame", "beats_ordinary", "found_style", "correct"),
)

OPENNESS = 1e-4


def individual_models(
    features: Sequence[Array], owners: Sequence[int], settings: MachineSettings, entropy: float
) -> list[HiddenMarkovModel]:
    """Return one model per owner, each learnt alone; `entropy` 0 for ordinary EM."""
    schedule = replace(PLAIN, steps=settings.schedule.steps)
    if entropy > 0:
        schedule = replace(
            settings.schedule,
            entropy=entropy,
            holding_hot=0.0,
            holding_roaming=0.0,
            holding_final=0.0,
        )
    training = replace(settings.training(), schedule=schedule)
    models = []
    for own in range(max(owners) + 1):
        mine = [f for f, o in zip(features, owners, strict=True) if o == own]
        shortest = max(len(f) for f in mine)
        states = min(training.states, shortest)
        found = train(mine, replace(training, states=states), owners=[0] * len(mine))
        models.append(found.generic)
    return models


def per_frame(model: HiddenMarkovModel, features: Array) -> float:
    """Return the log-likelihood per frame of one sequence, nat.

    A ten-thousandth of each row is spread over all states, for every method alike: trimmed
    transitions would forbid an order of states that was not seen.
    """
    spread = (1 - OPENNESS) * model.transitions + OPENNESS / model.states
    start = (1 - OPENNESS) * model.start + OPENNESS / model.states
    open_model = replace(model, start=start, transitions=spread)
    found = expectations(open_model, pack([features]))
    return float(found.log_likelihood[0]) / len(features)


def held_out_rows(
    learn: Mapping[str, Sequence[Motion]],
    tried: Mapping[str, Sequence[Motion]],
    settings: MachineSettings,
    facts: Mapping[str, object],
) -> list[dict[str, object]]:
    """Return the rows of one set: likelihoods of all methods, and style retrieval.

    learn, tried : motions by style.
    """
    styles = list(learn)
    motions = [m for s in styles for m in learn[s]]
    names = [s for s in styles for _ in learn[s]]
    machine = learn_machine(motions, names, settings)
    owners = [styles.index(n) for n in names]
    features = [machine.features.features(m) for m in machine.motions]
    ordinary = individual_models(features, owners, settings, 0.0)
    entropic = individual_models(features, owners, settings, 1.0)
    rows: list[dict[str, object]] = []
    unseen = [(s, prepared(m, settings)) for s in styles for m in tried[s]]
    learnt: StyleMachine = machine.machine
    for style, motion in unseen:
        x = machine.features.features(motion)
        own = styles.index(style)
        values = {
            "ordinary": per_frame(ordinary[own], x),
            "entropic": per_frame(entropic[own], x),
            "cross_entropy": per_frame(learnt.specifics[own], x),
        }
        for method, value in values.items():
            rows.append(
                {
                    **facts,
                    "test": "likelihood",
                    "method": method,
                    "style": style,
                    "motion": motion.id,
                    "frames": motion.frames,
                    "loglik_nat_per_frame": value,
                    "beats_ordinary": value > values["ordinary"],
                }
            )
    return rows + _retrieval(machine, styles, features, unseen, settings, facts)


def _retrieval(
    machine: MotionMachine,
    styles: Sequence[str],
    features: Sequence[Array],
    unseen: Sequence[tuple[str, Motion]],
    settings: MachineSettings,
    facts: Mapping[str, object],
) -> list[dict[str, object]]:
    """Return which style is found for each unseen take, by four methods.

    style_space : nearest coordinates v in the paper's degrees of freedom; style_space_all : in
    all directions; likelihood : the likeliest specific model; nearest_pose : the learning take
    whose mean gait cycle (else mean pose) is nearest.
    """
    learnt = machine.machine
    floor = floor_of(pack(features), settings.training())
    everything = style_space(learnt.generic, learnt.specifics, len(styles))
    owners = [styles[o] for o in learnt.owners]
    rows = []
    for style, motion in unseen:
        x = machine.features.features(motion)
        found = analyse([x], learnt, machine.space, floor=floor)
        v_all = everything.coordinates_of(found.model)
        likelihoods = [per_frame(learnt.specifics[r], x) for r in range(len(styles))]
        poses = [_pose_distance(motion, m) for m in machine.motions]
        answers = {
            "style_space": styles[_nearest(machine.space.coordinates, found.v)],
            "style_space_all": styles[_nearest(everything.coordinates, v_all)],
            "likelihood": styles[int(np.argmax(likelihoods))],
            "nearest_pose": owners[int(np.argmin(poses))],
        }
        for method, answer in answers.items():
            rows.append(
                {
                    **facts,
                    "test": "retrieval",
                    "method": method,
                    "style": style,
                    "motion": motion.id,
                    "frames": motion.frames,
                    "found_style": answer,
                    "correct": answer == style,
                }
            )
    return rows


def _nearest(coordinates: Array, v: Array) -> int:
    return int(np.argmin(((coordinates - v) ** 2).sum(axis=1)))


def _pose_distance(a: Motion, b: Motion) -> float:
    try:
        return pose_distance_deg(mean_cycle(a), mean_cycle(b))
    except MotionStyleError:
        difference = a.coordinates[:, 6:].mean(axis=0) - b.coordinates[:, 6:].mean(axis=0)
        return float(np.degrees(np.sqrt((difference**2).mean())))


def three_walks(
    learn: Sequence[Motion], tried: Sequence[Motion], settings: MachineSettings
) -> tuple[dict[str, float], dict[str, Array]]:
    """Return the numbers and the panels of Fig. 1: three walks in two principal components.

    Models: one for all, individual ones, and cross-entropy ones. The spread of states is the mean
    distance between states of one index relative to that between different states; individual
    models are compared as they come, for nothing makes their indices agree.
    """
    low = replace(settings, dimensions=2, hint_dimensions=2)
    learn = [prepared(m, settings) for m in learn]
    tried = [prepared(m, settings) for m in tried]
    space = learn_features(learn, 2, own_mean=settings.own_mean)
    x, unseen = [space.features(m) for m in learn], [space.features(m) for m in tried]
    machine = learn_machine(learn, [m.id for m in learn], low)
    training = settings.training()
    plain = replace(training, schedule=replace(PLAIN, steps=settings.schedule.steps))
    pooled = train(x, plain, owners=[0] * len(x)).generic
    alone = individual_models(x, list(range(len(x))), settings, 0.0)
    machine_x = [machine.features.features(m) for m in tried]
    specifics = machine.machine.specifics
    numbers = {
        "held_out_one_for_all": float(np.mean([per_frame(pooled, u) for u in unseen])),
        "held_out_individual": float(
            np.mean([per_frame(m, u) for m, u in zip(alone, unseen, strict=True)])
        ),
        "held_out_cross_entropy": float(
            np.mean([per_frame(specifics[r], u) for r, u in enumerate(machine_x)])
        ),
        "state_spread_individual": state_spread(np.stack([m.means for m in alone])),
        "state_spread_cross_entropy": state_spread(specifics.means),
    }
    panels = {f"walk_{r}": one for r, one in enumerate(x)}
    panels |= {
        "pooled_means": pooled.means,
        "pooled_covariances": pooled.covariances,
        "alone_means": np.stack([m.means for m in alone]),
        "alone_covariances": np.stack([m.covariances for m in alone]),
        "cross_means": specifics.means,
        "cross_covariances": specifics.covariances,
        "generic_means": machine.machine.generic.means,
        "generic_covariances": machine.machine.generic.covariances,
    }
    return numbers, panels


def state_spread(means: Array) -> float:
    """Return the mean distance of same-index states over that of different states, (R, N, d)."""
    centre = means.mean(axis=0)
    same = np.linalg.norm(means - centre, axis=-1).mean()
    between = np.linalg.norm(centre[:, None] - centre[None], axis=-1)
    n = len(centre)
    different = between[~np.eye(n, dtype=bool)].mean()
    return float(same / max(different, 1e-12))
