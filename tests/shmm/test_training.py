"""Training: where the objective must rise, what survives bad data, known models learnt again."""

from __future__ import annotations

import numpy as np
import pytest

from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.style_machines.twins import twin_row
from motionstyle.shmm.gaussians import divergences, estimate, moments
from motionstyle.shmm.inference import expectations, pack
from motionstyle.shmm.model import HiddenMarkovModel, normalised, repeat
from motionstyle.shmm.schedule import PLAIN, Schedule
from motionstyle.shmm.training import (
    TrainingSettings,
    floor_of,
    initial_model,
    model_entropy,
    train,
)


def gaits(count=3, frames=120, noise=0.03):
    """Return loops of different size, pace and start, as styled walks are in feature space."""
    rng = np.random.default_rng(13)
    found = []
    for r in range(count):
        phase = np.cumsum(np.full(frames, 2 * np.pi / (36 + 4 * r))) + rng.uniform(0, 6)
        loop = [np.cos(phase) * (1 + 0.2 * r), np.sin(phase), 0.3 * np.cos(2 * phase) + 0.1 * r]
        found.append(np.stack(loop, axis=1) + rng.normal(scale=noise, size=(frames, 3)))
    return found


@pytest.mark.parametrize(
    ("schedule", "label"),
    [
        (PLAIN, "ordinary EM"),
        (Schedule(start_temperature=0.0, trim_above=9.0, holding_final=0.0), "entropic MAP-EM"),
    ],
)
def test_the_objective_never_falls_at_constant_strength(schedule, label):
    settings = TrainingSettings(10, schedule=schedule, start_prior=0.0)
    found = train(gaits(), settings, owners=[0, 0, 0])
    course = np.array([s.log_posterior for s in found.steps])
    assert len(course) > 5, label
    assert (np.diff(course) > -1e-8 * np.abs(course[:-1])).all(), label


def test_cross_entropy_em_never_lowers_the_penalised_likelihood():
    """One specific model against a fixed reference with a fixed Z′: MAP-EM, so monotone."""
    x = pack(gaits(1))
    reference = initial_model(x, TrainingSettings(8))
    model, floor, strength, values = reference, np.full(3, 1e-9), 5.0, []
    for _ in range(25):
        found = expectations(model, x)
        penalty = strength * divergences(reference, model).sum()
        values.append(float(found.log_likelihood.sum() - penalty))
        sums = moments(found.occupancy, x).pooled()
        best = estimate(sums, x.centre, floor, reference, strength)
        model = HiddenMarkovModel(
            normalised(found.occupancy[0, 0]),
            normalised(found.transitions.sum(axis=0)),
            best.means,
            best.covariances,
        )
    assert (np.diff(values) > -1e-8).all()


def test_states_of_different_models_mean_the_same_only_with_the_prior():
    def spread(schedule):
        means = train(gaits(), TrainingSettings(10, schedule=schedule)).specifics.means
        centre = means.mean(axis=0)
        between = np.linalg.norm(centre[:, None] - centre[None], axis=-1)
        return np.linalg.norm(means - centre, axis=-1).mean() / between.mean()

    light = Schedule(start_temperature=2.0, steps=40)
    assert spread(light) < 0.7 * spread(PLAIN)


def test_training_makes_occupancies_certain_and_trims_transitions():
    found = train(gaits(), TrainingSettings(12, schedule=Schedule(start_temperature=2.0, steps=60)))
    first, last = found.steps[0], found.steps[-1]
    assert last.transitions < 0.5 * first.transitions
    gamma = np.concatenate(found.occupancy)
    np.testing.assert_allclose(gamma.sum(axis=1), 1.0, atol=1e-9)
    assert np.quantile(gamma.max(axis=1), 0.2) > 0.9
    assert all(
        s.temperature == pytest.approx(2.0 * 0.9**s.step) or s.temperature == 0 for s in found.steps
    )


