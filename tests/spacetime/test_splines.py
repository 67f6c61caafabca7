"""Splines against polynomials and differences; banded against dense normal equations."""

import numpy as np
import pytest

from motionstyle.spacetime.splines import BandedSystem, Border, SplineBasis


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


def test_bordered_variables_are_those_of_the_dense_system_and_keep_their_bounds():
    rng = np.random.default_rng(2)
    frames, n, further = 11, 3, 2
    basis = SplineBasis.uniform(frames, 30.0, 2.0)
    size = basis.controls * n
    factors = rng.standard_normal((frames, 3 * n, 3 * n)) * np.repeat([1, 0.1, 0.01], n)
    system = BandedSystem(basis, n)
    gradients = rng.standard_normal((frames, 3 * n))
    band, gradient = system.assemble(np.swapaxes(factors, 1, 2) @ factors, gradients)
    damping = np.full(size, 0.5)
    dense = np.diag(damping)
    for offset in range(len(band)):
        values = band[len(band) - 1 - offset, offset:]
        dense += np.diag(values, offset) + (np.diag(values, -offset) if offset else 0)
    cross = system.gather(rng.standard_normal((frames, 3 * n, further)))
    own, pull = 1e3 * np.eye(further), rng.standard_normal(further)
    whole = np.block([[dense, cross], [cross.T, own]])
    expected = np.linalg.solve(whole, -np.concatenate([gradient.ravel(), pull]))
    free = (np.full(further, -9.0), np.full(further, 9.0))
    step, more = system.solve_bordered(band, gradient, damping, Border(cross, own, pull, free))
    np.testing.assert_allclose(step.ravel(), expected[:size], atol=1e-8)
    np.testing.assert_allclose(more, expected[size:], atol=1e-8)
    none = (np.zeros(further), np.zeros(further))
    step, more = system.solve_bordered(band, gradient, damping, Border(cross, own, pull, none))
    assert (more == 0).all()
    np.testing.assert_allclose(step, system.solve(band, gradient, damping), atol=1e-8)


@pytest.mark.parametrize("frames", [13, 14])
def test_the_first_and_last_poses_are_decided_by_the_control_points_at_the_ends(frames):
    basis = SplineBasis.uniform(frames, 30.0, 2.0)
    controls = np.random.default_rng(8).standard_normal((basis.controls, 2))
    kept, moved = basis.end_controls, controls + 1.0
    moved[:kept], moved[-kept:] = controls[:kept], controls[-kept:]
    before, after = basis.evaluate(controls)[0], basis.evaluate(moved)[0]
    np.testing.assert_allclose(after[[0, -1]], before[[0, -1]], atol=1e-12)
    moved[-kept] += 1.0  # one fewer would not do
    assert np.abs(basis.evaluate(moved)[0][-1] - before[-1]).max() > 1e-3
