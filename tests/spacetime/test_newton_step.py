"""What is left out of the Newton matrix so that it is convex, and when nothing is."""

from dataclasses import replace

import numpy as np
import pytest

from motionstyle.dynamics.passive import PassiveParameters
from motionstyle.spacetime.interior_point import InteriorPoint, SolverSettings
from motionstyle.spacetime.newton_step import factorise, newton_blocks, newton_step
from motionstyle.spacetime.spacetime_problem import Evaluator
from motionstyle.spacetime.style import Style
from spacetime_problems import bent, standing_problem

FRAMES, KNEE, AT, CONVEX = 10, 9, 5, 20.0


@pytest.fixture(scope="module")
def problem(all_functions, plain_body, standing):
    """Springs of 20 and 200 N·m/rad, all joints in their rest pose, where stiffness switches."""
    q = bent(standing, FRAMES)
    springs = PassiveParameters(np.full(29, 200.0), np.full(29, 20.0), np.full(29, 5.0), q[0, 6:])
    style = Style(np.full(29, 1 / 29), springs)
    return standing_problem(all_functions, plain_body, q, style, gain=500.0), q


def system_at(problem, push):
    """The solver's system and a point of it whose knee torque has a multiplier in one frame."""
    problem, q = problem
    evaluator = Evaluator(problem)
    solver = InteriorPoint(evaluator, SolverSettings())
    point = solver.start(problem.basis().fit(q))
    multiplier = np.zeros_like(point.multiplier)
    multiplier[AT, KNEE] = push
    point = replace(
        point,
        lift=multiplier,
        multiplier=multiplier,
        foot_lift=np.zeros_like(point.foot_lift),
        foot_multiplier=np.zeros_like(point.foot_multiplier),
    )
    values = evaluator.values(point.controls, 100.0 * point.coefficients)
    slopes = evaluator.slopes(values)
    blocks = newton_blocks(solver.system, point, values, slopes, 1e-3)
    return solver.system, point, values, blocks


@pytest.mark.parametrize("push", [0.0, CONVEX])
def test_where_the_matrix_is_convex_nothing_is_left_out(problem, push):
    system, _point, _values, blocks = system_at(problem, push)
    whole = factorise(system, blocks, 0.0)
    other = factorise(system, blocks, 0.0, straighten=True)
    assert whole.delta == other.delta == 0.0
    np.testing.assert_array_equal(whole.factor, other.factor)


def test_a_concave_spring_is_left_out_before_all_joints_are_held_back(problem):
    system, _point, _values, blocks = system_at(problem, -CONVEX)
    assert (blocks.concave.min(axis=(0, 1)) < 0).nonzero()[0].tolist() == [KNEE]
    whole = factorise(system, blocks, 0.0)
    other = factorise(system, blocks, 0.0, straighten=True)
    assert whole.delta > 0.1
    assert other.delta == 0.0


def test_a_step_without_the_concave_spring_leads_down(problem):
    system, point, values, blocks = system_at(problem, -CONVEX)
    found = factorise(system, blocks, 0.0, straighten=True)
    excess = system.excess(point, values)
    nothing = replace(excess, residuals=0 * excess.residuals, feet=0 * excess.feet)
    step, slope = newton_step(system, point, blocks, found, nothing)
    assert slope < 0
    assert np.abs(step.controls).max() > 1e-6