@pytest.mark.parametrize(
    "sequences",
    [
        [np.zeros((30, 2))] * 2,  # all frames equal
        [np.repeat([[0.0, 1.0]], 30, axis=0), np.random.default_rng(1).normal(size=(30, 2))],
        [np.random.default_rng(2).normal(size=(30, 1)) * [1.0, 0.0]] * 3,  # a constant joint
        [np.random.default_rng(3).normal(size=(40, 2)), np.ones((1, 2))],  # a one-frame clip
    ],
    ids=["equal frames", "one still clip", "constant joint, identical clips", "one frame"],
)
@pytest.mark.parametrize("schedule", [PLAIN, Schedule(steps=25, start_temperature=20.0)])
def test_degenerate_data_never_give_nan(sequences, schedule):
    """Fault 11: hmmlearn ends such trainings with NaN or an exception."""
    found = train(sequences, TrainingSettings(10, schedule=schedule))
    for model in (found.generic, found.specifics):
        for part in (model.start, model.transitions, model.means, model.covariances):
            assert np.isfinite(part).all()
        assert (np.linalg.eigvalsh(model.covariances) > 0).all()
    assert np.isfinite([s.log_posterior for s in found.steps]).all()
    assert all(np.isfinite(gamma).all() for gamma in found.occupancy)


def test_fewer_frames_than_states_is_one_clear_error():
    with pytest.raises(MotionStyleError, match="40 states cannot be started from 30 frames"):
        train([np.random.default_rng(0).normal(size=(30, 2))], TrainingSettings(40))


def test_owners_must_be_numbered_without_gaps():
    with pytest.raises(MotionStyleError, match="must name models 0 to 2"):
        train(gaits(), TrainingSettings(5), owners=[0, 2, 2])


def test_one_sequence_alone_can_be_learnt():
    found = train(gaits(1), TrainingSettings(8, schedule=Schedule(start_temperature=2.0, steps=30)))
    assert found.specifics.means.shape == (1, found.states, 3)


def test_the_same_seed_gives_the_same_bits():
    settings = TrainingSettings(8, start="random", seed=5, schedule=Schedule(steps=15))
    one, two = train(gaits(), settings), train(gaits(), settings)
    np.testing.assert_array_equal(one.specifics.means, two.specifics.means)
    other = train(gaits(), TrainingSettings(8, start="random", seed=6, schedule=Schedule(steps=15)))
    assert not np.array_equal(one.generic.means, other.generic.means)


def test_merging_removes_a_state_that_stands_for_another_one():
    x = pack(gaits(2))
    schedule = Schedule(steps=40, start_temperature=2.0, state_cost=1.0)
    found = train(gaits(2, noise=0.3), TrainingSettings(30, schedule=schedule))
    assert found.states < 30
    assert floor_of(x, TrainingSettings(8)).shape == (3,)
    assert np.isfinite(model_entropy(found.generic))


def test_known_stylistic_models_are_learnt_again():
    """E9 in small: the style vectors and the state count come back at low noise."""
    sizes = {"states": 6, "dimensions": 3, "style_dof": 1, "models": 5, "frames": 150}
    row = twin_row(1, "low", 0.05, sizes)
    assert row["v_correlation"] > 0.95
    assert abs(row["state_count_error"]) <= 1


def test_schedules_have_three_phases():
    schedule = Schedule(start_temperature=20.0, decay=0.5)
    assert schedule.holding(0) == schedule.holding_hot
    assert schedule.strength(0) == -19.0
    step = next(k for k in range(30) if schedule.temperature(k) < 1.0)
    assert schedule.holding(step) == schedule.holding_roaming
    assert schedule.holding(60) == schedule.holding_final
    assert schedule.settled(60)
    assert schedule.strength(60) == 1.0


def test_stacks_hold_copies():
    model = initial_model(pack(gaits(1)), TrainingSettings(5))
    assert repeat(model, 3).means.shape == (3, 5, 3)
