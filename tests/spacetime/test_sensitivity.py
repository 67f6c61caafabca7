"""Derivatives of an optimum against finite differences of solves."""

from dataclasses import replace

import numpy as np
import pytest

from motionstyle.spacetime.interior_point import FORCE_UNIT, InteriorPoint, SolverSettings
from motionstyle.spacetime.sensitivity import sensitivity
from motionstyle.spacetime.spacetime_problem import Evaluator
from spacetime_problems import bent, plain_style, standing_problem

FRAMES = 9
CHOSEN = (6 + 29, 29 + 29 + 3, 4 * 29 + 2)  # a spring, a damper's neighbour, a rest angle


@pytest.fixture(scope="module")
def problem(all_functions, plain_body, standing):
    q = bent(standing, FRAMES)
    style = plain_style(60, 5, rest=q[0, 6:] + 0.05)
    return standing_problem(all_functions, plain_body, q, style, gain=20.0)


def solve(problem, start, coefficients=None):
    solver = InteriorPoint(Evaluator(problem), SolverSettings(tolerance=1e-9, barrier=1e-2))
    return solver.solve(solver.start(start, coefficients))


def gradients(problem, result):
    """∂E/∂u (F, 105) and ∂E/∂λ (F, 32) at a result's point, for another problem's style."""
    evaluator = Evaluator(problem)
    values = evaluator.values(result.point.controls, result.coefficients)
    slopes = evaluator.slopes(values)
    by_state = 2 * np.einsum("fru,fr->fu", slopes.by_state, values.residuals)
    by_force = 2 * np.einsum("fru,fr->fu", slopes.by_coefficients, values.residuals)
    return by_state, by_force


def test_an_optimum_moves_as_finite_differences_of_solves_say(problem, standing):
    start = problem.basis().fit(bent(standing, FRAMES))
    result = solve(problem, start)
    assert result.status == "converged"
    vector = problem.style.vector()
    blocks, moves, pushes = [], [], []
    for k in CHOSEN:
        h = 1e-3 * max(1.0, abs(vector[k]))
        pair = []
        for sign in (1, -1):
            other = vector.copy()
            other[k] += sign * h
            near = replace(problem, style=problem.style.with_vector(other))
            pair.append((gradients(near, result), solve(near, start)))
        (up, above), (down, below) = pair
        assert above.status == below.status == "converged"
        blocks.append([(a - b) / (2 * h) for a, b in zip(up, down, strict=True)])
        moves.append((above.point.controls - below.point.controls).ravel() / (2 * h))
        pushes.append((above.coefficients - below.coefficients) / (2 * h))
    by_state, by_force = (np.stack(part, axis=-1) for part in zip(*blocks, strict=True))
    found = sensitivity(Evaluator(problem), result, by_state, by_force)
    assert found.delta == 0.0
    for k in range(len(CHOSEN)):
        scale = np.abs(moves[k]).max()
        assert scale > 0
        np.testing.assert_allclose(found.controls[:, k], moves[k], atol=2e-3 * scale)
        away = np.abs(found.coefficients[..., k] - pushes[k]).max()
        assert away < 2e-2 * np.abs(pushes[k]).max() + 1e-6 * FORCE_UNIT
