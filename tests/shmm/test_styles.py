"""Style space, full poses, timing, choreography and path maps."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from motionstyle.errors import MotionStyleError
from motionstyle.shmm.choreography import joined, moves_of, primitives, random_walk
from motionstyle.shmm.inference import pack
from motionstyle.shmm.model import HiddenMarkovModel, dwell_times, normalised, repeat
from motionstyle.shmm.path_map import cue_model, drive
from motionstyle.shmm.poses import (
    RemapSettings,
    mean_dwell,
    path_occupancy,
    remap,
    restyled,
    styled_poses,
    synthesise,
    visits,
    warped_occupancy,
)
from motionstyle.shmm.schedule import Schedule
from motionstyle.shmm.style_space import (
    analyse,
    from_signed_roots,
    signed_roots,
    style_space,
    styled_model,
    with_dwell,
)
from motionstyle.shmm.training import TrainingSettings, floor_of, train


def ring(states=5, d=3, stay=0.7):
    rng = np.random.default_rng(14)
    transitions = stay * np.eye(states) + (1 - stay) * np.roll(np.eye(states), 1, axis=1)
    covariances = np.broadcast_to(np.eye(d) * 0.04, (states, d, d)).copy()
    return HiddenMarkovModel(
        np.full(states, 1 / states), transitions, rng.normal(size=(states, d)), covariances
    )


def specifics(generic, v, directions):
    stack = repeat(generic, len(v))
    moved = stack.means + np.einsum("rs,nds->rnd", v, directions)
    return HiddenMarkovModel(stack.start, stack.transitions, moved, stack.covariances)


def test_planted_directions_are_found_and_explain_everything():
    rng = np.random.default_rng(15)
    generic, directions = ring(), rng.normal(size=(5, 3, 2))
    v = rng.normal(size=(6, 2))
    space = style_space(generic, specifics(generic, v, directions), 2)
    assert space.shares[:2].sum() == pytest.approx(1.0)
    assert space.shares[0] < 1 - 1e-3
    fit = space.coordinates @ np.linalg.lstsq(space.coordinates, v, rcond=None)[0]
    np.testing.assert_allclose(fit, v, atol=1e-9)


def test_a_specific_model_comes_back_from_its_coordinates():
    rng = np.random.default_rng(16)
    generic = ring()
    models = specifics(generic, rng.normal(size=(4, 2)), rng.normal(size=(5, 3, 2)))
    space = style_space(generic, models, 4)
    again = styled_model(space, generic, space.coordinates[2], np.full(3, 1e-6))
    np.testing.assert_allclose(again.means, models[2].means, atol=1e-9)
    np.testing.assert_allclose(again.covariances, models[2].covariances, atol=1e-9)
    np.testing.assert_allclose(dwell_times(again), dwell_times(models[2]), atol=1e-9)
    np.testing.assert_allclose(space.coordinates_of(models[2]), space.coordinates[2], atol=1e-9)
    np.testing.assert_allclose(space.weights(space.coordinates[2]), np.eye(4)[2], atol=0.6)
    exact = space.weights(space.coordinates[2]) @ space.coordinates
    np.testing.assert_allclose(exact, space.coordinates[2], atol=1e-9)


def test_extrapolated_covariances_stay_positive_definite():
    roots = signed_roots(np.array([[1.0, 0.9], [0.9, 1.0]]))
    wild = 3 * roots - 2 * signed_roots(np.array([[1.0, -0.5], [-0.5, 2.0]]))
    assert (np.linalg.eigvalsh(from_signed_roots(wild, np.full(2, 1e-4))) > 0).all()
    kept = np.array([[1.0, 0.3], [0.3, 0.5]])
    np.testing.assert_allclose(from_signed_roots(signed_roots(kept), np.full(2, 1e-9)), kept)


def test_more_style_dof_than_models_is_one_clear_error():
    generic = ring()
    with pytest.raises(MotionStyleError, match="3 style degrees of freedom cannot be had from 2"):
        style_space(generic, repeat(generic, 2), 3)


def test_dwell_sets_the_self_transitions():
    transitions = with_dwell(ring().transitions, np.array([1.0, 2.0, 4.0, 5.0, 10.0]))
    np.testing.assert_allclose(np.diagonal(transitions), [0, 0.5, 0.75, 0.8, 0.9])
    np.testing.assert_allclose(transitions.sum(axis=1), 1.0)


def loops(sizes, frames=90, period=30):
    phase = 2 * np.pi * np.arange(frames) / period
    return [
        np.stack([s * np.cos(phase), s * np.sin(phase), 0.1 * s + 0 * phase], axis=1) for s in sizes
    ]


@pytest.fixture(scope="module")
def learnt():
    x = loops([1.0, 1.5, 2.0])
    machine = train(x, TrainingSettings(10, schedule=Schedule(start_temperature=2.0, steps=40)))
    settings = RemapSettings(prior_frames=0.01, covariance_frames=5.0, shrinkage=0.05)
    return x, machine, remap(x, machine.occupancy, machine.owners, settings)


def test_own_style_and_content_give_the_own_motion(learnt):
    x, machine, poses = learnt
    y = synthesise(poses, machine.occupancy[1], styled_poses(poses, np.eye(3)[1]))
    assert np.sqrt(((y - x[1]) ** 2).mean()) < 0.1


def test_mixing_two_styles_gives_the_size_between_and_beyond(learnt):
    _, machine, poses = learnt
    sizes = []
    for w in ([0.5, 0.0, 0.5], [-0.5, 0.0, 1.5]):
        y, _ = restyled(poses, machine.occupancy[1], 1, np.array(w))
        sizes.append(np.linalg.norm(y[:, :2], axis=1).mean())
    assert sizes[0] == pytest.approx(1.5, rel=0.08)
    assert sizes[1] == pytest.approx(2.5, rel=0.08)


def test_new_data_of_a_known_style_lie_near_it(learnt):
    _, machine, _ = learnt
    space = style_space(machine.generic, machine.specifics, 2)
    fresh = loops([1.5], frames=75)[0][12:]
    floor = floor_of(pack(loops([1.0, 1.5, 2.0])), TrainingSettings(10))
    found = analyse([fresh], machine, space, floor=floor)
    distances = np.linalg.norm(space.coordinates - found.v, axis=1)
    assert distances.argmin() == 1
    assert np.isfinite(found.log_likelihood)


def test_timing_follows_the_sum_of_scaled_dwells():
    path = np.repeat([0, 1, 0], [4, 6, 4])
    gamma = np.eye(2)[path]
    longer = warped_occupancy(gamma, np.array([4.0, 6.0]), np.array([8.0, 3.0]))
    states = [(s, b - a + 1) for s, a, b in visits(longer.argmax(axis=1))]
    assert states == [(0, 8), (1, 3), (0, 8)]
    same = warped_occupancy(gamma, np.array([4.0, 6.0]), np.array([4.0, 6.0]))
    np.testing.assert_array_equal(same, gamma)
    assert len(path_occupancy([0, 1, 0], np.array([2.5, 1.5]))) == 6


def test_cut_visits_count_only_where_nothing_else_is_known():
    frames, stays = mean_dwell([np.array([0, 0, 1, 1, 1, 0, 0, 0, 2])], 4)
    np.testing.assert_array_equal(frames, [3, 3, 1, 0])
    np.testing.assert_array_equal(stays, [1, 1, 1, 0])


def test_wrong_number_of_weights_or_frames_is_refused(learnt):
    x, machine, poses = learnt
    with pytest.raises(MotionStyleError, match="needs 3 weights"):
        styled_poses(poses, np.ones(2))
    with pytest.raises(MotionStyleError, match="one occupancy for each frame"):
        remap([x[0][:-1]], machine.occupancy[:1], np.zeros(1, dtype=int), RemapSettings())


def test_walks_and_pieces_only_use_arcs_that_exist():
    transitions = ring(6).transitions
    transitions[2] = normalised(np.array([0, 0, 0.5, 0.2, 0.3, 0]))
    walk = random_walk(transitions, 0, 40, seed=3)
    assert len(walk) == 40
    assert all(transitions[a, b] > 0 for a, b in itertools.pairwise(walk))
    assert walk == random_walk(transitions, 0, 40, seed=3)
    way = joined(transitions, [[0, 1], [5, 0]])
    assert way[:2] == [0, 1]
    assert way[-2:] == [5, 0]
    assert all(transitions[a, b] > 0 for a, b in itertools.pairwise(way))


def test_pieces_that_no_path_joins_are_an_error():
    transitions = np.array([[0.5, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    with pytest.raises(MotionStyleError, match="no path of transitions leads from state 1 to 2"):
        joined(transitions, [[0, 1], [2]])
    assert random_walk(transitions, 0, 10, seed=0) == [0, 1]


def test_reused_runs_of_states_are_the_primitives():
    path = np.repeat([0, 1, 2, 0, 1, 2, 5, 6, 7], 3)
    assert moves_of(path) == [0, 1, 2, 0, 1, 2, 5, 6, 7]
    assert primitives([path], 3, 2) == [(0, 1, 2), (5, 6, 7)]


def test_a_cue_drives_the_states_it_was_seen_with(learnt):
    x, machine, _ = learnt
    mix = np.random.default_rng(17).normal(size=(3, 4))
    cues = [one @ mix for one in x]
    model = cue_model(machine.generic, cues, machine.occupancy)
    driven = drive(model, cues[1])
    agree = (driven.argmax(axis=1) == machine.occupancy[1].argmax(axis=1)).mean()
    assert agree > 0.8
