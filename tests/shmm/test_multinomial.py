"""Entropic rows against brute-force maximisation, the stationarity condition, and trimming."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from motionstyle.shmm.inference import expectations, pack
from motionstyle.shmm.model import HiddenMarkovModel, normalised
from motionstyle.shmm.multinomial import entropic_rows, row_entropies, trimmed


def objective(p, evidence, strength):
    p = np.maximum(p, 1e-300)
    return (evidence * np.log(p)).sum() + strength * (p * np.log(p)).sum()


def brute_force(evidence, strength, starts=40):
    rng = np.random.default_rng(0)
    best = -np.inf

    def softmax(z):
        e = np.exp(z - z.max())
        return e / e.sum()

    for _ in range(starts):
        found = minimize(
            lambda z: -objective(softmax(z), evidence, strength),
            rng.normal(size=len(evidence)) * 2,
            method="BFGS",
            options={"gtol": 1e-10},
        )
        if -found.fun > best:
            best, row = -found.fun, softmax(found.x)
    return row


@pytest.mark.parametrize(
    ("evidence", "strength"),
    [
        ([10, 5, 3], 1.0),
        ([10, 5, 3], -5.0),
        ([0.5, 0.2, 0.1], 1.0),  # the largest on the other branch
        ([0.3, 0.3, 0.3], 0.5),
        ([40, 1, 1, 0.2], 1.0),
        ([2.0, 1.0], -100.0),
    ],
)
def test_rows_are_the_brute_force_optimum(evidence, strength):
    evidence = np.array(evidence, dtype=float)
    found = entropic_rows(evidence[None], strength)[0]
    np.testing.assert_allclose(found, brute_force(evidence, strength), atol=2e-6)
    assert (
        objective(found, evidence, strength)
        >= objective(brute_force(evidence, strength), evidence, strength) - 1e-10
    )


def test_published_values_of_the_specification():
    np.testing.assert_allclose(
        entropic_rows([[10, 5, 3]], 1.0)[0], [0.568, 0.273, 0.159], atol=5e-4
    )
    np.testing.assert_allclose(
        entropic_rows([[10, 5, 3]], -5.0)[0], [0.507, 0.294, 0.199], atol=5e-4
    )
    np.testing.assert_allclose(
        entropic_rows([[0.5, 0.2, 0.1]], 1.0)[0], [0.914, 0.062, 0.024], atol=6e-4
    )


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.floats(1e-6, 1e5), min_size=2, max_size=8),
    st.floats(-100, 20).filter(lambda z: abs(z) > 1e-4),
)
# Where both branches of Lambert's function meet.
@example([1.0, 1e-6], 1.0)
# Evidence far above the prior.
@example([1.76766909e-4, 2.47632851, 3.53159482e4, 5.57865192e4, 8.83621146e4], 1.76766909e-4)
def test_rows_are_stationary(evidence, strength):
    evidence = np.array(evidence)
    row = entropic_rows(evidence[None], strength)[0]
    assert row.sum() == pytest.approx(1.0, abs=1e-12)
    live = row > 1e-200
    slope = evidence[live] / row[live] + strength * np.log(row[live])
    assert np.ptp(slope) <= 1e-8 * max(np.abs(slope).max(), 1.0)


def test_no_prior_gives_shares_and_more_of_it_less_entropy():
    evidence = np.array([[7.0, 2.0, 1.0, 0.0]])
    np.testing.assert_allclose(entropic_rows(evidence, 0.0), [[0.7, 0.2, 0.1, 0.0]])
    entropies = [
        row_entropies(entropic_rows(evidence, z))[0] for z in (-50, -5, -1, 0, 0.5, 1, 2, 5)
    ]
    assert (np.diff(entropies) < 0).all()
    assert entropies[0] == pytest.approx(np.log(3), abs=1e-2)


def test_rows_with_one_or_no_destination():
    found = entropic_rows(np.array([[0.0, 3.0, 0.0], [0.0, 0.0, 0.0]]), 1.0)
    np.testing.assert_allclose(found, [[0, 1, 0], [1 / 3, 1 / 3, 1 / 3]])


def test_each_row_has_its_own_strength():
    evidence = np.array([[10.0, 5.0, 3.0], [10.0, 5.0, 3.0]])
    together = entropic_rows(evidence, np.array([1.0, -5.0]))
    np.testing.assert_allclose(together[0], entropic_rows(evidence[:1], 1.0)[0])
    np.testing.assert_allclose(together[1], entropic_rows(evidence[1:], -5.0)[0])


def test_trimming_raises_the_log_posterior():
    """Algorithm E2 on random models near an optimum: no deletion may lower the posterior."""
    rng = np.random.default_rng(4)
    deleted = 0
    for _ in range(12):
        n = 5
        model = HiddenMarkovModel(
            normalised(np.ones(n)),
            normalised(rng.gamma(0.2, size=(n, n)) + 1e-3),
            rng.normal(size=(n, 2)) * 2,
            np.broadcast_to(np.eye(2) * 0.3, (n, 2, 2)).copy(),
        )
        packed = pack([rng.normal(size=(60, 2)) * 2])
        for _ in range(40):  # to the fixpoint of the transitions
            found = expectations(model, packed)
            model = model.with_transitions(entropic_rows(found.transitions.sum(0), 1.0))

        def posterior(p, model=model, packed=packed):
            return expectations(model.with_transitions(p), packed).log_likelihood.sum() - (
                row_entropies(p).sum()
            )

        found = expectations(model, packed)
        gone = trimmed(model.transitions, found.transitions.sum(0), 1.0)
        before = posterior(model.transitions)
        for row, column in np.argwhere(gone):
            p = model.transitions.copy()
            p[row, column] = 0.0
            assert posterior(normalised(p)) >= before - 1e-9
            deleted += 1
    assert deleted >= 5
    assert not trimmed(model.transitions, found.transitions.sum(0), 0.0).any()
