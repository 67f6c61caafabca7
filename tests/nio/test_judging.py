"""Judging: converged solves from every start, measured against what they should be."""

import numpy as np
import pytest

from motionstyle.evaluation.nio.kinds import judge_kind
from motionstyle.nio.judging import JUDGING, ablated_styles, judge, looseness_deg
from motionstyle.spacetime.solver_point import SolverSettings

QUIET = {"log": lambda _line: None}


@pytest.fixture(scope="module")
def judged(made_learning):
    return judge(made_learning, made_learning.start, ["target", "gentle", "perturbed_1"], **QUIET)


def test_every_start_is_solved_to_the_end_and_measured(judged, made_learning):
    assert [row["start"] for row in judged.rows] == ["target", "gentle", "perturbed_1"]
    assert {row["status"] for row in judged.rows} == {"converged"}
    assert min(row["above_best_pct"] for row in judged.rows) == 0
    assert judged.rows[0]["from_first_start_deg"] == 0
    for row in judged.rows:
        assert row["optimality"] <= 1e-6
        assert row["foot_error_mm"] < 5
        assert row["G_over_E_target"] == pytest.approx(row["G"] / row["E_target"])
        assert row["G"] > 0  # no optimum costs more than X_T
    away = made_learning.joint_error_deg(judged.motion.coordinates)
    assert judged.rows[0]["joint_error_deg"] == pytest.approx(away)


def test_kept_ends_stay_those_of_the_target(made_learning):
    # 14 frames, the last one between two knots: three control points left it a degree off.
    found = judge_kind("ours_fixed", made_learning, made_learning.start, [])
    assert found.rows[0]["status"] == "converged"
    target, ends = made_learning.coordinates, [0, -1]
    np.testing.assert_allclose(found.motion.coordinates[ends], target[ends], atol=1e-9)
    assert np.abs(found.motion.coordinates - target).max() > 0.01  # between them it may move


def test_a_solve_that_is_cut_off_says_so_and_judging_cuts_later_than_other_solves(made_learning):
    hasty = SolverSettings(iterations=3)
    row = judge(made_learning, made_learning.start, ["target"], hasty, **QUIET).rows[0]
    assert (row["status"], row["iterations"]) == ("iteration limit", 3)
    # 500 cut off 23 of 107 solves of captured styles, each within 563 iterations of its optimum.
    assert JUDGING.iterations > 2 * SolverSettings().iterations


def test_ablated_styles_have_nothing_but_alpha(made_learning):
    found = ablated_styles(made_learning.start)
    count = len(made_learning.start.preferences)
    assert {name: style.preferences.sum() for name, style in found.items()} == pytest.approx(
        {"no_style_alpha_1": count, "no_style_alpha_1_29": 1.0}
    )
    assert not any(style.vector()[count:].any() for style in found.values())


def test_looseness_is_what_moves_faster_than_4_hz():
    time = np.arange(90) / 30.0
    joints = np.zeros((90, 35))
    joints[:, 6:] = np.linspace(0, 1, 90)[:, None]  # a drift, which is no looseness
    slow, fast = joints.copy(), joints.copy()
    slow[:, 6:] += np.sin(2 * np.pi * 1.0 * time)[:, None]
    fast[:, 6:] += 0.1 * np.sin(2 * np.pi * 10.0 * time)[:, None]
    assert looseness_deg(joints, 30.0) == pytest.approx(0, abs=1e-9)
    assert looseness_deg(slow, 30.0) < 1
    assert looseness_deg(fast, 30.0) == pytest.approx(np.degrees(0.1 / np.sqrt(2)), rel=0.05)
