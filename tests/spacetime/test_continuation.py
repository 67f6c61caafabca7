"""Steep springs by way of gentler ones: only the last stage counts, all are recorded."""

import numpy as np
import pytest

from motionstyle.spacetime.continuation import solve_spacetime
from motionstyle.spacetime.interior_point import FORCE_UNIT, InteriorPoint, SolverSettings
from motionstyle.spacetime.spacetime_problem import Evaluator
from spacetime_problems import bent, plain_style, standing_problem

FRAMES = 9


@pytest.fixture(scope="module")
def problem(all_functions, plain_body, standing):
    q = bent(standing, FRAMES)
    style = plain_style(60, 5, rest=q[0, 6:] + 0.01)
    return standing_problem(all_functions, plain_body, q, style, gain=500.0)


@pytest.fixture(scope="module")
def start(problem, standing):
    return problem.basis().fit(bent(standing, FRAMES))


@pytest.fixture(scope="module")
def told():
    return []


@pytest.fixture(scope="module")
def result(problem, start, told):
    return solve_spacetime(problem, start, log=told.append)


def test_the_last_stage_is_the_problem_itself(result, problem, told):
    stages = [line for line in told if line.startswith("sigmoid gain")]
    ways = ((20, 1), (100, 1), (500, 100))
    assert stages == [f"sigmoid gain {g}/rad, root weight {w}" for g, w in ways]
    assert result.status == "converged"
    evaluator = Evaluator(problem)
    own = evaluator.values(result.point.controls, result.point.coefficients * FORCE_UNIT)
    assert own.energy == result.values.energy
    system = InteriorPoint(evaluator, SolverSettings()).system
    error = system.errors(result.point, own, evaluator.slopes(own)).at(0.0)
    assert error <= SolverSettings().tolerance


def test_iterations_and_seconds_are_those_of_all_stages(result, told):
    lines = [line for line in told if not line.startswith("sigmoid gain")]
    assert len(result.trace) == len(lines)
    assert [entry.iteration for entry in result.trace] == list(range(len(lines)))
    seconds = [entry.seconds for entry in result.trace]
    assert sorted(seconds) == seconds
    assert result.seconds >= seconds[-1] > 0
    starts = sum(entry.step == 0 and entry.regularisation == 0 for entry in result.trace)
    assert starts >= 3
    assert result.iterations == len(lines) - 3  # each stage records its start too


def test_a_warm_start_goes_straight_to_the_own_gain(result, problem):
    told = []
    again = solve_spacetime(
        problem, result.point.controls, result.point.coefficients * FORCE_UNIT,
        warm=True, log=told.append,
    )  # fmt: skip
    assert [line for line in told if line.startswith("sigmoid")] == [
        "sigmoid gain 500/rad, root weight 100"
    ]
    assert again.status == "converged"
    assert again.values.energy == pytest.approx(result.values.energy, rel=1e-5)
    assert again.iterations < result.iterations


def test_a_whole_point_starts_closer_still(result, problem):
    told = []
    again = solve_spacetime(
        problem, result.point.controls, start_point=result.point, log=told.append
    )
    assert len([line for line in told if line.startswith("sigmoid")]) == 1
    assert again.status == "converged"
    assert again.iterations <= 3
    assert again.values.energy == pytest.approx(result.values.energy, rel=1e-6)


def test_limits_hold_for_all_stages_together(problem, start):
    result = solve_spacetime(problem, start, settings=SolverSettings(seconds=0.0))
    assert result.status == "time limit"
    assert result.iterations == 0


def test_a_start_that_is_not_a_number_ends_at_once(problem, start):
    spoilt = start.copy()
    spoilt[4, 7] = np.nan
    result = solve_spacetime(problem, spoilt)
    assert result.status == "not a number"
    assert len(result.trace) == 1
