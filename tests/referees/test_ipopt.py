"""Our spacetime solver against IPOPT on the same small problem: E within 0.5 %."""

from dataclasses import replace

import numpy as np
import pytest

from motionstyle.body.layout import CONTACT_POINTS
from motionstyle.body.ranges import joint_ranges
from motionstyle.spacetime.interior_point import FORCE_UNIT, InteriorPoint, SolverSettings
from motionstyle.spacetime.ipopt_referee import IpoptReferee
from motionstyle.spacetime.spacetime_problem import Evaluator
from spacetime_problems import bent, plain_style, standing_problem

FRAMES = 12


@pytest.fixture(scope="module")
def evaluator(all_functions, plain_body, standing):
    """The left heel and the right toe rise half-way; soles are soft; ranges are those of people.

    IPOPT keeps ranges and clearance to the letter, ours by a weight: here one so large that the
    two problems are one.
    """
    q = bent(standing, FRAMES)
    style = plain_style(60, 5, rest=q[0, 6:] + 0.02, shoe=(5e3, 0.01))
    problem = standing_problem(all_functions, plain_body, q, style, ranges=joint_ranges())
    held = problem.feet.held.copy()
    held[4:, CONTACT_POINTS.index("heel_l")] = False
    held[7:, CONTACT_POINTS.index("toe_r")] = False
    feet = replace(
        problem.feet, held=held, clearance=np.where(held, 0.0, -0.001),
        ground=problem.feet.ground - [0.0, 0.005, 0.0],
    )  # fmt: skip
    stiff = replace(problem.settings, range_weight=1e9, clearance_weight=1e10)
    return Evaluator(replace(problem, feet=feet, settings=stiff))


@pytest.fixture(scope="module")
def controls(evaluator, standing):
    return evaluator.basis.fit(bent(standing, FRAMES))


@pytest.fixture(scope="module")
def ours(evaluator, controls):
    solver = InteriorPoint(evaluator, SolverSettings())
    return solver.solve(solver.start(controls))


@pytest.fixture(scope="module")
def theirs(evaluator, controls):
    coefficients = 20.0 * evaluator.bearing
    return IpoptReferee(evaluator).solve(controls, coefficients)


def test_both_converge_to_the_same_energy_and_motion(evaluator, ours, theirs):
    assert ours.status == "converged"
    assert theirs.status == "Solve_Succeeded"
    assert ours.values.energy == pytest.approx(theirs.energy, rel=5e-3)
    assert ours.trace[0].energy > 1.05 * ours.values.energy
    motion = evaluator.values(theirs.controls, theirs.coefficients)
    assert np.abs(motion.coordinates - ours.values.coordinates).max() < 1e-3
    force, other = (v.forces.sum(axis=1) for v in (motion, ours.values))
    assert np.abs(force - other).max() < 1.0  # N


def test_ipopt_s_point_is_an_optimum_in_our_measure(evaluator, theirs):
    """Started there with hardly any barrier, our solver converges soon and all but stays."""
    solver = InteriorPoint(evaluator, SolverSettings(barrier=1e-6))
    result = solver.solve(solver.start(theirs.controls, theirs.coefficients))
    assert result.status == "converged"
    assert result.iterations <= 25
    assert np.abs(result.point.controls - theirs.controls).max() < 1e-3
    assert result.point.coefficients * FORCE_UNIT == pytest.approx(theirs.coefficients, abs=2.0)


@pytest.mark.parametrize(
    ("option", "status"),
    [
        ({"max_wall_time": 1e-3}, "Maximum_WallTime_Exceeded"),
        ({"linear_solver": "ma57"}, "Invalid_Option"),
    ],
)
def test_faults_08_09_ipopt_s_limits_and_an_absent_linear_solver_are_told(
    evaluator, controls, option, status
):
    """CasADi returns a point without a word; whether it is one to use stands in the status."""
    found = IpoptReferee(evaluator, **option).solve(controls, 20.0 * evaluator.bearing)
    assert found.status == status
