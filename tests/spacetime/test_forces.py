"""Contact forces: inside the cone, optimal, and with the right slope for the motion."""

import numpy as np
from scipy.optimize import lsq_linear

from motionstyle.spacetime.forces import cone_basis, eliminate_forces


def random_problem(frames=4, size=35, points=8):
    rng = np.random.default_rng(5)
    residuals = rng.standard_normal((frames, size))
    columns = rng.standard_normal((frames, size, 4 * points)) / 5
    bearing = rng.random((frames, points)) < 0.6
    bearing[0] = False
    return residuals, columns, bearing


def test_forces_of_the_basis_stay_in_the_friction_cone_of_any_plane():
    rng = np.random.default_rng(2)
    normals = rng.standard_normal((5, 8, 3)) * 0.3 + [0, 1, 0]
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    edges = cone_basis(normals, 0.8)
    force = np.einsum("fpc,fpca->fpa", rng.random((5, 8, 4)), edges)
    pressing = (force * normals).sum(-1)
    sliding = np.linalg.norm(force - pressing[..., None] * normals, axis=-1)
    assert (pressing > 0).all()
    assert (sliding <= 0.8 * pressing + 1e-12).all()
    np.testing.assert_allclose((edges * normals[:, :, None]).sum(-1), 1, atol=1e-12)


def test_coefficients_are_the_constrained_optimum():
    residuals, columns, bearing = random_problem()
    ridge = 1e-3
    found = eliminate_forces(residuals, columns, bearing, np.full((4, 32), ridge))
    for t in range(4):
        allowed = np.repeat(bearing[t], 4)
        assert (found.coefficients[t, ~allowed] == 0).all()
        if not allowed.any():
            np.testing.assert_array_equal(found.residuals[t], residuals[t])
            continue
        a = columns[t][:, allowed]
        stacked = np.concatenate([a, np.sqrt(ridge) * np.eye(a.shape[1])])
        wanted = np.concatenate([-residuals[t], np.zeros(a.shape[1])])
        other = lsq_linear(stacked, wanted, bounds=(0, np.inf), tol=1e-12)
        np.testing.assert_allclose(found.cost[t], other.cost, rtol=1e-8)


def test_the_slope_of_the_remaining_cost_is_the_remaining_residual():
    residuals, columns, bearing = random_problem()
    found = eliminate_forces(residuals, columns, bearing, np.full((4, 32), 1e-3))
    direction, step = np.random.default_rng(8).standard_normal(residuals.shape), 1e-6
    up = eliminate_forces(
        residuals + step * direction, columns, bearing, np.full((4, 32), 1e-3)
    ).cost
    down = eliminate_forces(
        residuals - step * direction, columns, bearing, np.full((4, 32), 1e-3)
    ).cost
    slope = (found.residuals * direction).sum(axis=1)
    np.testing.assert_allclose((up - down) / (2 * step), slope, atol=1e-6)


def test_the_curvature_is_that_of_the_remaining_cost():
    residuals, columns, bearing = random_problem()
    found = eliminate_forces(residuals, columns, bearing, np.full((4, 32), 1e-3))
    direction, step = np.random.default_rng(9).standard_normal(residuals.shape), 1e-5
    up = eliminate_forces(
        residuals + step * direction, columns, bearing, np.full((4, 32), 1e-3)
    ).residuals
    down = eliminate_forces(
        residuals - step * direction, columns, bearing, np.full((4, 32), 1e-3)
    ).residuals
    bend = np.einsum("frs,fs->fr", found.weights, direction)
    np.testing.assert_allclose((up - down) / (2 * step), bend, atol=1e-5)
