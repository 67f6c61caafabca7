"""Gaussian estimators against numerical minimisation of the objective and Monte Carlo."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import multivariate_normal

from motionstyle.shmm.gaussians import (
    Gaussians,
    Moments,
    divergences,
    entropies,
    estimate,
    moments,
    raised,
)
from motionstyle.shmm.inference import pack


def sums_of(x, weights):
    return Moments(
        np.array([weights.sum()]),
        (weights[:, None] * x).sum(0)[None],
        np.einsum("t,ta,tb->ab", weights, x, x)[None],
    )


@pytest.mark.parametrize(
    ("n", "entropy", "holding"), [(32, 1.0, 1.0), (30, 5.0, 20.0), (28, -10.0, 3.0), (4, 0.0, 0.5)]
)
def test_estimates_minimise_the_objective(n, entropy, holding):
    """Eqs. (16), (17) against BFGS on −log p + Z H(θ) + Z′ D(θ•‖θ) with the corrected (15)."""
    rng = np.random.default_rng(5)
    d = 2
    x, weights = rng.normal(size=(n, d)) * [1.0, 2.0] + 1.0, rng.uniform(0.2, 1.0, n)
    root = rng.normal(size=(d, d))
    reference = Gaussians(rng.normal(size=(1, d)), (root @ root.T + np.eye(d))[None])
    found = estimate(
        sums_of(x, weights), np.zeros(d), np.full(d, 1e-9), reference, holding, entropy
    )
    lower = np.tril_indices(d)

    def unpack(z):
        factor = np.zeros((d, d))
        factor[lower] = z[d:]
        return z[:d], factor @ factor.T

    def loss(z):
        mean, covariance = unpack(z)
        own = Gaussians(mean[None], covariance[None])
        data = -(weights * multivariate_normal.logpdf(x, mean, covariance)).sum()
        return data + entropy * entropies(covariance) + holding * divergences(reference, own)[0]

    start = np.concatenate([[0, 0], np.linalg.cholesky(np.cov(x.T))[lower]])
    best = minimize(loss, start, method="BFGS", options={"gtol": 1e-9})
    mean, covariance = unpack(best.x)
    np.testing.assert_allclose(found.means[0], mean, atol=2e-5)
    np.testing.assert_allclose(found.covariances[0], covariance, atol=2e-4)


def test_divergence_is_the_kullback_leibler_divergence():
    rng = np.random.default_rng(6)
    reference = Gaussians(np.array([[0.3, -0.2]]), np.array([[[1.0, 0.4], [0.4, 0.8]]]))
    own = Gaussians(np.array([[0.0, 0.5]]), np.array([[[0.6, -0.1], [-0.1, 1.5]]]))
    x = rng.multivariate_normal(reference.means[0], reference.covariances[0], 200_000)
    difference = multivariate_normal.logpdf(x, reference.means[0], reference.covariances[0])
    difference -= multivariate_normal.logpdf(x, own.means[0], own.covariances[0])
    error = difference.std() / np.sqrt(len(x))
    assert divergences(reference, own)[0] == pytest.approx(difference.mean(), abs=5 * error)
    assert divergences(own, own)[0] == pytest.approx(0.0, abs=1e-12)


def test_limits_of_the_priors():
    """A strong holding gives the reference; a growing entropy prior shrinks the volume."""
    rng = np.random.default_rng(7)
    x, weights = rng.normal(size=(20, 2)), np.ones(20)
    reference = Gaussians(np.array([[3.0, 3.0]]), np.array([np.eye(2) * 0.5]))
    args = (sums_of(x, weights), np.zeros(2), np.full(2, 1e-6), reference)
    held = estimate(*args, 1e9)
    np.testing.assert_allclose(held.means, reference.means, atol=1e-6)
    np.testing.assert_allclose(held.covariances, reference.covariances, atol=1e-5)
    volumes = [entropies(estimate(*args, 0.0, z).covariances)[0] for z in (-18, -5, 0, 1, 5, 20)]
    assert (np.diff(volumes) < 0).all()
    away = [divergences(reference, estimate(*args, h))[0] for h in (0.0, 1.0, 5.0, 25.0, 100.0)]
    assert (np.diff(away) < 0).all()


@pytest.mark.parametrize("hot", [0.0, -50.0])
def test_starved_one_frame_and_identical_states_stay_finite(hot):
    """Fault 11: no evidence, one frame, equal frames: the reference, or the floor; never NaN."""
    packed = pack([np.array([[1.0, 2.0], [1.0, 2.0], [5.0, 5.0]])])
    occupancy = np.zeros((1, 3, 3))
    occupancy[0, :2, 0] = 1.0  # two identical frames
    occupancy[0, 2, 1] = 1.0  # one frame; nothing in the third state
    reference = Gaussians(np.zeros((3, 2)), np.broadcast_to(np.eye(2), (3, 2, 2)))
    floor = np.array([1e-4, 1e-2])
    sums = moments(occupancy, packed).pooled()
    found = estimate(sums, packed.centre, floor, reference, 0.0, hot)
    np.testing.assert_allclose(found.means, [[1, 2], [5, 5], [0, 0]], atol=1e-12)
    np.testing.assert_allclose(found.covariances[:2], [np.diag(floor)] * 2, atol=1e-12)
    np.testing.assert_allclose(found.covariances[2], np.eye(2))


def test_raising_leaves_good_covariances_alone():
    good = np.array([[[2.0, 0.3], [0.3, 1.0]]])
    np.testing.assert_array_equal(raised(good, np.full(2, 1e-3)), good)
    singular = raised(np.array([[[1.0, 1.0], [1.0, 1.0]]]), np.full(2, 1e-3))
    np.testing.assert_allclose(np.linalg.eigvalsh(singular[0]), [1e-3, 2.0], atol=1e-12)
