"""A solve is held against its constraints by name, and designs against each other."""

import json
from dataclasses import replace

import numpy as np
import pytest

from motionstyle.body.layout import CONTACT_POINTS, COORDINATE_INDEX
from motionstyle.body.ranges import joint_ranges
from motionstyle.errors import MotionStyleError
from motionstyle.figures.solvers import solver_figure
from motionstyle.spacetime.comparison import COLUMNS, basin_share, compare_designs, starts_of
from motionstyle.spacetime.diagnosis import checked_solve
from motionstyle.spacetime.interior_point import InteriorPoint, InteriorPointResult, SolverSettings
from motionstyle.spacetime.outcome import outcome_of
from motionstyle.spacetime.spacetime_problem import Evaluator
from spacetime_problems import bent, plain_style, standing_problem

FRAMES = 9


@pytest.fixture(scope="module")
def problem(all_functions, plain_body, standing):
    q = bent(standing, FRAMES)
    return standing_problem(
        all_functions, plain_body, q, plain_style(60, 5, rest=q[0, 6:]), ranges=joint_ranges()
    )


def result_at(problem, q, status="converged"):
    """A solver's result that claims `status` at coordinates `q`."""
    evaluator = Evaluator(problem)
    point = InteriorPoint(evaluator, SolverSettings()).start(evaluator.basis.fit(q))
    values = evaluator.values(point.controls, 100 * point.coefficients)
    return InteriorPointResult(status, point, values, 1e-7, 3, 0.1)


def test_a_lifted_foot_and_an_overstretched_knee_are_named(problem, standing):
    q = bent(standing, FRAMES)
    q[:, COORDINATE_INDEX["knee_flexion_l"]] = np.radians(-9)  # 4° beyond its range
    result = result_at(problem, q, "iteration limit")
    found, record, diagnosis = checked_solve(lambda: outcome_of(problem, result), lambda _: None)
    assert found is result
    assert record.status == "not converged"
    assert "iteration limit" in record.reason
    named = {(one["constraint"], one["where"]) for one in diagnosis["worst"]}
    assert ("joint range", "knee_flexion_l") in named
    assert {where for kind, where in named if kind == "held foot point"} <= {
        name for name in CONTACT_POINTS if name.endswith("_l")
    }
    assert record.violations["joint range"] == pytest.approx(np.radians(4), rel=1e-6)
    assert diagnosis["at_bounds"]["knee_flexion_l"] == FRAMES
    assert json.loads(json.dumps(diagnosis)) == diagnosis


def test_a_sound_motion_keeps_every_limit(problem, standing):
    outcome = outcome_of(problem, result_at(problem, bent(standing, FRAMES)))
    by_name = {c.name: c for c in outcome.constraints}
    for name in ("held foot point", "clearance", "joint range", "friction cone"):
        assert by_name[name].worst() <= by_name[name].limit, name
    assert outcome.converged
    energy = outcome.value.values.energy
    assert outcome.terms["muscles"] + outcome.terms["root"] == pytest.approx(energy)


def test_designs_are_measured_by_the_best_of_all(problem, standing, synthetic_start):
    starts = {
        "paper": replace(synthetic_start, coordinates=bent(standing, FRAMES)),
        "perturbed_1": replace(synthetic_start, coordinates=bent(standing, FRAMES) + 0.02),
    }
    found = compare_designs(
        problem, starts, {"structured": list(starts)}, iterations=150, log=lambda _: None
    )
    assert [row["start"] for row in found["rows"]] == ["paper", "perturbed_1"]
    assert all(row.keys() <= set(COLUMNS) for row in found["rows"])
    converged = [row for row in found["rows"] if row["status"] == "converged"]
    assert converged
    assert min(row["above_best_pct"] for row in converged) == 0
    assert min(row["joint_rms_from_best_deg"] for row in converged) == 0
    assert 0 < basin_share(found["rows"]) <= 1
    for row in found["rows"]:
        row["problem"] = "standing"
    axes = solver_figure([found]).axes[0]
    assert len(axes.get_lines()) == 3  # two starts and the line 1 % above the best
    assert axes.get_title() == "standing"
    bottom = [a.get_xlabel() for a in solver_figure([found] * 5).axes]
    assert bottom == ["", "", "seconds", "seconds", "seconds", ""]  # the last panel is empty
    near = [row for row in converged if row["within_1_pct"]]
    assert near == [row for row in converged if row["above_best_pct"] <= 1]
    assert not any(row["within_1_pct"] for row in found["rows"] if row not in converged)


@pytest.fixture
def synthetic_start(plain_body):
    """A motion of nine frames without contacts, to carry coordinates."""
    from motionstyle.motion.motion import Motion

    up = np.tile([0.0, 1.0, 0.0], (FRAMES, 8, 1))
    return Motion(
        "made", "warp", 30.0, np.zeros((FRAMES, 35)), plain_body, np.zeros((FRAMES, 8), bool), up,
        np.ones(35, dtype=bool),
    )  # fmt: skip


def test_unknown_starts_and_designs_are_refused(problem, synthetic_start):
    with pytest.raises(MotionStyleError, match="start 'sideways' is unknown"):
        starts_of(synthetic_start, ["sideways"])
    with pytest.raises(MotionStyleError, match="solver design 'magic' is unknown"):
        compare_designs(problem, {"paper": synthetic_start}, {"magic": ["paper"]}, 1)
    assert set(starts_of(synthetic_start, ["paper", "perturbed_2"])) == {"paper", "perturbed_2"}
