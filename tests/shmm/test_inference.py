"""Forward–backward and Viterbi against hmmlearn and against enumeration of all paths."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from motionstyle.errors import MotionStyleError
from motionstyle.shmm.gaussians import estimate, moments
from motionstyle.shmm.inference import expectations, expectations_of, pack, viterbi
from motionstyle.shmm.model import HiddenMarkovModel, normalised, stack


def random_model(rng, states, dimensions, spread=2.0):
    roots = rng.normal(size=(states, dimensions, dimensions))
    return HiddenMarkovModel(
        normalised(rng.gamma(1.0, size=states)),
        normalised(rng.gamma(0.7, size=(states, states)) + 0.01),
        spread * rng.normal(size=(states, dimensions)),
        roots @ np.swapaxes(roots, 1, 2) + 0.5 * np.eye(dimensions),
    )


def enumerate_paths(model, x):
    """Return log-likelihood, occupancies, counts and best path by summing over all paths."""
    b = np.array(
        [
            [
                multivariate_normal.pdf(row, m, k)
                for m, k in zip(model.means, model.covariances, strict=True)
            ]
            for row in x
        ]
    )
    total, occupancy, counts = 0.0, np.zeros(b.shape), np.zeros(model.transitions.shape)
    best = (-1.0, None)
    for path in itertools.product(range(model.states), repeat=len(x)):
        p = model.start[path[0]] * b[0, path[0]]
        for t in range(1, len(x)):
            p *= model.transitions[path[t - 1], path[t]] * b[t, path[t]]
        total += p
        occupancy[np.arange(len(x)), path] += p
        for a, c in itertools.pairwise(path):
            counts[a, c] += p
        best = max(best, (p, path))
    return np.log(total), occupancy / total, counts / total, np.array(best[1])


def test_all_paths_of_tiny_models_give_the_same_numbers():
    rng = np.random.default_rng(1)
    lengths = (1, 2, 5)
    models = [random_model(rng, 3, 2) for _ in lengths]
    x = [rng.normal(size=(n, 2)) for n in lengths]
    packed = pack(x)
    found = expectations(stack(models), packed)
    paths = viterbi(stack(models), packed)
    for r, (model, one) in enumerate(zip(models, x, strict=True)):
        log_likelihood, occupancy, counts, path = enumerate_paths(model, one)
        assert found.log_likelihood[r] == pytest.approx(log_likelihood, abs=1e-10)
        np.testing.assert_allclose(found.occupancy[r, : len(one)], occupancy, atol=1e-10)
        assert not found.occupancy[r, len(one) :].any()
        np.testing.assert_allclose(found.transitions[r], counts, atol=1e-10)
        np.testing.assert_array_equal(paths[r], path)


@pytest.mark.parametrize("implementation", ["scaling", "log"])
def test_hmmlearn_agrees_on_likelihood_posteriors_paths_and_one_step(implementation):
    hmm = pytest.importorskip("hmmlearn.hmm")
    rng = np.random.default_rng(2)
    model = random_model(rng, 6, 4)
    x = [rng.normal(size=(n, 4)) * 2 for n in (40, 71, 25)]
    referee = hmm.GaussianHMM(
        6, "full", implementation=implementation, n_iter=1, init_params="", min_covar=0,
        covars_prior=0, covars_weight=4, means_weight=0,
    )  # fmt: skip
    referee.startprob_, referee.transmat_ = model.start, model.transitions
    referee.means_, referee.covars_ = model.means, model.covariances
    joined, lengths = np.concatenate(x), [len(one) for one in x]
    packed = pack(x)
    found = expectations(model, packed)
    log_likelihood, posteriors = referee.score_samples(joined, lengths)
    assert found.log_likelihood.sum() == pytest.approx(log_likelihood, abs=1e-8)
    np.testing.assert_allclose(np.concatenate(packed.split(found.occupancy)), posteriors, atol=1e-8)
    _, path = referee.decode(joined, lengths)
    np.testing.assert_array_equal(np.concatenate(viterbi(model, packed)), path)
    referee.fit(joined, lengths)
    sums = moments(found.occupancy, packed).pooled()
    step = estimate(sums, packed.centre, np.full(4, 1e-12), model)
    np.testing.assert_allclose(step.means, referee.means_, atol=1e-8)
    np.testing.assert_allclose(step.covariances, referee.covars_, atol=1e-8)
    counts = found.transitions.sum(axis=0)
    np.testing.assert_allclose(normalised(counts), referee.transmat_, atol=1e-8)
    np.testing.assert_allclose(
        normalised(found.occupancy[:, 0].sum(axis=0)), referee.startprob_, atol=1e-8
    )


def test_one_shared_matrix_and_a_stack_of_equal_ones_agree():
    rng = np.random.default_rng(3)
    model = random_model(rng, 5, 3)
    packed = pack([rng.normal(size=(n, 3)) for n in (30, 12, 1)])
    one, many = expectations(model, packed), expectations(stack([model] * 3), packed)
    np.testing.assert_allclose(one.log_likelihood, many.log_likelihood, rtol=1e-12)
    np.testing.assert_allclose(one.occupancy, many.occupancy, atol=1e-12)
    np.testing.assert_allclose(one.transitions, many.transitions, atol=1e-12)


def test_frames_far_from_every_reachable_state_do_not_underflow():
    """Left-to-right models meet frames whose best state cannot be reached yet."""
    chain = np.diag([0.5, 0.5, 1.0]) + np.diag([0.5, 0.5], 1)
    model = HiddenMarkovModel(
        np.array([1.0, 0.0, 0.0]), chain, np.array([[0.0], [1.0], [2.0]]), np.full((3, 1, 1), 1e-6)
    )
    packed = pack([np.array([[2.0], [2.0], [0.0], [0.0]])])
    found = expectations(model, packed)
    assert np.isfinite(found.log_likelihood).all()
    np.testing.assert_allclose(found.occupancy.sum(axis=2), 1.0)
    assert found.transitions.sum() == pytest.approx(3.0)


def test_a_sequence_no_path_can_make_is_an_error():
    log_b = np.zeros((1, 3, 2))
    transitions = np.array([[0.0, 0.0], [0.0, 1.0]])  # nothing leaves the start state
    with pytest.raises(MotionStyleError, match="cannot come from its model"):
        expectations_of(np.array([1.0, 0.0]), transitions, log_b, np.array([3]))


@pytest.mark.parametrize(
    ("sequences", "message"),
    [
        ([], "no sequence"),
        ([np.zeros((0, 2))], "shape"),
        ([np.zeros((3, 2)), np.zeros((3, 1))], "expected frames x 2"),
        ([np.full((3, 2), np.nan)], "no number"),
    ],
)
def test_unusable_sequences_are_refused(sequences, message):
    with pytest.raises(MotionStyleError, match=message):
        pack(sequences)
