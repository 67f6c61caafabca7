"""The pull towards a motion that learning starts with."""

from dataclasses import replace

import numpy as np
import pytest

from motionstyle.body.layout import COORDINATE_INDEX
from motionstyle.errors import MotionStyleError
from motionstyle.spacetime.interior_point import InteriorPoint, SolverSettings
from motionstyle.spacetime.ipopt_referee import IpoptReferee
from motionstyle.spacetime.spacetime_problem import COUNT, Evaluator, Tracking
from spacetime_problems import bent, plain_style, standing_problem

FRAMES = 9
ELBOW = COORDINATE_INDEX["elbow_flexion_r"]


@pytest.fixture(scope="module")
def free(all_functions, plain_body, standing):
    q = bent(standing, FRAMES)
    style = plain_style(60, 5, rest=q[0, 6:] + 0.1)
    problem = standing_problem(all_functions, plain_body, q, style, gain=20.0)
    return replace(problem, keep_ends=0)


def solve(problem, standing):
    solver = InteriorPoint(Evaluator(problem), SolverSettings(tolerance=1e-8, barrier=1e-2))
    result = solver.solve(solver.start(problem.basis().fit(bent(standing, FRAMES))))
    assert result.status == "converged"
    return result


def tracked(free, standing, weight):
    wanted = bent(standing, FRAMES)
    wanted[:, ELBOW] += 0.05
    return replace(free, tracking=Tracking(wanted, np.full(COUNT, weight)))


def test_the_harder_the_pull_the_closer_the_motion(free, standing):
    away = []
    for weight in (1e3, 1e5, 1e7):
        problem = tracked(free, standing, weight)
        found = solve(problem, standing).values.coordinates
        away.append(np.abs(found - problem.tracking.coordinates)[:, ELBOW].max())
    assert away[0] > 5 * away[1] > 5 * away[2]


def test_the_optimum_is_stationary_for_energy_and_pull_together(free, standing):
    problem = tracked(free, standing, 1e3)
    result = solve(problem, standing)
    evaluator = Evaluator(problem)

    def cost(controls):
        values = evaluator.values(controls, result.coefficients)
        pull = problem.tracking.weights * (values.coordinates - problem.tracking.coordinates) ** 2
        return values.energy + (values.foot_residuals**2).sum() + pull.sum(), values.energy

    way = np.zeros_like(result.point.controls)
    way[3, ELBOW] = 1e-4  # a joint inside its range
    (up, up_energy), (down, down_energy) = (
        cost(result.point.controls + sign * way) for sign in (1, -1)
    )
    assert abs(up - down) < 1e-3 * abs(up_energy - down_energy)


def test_the_referee_refuses_a_pull(free, standing):
    with pytest.raises(MotionStyleError, match="tracking"):
        IpoptReferee(Evaluator(tracked(free, standing, 1.0)))
