"""Second derivatives against finite differences of the first-order functions and of kinematics."""

import numpy as np
import pytest

from motionstyle.body.kinematics import contact_points, forward_kinematics
from motionstyle.dynamics.symbols import parameter_vector


def dense(values, pattern, shape, symmetric=False):
    """The matrices (F, *shape) of nonzeros (F, n); of an upper triangle, the whole."""
    rows, columns = pattern
    found = np.zeros((len(values), *shape))
    found[:, rows, columns] = values
    if symmetric:
        assert (rows <= columns).all()
        found[:, columns, rows] = values
    return found


@pytest.fixture(scope="module")
def multipliers():
    rng = np.random.default_rng(8)
    return rng.standard_normal((5, 35)), rng.standard_normal((5, 24))


def test_curvature_is_the_slope_of_the_slopes(all_functions, plain_body, states, multipliers):
    call, body = all_functions["forces_and_slopes"], parameter_vector(plain_body)
    y = multipliers[0]

    def pull(q, qd, qdd, f):
        """Return yᵀ ∂τ/∂(q, q̇, q̈) and yᵀ ∂τ/∂f."""
        found = call(q, qd, qdd, f, body)
        sizes = (35, 35, 35, 24)
        parts = [
            np.einsum("fr,fru->fu", y, dense(found[k], call.pattern(k), (35, sizes[k - 1])))
            for k in range(1, 5)
        ]
        return np.concatenate(parts[:3], axis=1), parts[3]

    bend = all_functions["curvature"]
    found = bend(*states, y, body)
    hessian = dense(found[0], bend.pattern(0), (105, 105), symmetric=True)
    cross = dense(found[1], bend.pattern(1), (24, 35))
    rng, h = np.random.default_rng(9), 1e-6
    for _ in range(3):
        move = [rng.standard_normal(s.shape) for s in states[:3]]
        ahead, behind = (
            pull(*(s + sign * h * m for s, m in zip(states[:3], move, strict=True)), states[3])
            for sign in (1, -1)
        )
        by_state = np.einsum("fuv,fv->fu", hessian, np.concatenate(move, axis=1))
        by_force = np.einsum("fcq,fq->fc", cross, move[0])
        for exact, k in ((by_state, 0), (by_force, 1)):
            numeric = (ahead[k] - behind[k]) / (2 * h)
            np.testing.assert_allclose(exact, numeric, atol=1e-6 * np.abs(numeric).max())


def test_foot_points_are_those_of_the_kinematics(all_functions, plain_body, states):
    call, body, q = all_functions["foot_points"], parameter_vector(plain_body), states[0]
    points, nonzeros = call(q, body)
    expected = contact_points(plain_body, forward_kinematics(plain_body, q))
    np.testing.assert_allclose(points.reshape(-1, 8, 3), expected, atol=1e-12)
    slopes = dense(nonzeros, call.pattern(1), (24, 35))
    move, h = np.random.default_rng(3).standard_normal(q.shape), 1e-6
    numeric = (call(q + h * move, body)[0] - call(q - h * move, body)[0]) / (2 * h)
    np.testing.assert_allclose(np.einsum("fpq,fq->fp", slopes, move), numeric, atol=1e-8)


def test_foot_curvature_is_the_slope_of_the_points_slopes(
    all_functions, plain_body, states, multipliers
):
    points, body, q = all_functions["foot_points"], parameter_vector(plain_body), states[0]
    w, bend = multipliers[1], all_functions["foot_curvature"]
    hessian = dense(bend(q, w, body)[0], bend.pattern(0), (35, 35), symmetric=True)

    def pull(q):
        return np.einsum("fp,fpq->fq", w, dense(points(q, body)[1], points.pattern(1), (24, 35)))

    move, h = np.random.default_rng(4).standard_normal(q.shape), 1e-6
    numeric = (pull(q + h * move) - pull(q - h * move)) / (2 * h)
    np.testing.assert_allclose(np.einsum("fuv,fv->fu", hessian, move), numeric, atol=1e-7)
