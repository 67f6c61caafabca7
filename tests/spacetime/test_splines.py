"""Splines against polynomials and differences; banded against dense normal equations."""

import numpy as np
import pytest

from motionstyle.spacetime.splines import BandedSystem, SplineBasis


@pytest.mark.parametrize("frames", [8, 31, 62])
@pytest.mark.parametrize("per_knot", [1.5, 2.0, 2.5])
def test_a_cubic_comes_back_with_its_derivatives(frames, per_knot):
    basis = SplineBasis.uniform(frames, 30.0, per_knot)
    t = np.arange(frames) / 30.0
    cubic = np.stack([1 + t - 2 * t**2 + 0.5 * t**3, 3 - t**3], axis=1)
    q, qd, qdd = basis.evaluate(basis.fit(cubic))
    np.testing.assert_allclose(q, cubic, atol=1e-6)
    np.testing.assert_allclose(qd, np.stack([1 - 4 * t + 1.5 * t**2, -3 * t**2], 1), atol=1e-4)
    np.testing.assert_allclose(qdd[2:-2, 0], (-4 + 3 * t)[2:-2], atol=5e-3)


def test_derivatives_agree_with_differences_in_time():
    rate, fine = 30.0, 3000.0
    controls = np.random.default_rng(0).standard_normal((18, 3))
    coarse = SplineBasis.uniform(30, rate, 2.0)
    dense = SplineBasis.uniform(2901, fine, 200.0)
    q, qd, qdd = dense.evaluate(controls)
    np.testing.assert_allclose(q[::100], coarse.evaluate(controls)[0], atol=1e-9)
    np.testing.assert_allclose(qd[1:-1], (q[2:] - q[:-2]) * fine / 2, atol=2e-3)
    np.testing.assert_allclose(
        qdd[1:-1], (qd[2:] - qd[:-2]) * fine / 2, atol=5
    )  # bends jump at knots


def test_the_banded_system_is_the_dense_one():
    rng = np.random.default_rng(1)
    frames, n = 13, 3
    basis = SplineBasis.uniform(frames, 30.0, 2.0)
    factors = rng.standard_normal((frames, 3 * n, 3 * n))
    hessians = factors @ np.swapaxes(factors, 1, 2) * np.outer(s := np.repeat([1, 0.1, 0.01], n), s)
    gradients = rng.standard_normal((frames, 3 * n))
    dense = np.zeros((basis.controls * n, basis.controls * n))
    whole = np.zeros(basis.controls * n)
    for t in range(frames):
        map_t = np.zeros((3 * n, basis.controls * n))
        for d in range(3):
            for c in range(4):
                at = (basis.first[t] + c) * n
                map_t[d * n : (d + 1) * n, at : at + n] = basis.weights[t, d, c] * np.eye(n)
        dense += map_t.T @ hessians[t] @ map_t
        whole += map_t.T @ gradients[t]
    system = BandedSystem(basis, n)
    band, gradient = system.assemble(hessians, gradients)
    np.testing.assert_allclose(gradient.ravel(), whole, rtol=1e-10)
    damping = np.full(band.shape[1], 0.3)
    expected = np.linalg.solve(dense + np.diag(damping), -whole)
    np.testing.assert_allclose(system.solve(band, gradient, damping).ravel(), expected, atol=1e-8)
