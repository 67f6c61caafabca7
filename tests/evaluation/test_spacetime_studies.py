"""What the spacetime solver is measured by, against closed forms and brute force."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from motionstyle.body.layout import JOINT_COORDINATES
from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.spacetime import growth, sensitivity
from motionstyle.evaluation.spacetime.known_optima import (
    COLUMNS,
    DAMPER,
    MASS_KG,
    SPRING,
    _rest_to_rest,
    known_optima,
    known_optimum_row,
)
from motionstyle.evaluation.spacetime.known_truth import (
    KNOWN_TRUTH_COLUMNS,
    known_truth_rows,
    optimum_row,
)
from motionstyle.evaluation.spacetime.landscape import landscape
from motionstyle.evaluation.spacetime.twins import TEST, TEST_PAPER, start_near, twin_rows
from motionstyle.figures.landscape import landscape_figure
from motionstyle.files import write_json
from motionstyle.nio.learning_problem import LearningProblem, Projection
from motionstyle.spacetime.edits import Edits, edit_ranges
from motionstyle.spacetime.footprint_constraints import captured_constraints
from motionstyle.spacetime.made_styles import random_style
from motionstyle.spacetime.objective import best_coefficients, objective_terms
from motionstyle.spacetime.solver_point import SolverSettings
from motionstyle.spacetime.spacetime_problem import Evaluator, SpacetimeSettings
from motionstyle.spacetime.synthesis import initial_style_of
from motionstyle.spacetime.synthesis_plan import make_plan, planned_footprints
from motionstyle.spacetime.synthesis_sheet import FootprintSource, SynthesisRow
from synthetic_walk import loaded_walk

ROW = SynthesisRow(
    "made", None, "same_footprints", "walk", "twin", "other", FootprintSource(), Edits(),
    None, None, (), None, 2, None,
)  # fmt: skip
SCHEMA = Path(__file__).parents[2] / "workflow/schemas/config.schema.json"


def quiet(_text):
    pass


@pytest.fixture(scope="module")
def stretch():
    """A made-up walk at 30 Hz whose contacts carry its weight, 1.4 s of it."""
    return loaded_walk(10, 52)


@pytest.fixture(scope="module")
def walk(stretch):
    return stretch.window(10, 24)


@pytest.fixture(scope="module")
def style(walk, all_functions):
    return initial_style_of(walk, all_functions)


@pytest.fixture(scope="module")
def learning(walk, style, all_functions):
    """The walk's learning problem as if it were feasible: no solve."""
    moved = replace(walk, coordinates=walk.coordinates + 1e-3)
    return LearningProblem(
        captured=moved,
        target=walk,
        controls=np.zeros(0),
        coordinates=walk.coordinates,
        feet=captured_constraints(walk),
        ranges=edit_ranges(walk, Edits()),
        start=style,
        projection=Projection("converged", 0.0, 0.0, 0.0, 0.0),
        functions=all_functions,
        settings=SpacetimeSettings(),
    )


# ---------------------------------------------------------------------------------- known optima
@pytest.mark.parametrize(("spring", "damper"), [(0.0, 0.0), (SPRING, DAMPER), (50.0, 2.0)])
def test_no_other_way_from_rest_to_rest_takes_less_force(spring, damper):
    """∫u² is stationary, hence least (it is convex), against bumps at rest at both ends."""
    t = np.linspace(0, 1, 4001)
    x, u = _rest_to_rest(t, spring, damper)
    assert x[[0, -1]] == pytest.approx([0, 1], abs=1e-9)
    speed = np.gradient(x, t, edge_order=2)
    force = np.gradient(speed, t)
    assert speed[[0, -1]] == pytest.approx([0, 0], abs=2e-3)
    inside = slice(5, -5)
    by_hand = MASS_KG * force + damper * speed + spring * x
    assert u[inside] == pytest.approx(by_hand[inside], abs=1e-3 * np.abs(u).max())
    for k in (1, 2, 3):
        bump = np.sin(np.pi * t) ** 2 * np.cos(k * t)
        rate = np.gradient(bump, t, edge_order=2)
        push = MASS_KG * np.gradient(rate, t, edge_order=2) + damper * rate + spring * bump
        size = np.sqrt(np.trapezoid(u**2, t) * np.trapezoid(push**2, t))
        assert abs(np.trapezoid(u * push, t)) < 1e-4 * size


def test_the_solver_finds_the_sliding_masses_optima(plain_body, all_functions):
    """Gate: within 0.1 % of the analytic E, from a start that is 2 cm off."""
    for known in known_optima(plain_body, all_functions)[2:]:
        row = known_optimum_row(known, seed=1)
        assert set(row) <= set(COLUMNS)
        assert row["status"] == "converged", known.name
        assert abs(row["objective_error_pct"]) < 0.1
        assert row["E_start"] > 1.2 * row["E_analytic"]
        assert row["largest_error"] < 1e-4
        assert set(optimum_row(row)) <= set(KNOWN_TRUTH_COLUMNS)


def test_flights_are_free(plain_body, all_functions):
    """The parabola costs nothing, and the solver comes back to it from 2 cm and 10° away."""
    fall, sprung = known_optima(plain_body, all_functions)[:2]
    for known in (fall, sprung):
        basis, evaluator = known.problem.basis(), Evaluator(known.problem)
        values = evaluator.values(basis.fit(known.coordinates), np.zeros((31, 32)))
        assert values.energy < 1e-3
    row = known_optimum_row(sprung, seed=1)
    assert row["E_start"] > 1e8
    assert row["relative_to"] == "E_start"
    assert row["status"] == "converged"
    assert row["E_solver"] < 1e-6
    assert row["largest_error"] < 1e-6


# ------------------------------------------------------------------------------- the objective
def test_the_forces_of_a_motion_are_the_best(walk, learning):
    problem = learning.problem(learning.start)
    evaluator = Evaluator(problem)
    controls = evaluator.basis.fit(walk.coordinates)
    found = best_coefficients(evaluator, controls)
    values = evaluator.values(controls, found)
    assert (found >= 0).all()
    assert (found[~evaluator.bearing] == 0).all()
    empty = evaluator.values(controls, np.zeros_like(found))
    columns = evaluator.slopes(empty).by_coefficients
    for t in (0, 7, 14):
        allowed = evaluator.bearing[t]
        a = np.concatenate([columns[t][:, allowed], 1e-3 * np.eye(allowed.sum())])
        b = np.concatenate([-empty.residuals[t], np.zeros(allowed.sum())])
        best = lsq_linear(a, b, (0, np.inf), tol=1e-14, max_iter=500)
        ours = 0.5 * ((a @ found[t, allowed] - b) ** 2).sum()
        assert ours <= best.cost * (1 + 1e-9) + 1e-12
    terms = objective_terms(evaluator, values, found)
    assert terms["muscles"] + terms["root"] == pytest.approx(values.energy)
    assert terms["feet"] == pytest.approx((values.foot_residuals**2).sum())


def test_terms_tell_what_leaving_the_ranges_costs(walk, learning):
    problem = learning.problem(learning.start)
    evaluator = Evaluator(problem)
    q = walk.coordinates.copy()
    q[:, 6] = problem.ranges[6, 1] + 0.01
    controls = evaluator.basis.fit(q)
    coefficients = np.zeros((walk.frames, 32))
    terms = objective_terms(evaluator, evaluator.values(controls, coefficients), coefficients)
    assert terms["ranges"] == pytest.approx(walk.frames * 1e6 * 0.01**2, rel=1e-3)


# ----------------------------------------------------------------------- sensitivity and landscape
def test_every_choice_of_the_problem_may_be_configured():
    schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
    known = schema["properties"]["solver_study"]["properties"]["choices"]["items"]["enum"]
    assert known == list(sensitivity.CHOICES)


def test_choices_change_the_problem_they_name(learning):
    few = SolverSettings(iterations=1)
    rows = {}
    for name in ("base", "ends_kept", "root_10"):
        solved = sensitivity.solve_choice(learning, name, few, quiet)
        assert set(solved.row) <= set(sensitivity.COLUMNS)
        assert solved.row["status"] == "not converged"
        gap = solved.row["E_target"] - solved.row["E_optimum"]
        assert solved.row["G"] == pytest.approx(gap)
        rows[name] = solved
    base, kept = rows["base"], rows["ends_kept"]
    assert kept.row["E_target"] == base.row["E_target"]  # ends matter for X_S alone
    assert rows["root_10"].row["E_target"] < base.row["E_target"]
    assert (kept.optimum[:3] == kept.target[:3]).all()
    assert (base.optimum[:3] != base.target[:3]).any()


def test_every_choice_changes_what_it_says(learning):
    base = sensitivity.choice_problem(learning, sensitivity.CHOICES["base"])
    assert base.settings == SpacetimeSettings()
    for name, choice in sensitivity.CHOICES.items():
        made = sensitivity.choice_problem(learning, choice)
        ours, theirs = vars(made.settings), vars(base.settings)
        weights = {weight for weight in ours if ours[weight] != theirs[weight]}
        assert weights == set(choice.weights), name
        assert (made.feet.friction != base.feet.friction).any() == ("friction" in name)
        assert (made.feet.clearance != base.feet.clearance).any() == (name == "no_clearance")
        assert np.isfinite(made.ranges[6:]).all() == (name != "no_ranges")
        assert (made.keep_ends == 3) == (name == "ends_kept")
    assert [name for name, choice in sensitivity.CHOICES.items() if not choice.projected] == [
        "not_projected"
    ]


def test_the_landscape_starts_at_the_motion_and_its_terms_add_up(walk, learning):
    problem = learning.problem(learning.start)
    evaluator = Evaluator(problem)
    target = evaluator.basis.fit(walk.coordinates)
    found = landscape(problem, target, target + 0.01)
    at = int(np.argmin(np.abs(found["s"])))
    assert found["s"][at] == pytest.approx(0, abs=1e-12)
    terms = [name for name in found if name not in ("s", "total")]
    assert found["total"] == pytest.approx(np.sum([found[n] for n in terms], axis=0))
    best = evaluator.values(target, best_coefficients(evaluator, target)).energy
    assert found["muscles"][at] + found["root"][at] == pytest.approx(best, rel=1e-6)
    labels = [axes.get_ylabel() for axes in landscape_figure(found, "walk").axes]
    assert labels[0] == "terms of the objective"
    assert labels[1].startswith("muscles")


# ------------------------------------------------------------------------------------------ growth
def test_copies_of_a_stretch_go_on_without_a_jump(stretch):
    long = growth.repeated(stretch, 150)
    assert long.frames == 150
    steps = np.abs(np.diff(long.coordinates, axis=0))
    own = np.abs(np.diff(stretch.coordinates, axis=0)).max(axis=0)
    spread = np.ptp(stretch.coordinates, axis=0) / (stretch.frames - 1)
    assert (steps.max(axis=0) <= own + 2 * spread + 1e-9).all()
    speed = (long.coordinates[-1, 0] - long.coordinates[0, 0]) / 149
    period = stretch.frames - 1
    assert speed == pytest.approx(
        (stretch.coordinates[-1, 0] - stretch.coordinates[0, 0]) / period, rel=0.1
    )
    assert (long.contacts[period : 2 * period] == stretch.contacts[:period]).all()


def test_growth_is_told_by_ratios(stretch, style, all_functions):
    row = growth.growth_row(stretch, style, all_functions, 12, 1, quiet)
    assert set(row) <= set(growth.COLUMNS)
    assert row["warm_over_cold"] == pytest.approx(row["warm_seconds"] / row["seconds"])
    assert row["peak_memory_mb"] > 50
    slower = {**row, "frames": 48, "ms_per_iteration": 8 * row["ms_per_iteration"]}
    failed = {"frames": 96, "status": "failed", "reason": "no forces"}
    rows = growth.with_exponents([failed, slower, row])
    assert [one["frames"] for one in rows] == [12, 48, 96]
    assert rows[1]["growth_exponent"] == pytest.approx(1.5)
    assert "growth_exponent" not in rows[0]
    assert "growth_exponent" not in rows[2]


# ------------------------------------------------------------------------------------------- twins
def test_twins_are_recovered_from_named_starts(walk, style, all_functions, tmp_path):
    plan = make_plan(ROW, walk, *planned_footprints(ROW, walk))
    theta = random_style(style, 7)
    few = SolverSettings(iterations=2)
    target, rows = twin_rows(ROW, plan, theta, all_functions, ["perturbed_1", "paper"], few, quiet)
    assert (target.id, target.kind) == ("made_twin7", "planted")
    assert [row["test"] for row in rows] == [TEST, TEST_PAPER]
    assert [row["seed"] for row in rows] == [7, 7]
    assert rows[0]["start_rms_deg"] == pytest.approx(10, abs=2)  # less what ranges cut off
    assert rows[1]["start_rms_deg"] < 2
    assert all(row["status"] == row["target_status"] == "not converged" for row in rows)
    best = min(rows[0]["target_E"], *(row["E"] for row in rows))
    for row in rows:
        assert row["E_gap_to_best_pct"] == pytest.approx(100 * (row["E"] / best - 1))
        assert row["joint_rms_deg"] > 0
    write_json(tmp_path / "a.json", {"rows": rows[:1]})
    write_json(tmp_path / "b.json", {"rows": rows[1:]})
    gathered = known_truth_rows([tmp_path / "a.json", tmp_path / "b.json"], "default")
    assert [row["start"] for row in gathered] == ["perturbed_1", "paper"]
    assert all(row["data"] == "planted" for row in gathered)
    assert all(set(row) <= set(KNOWN_TRUTH_COLUMNS) for row in gathered)
    with pytest.raises(MotionStyleError, match="start 'sideways' is unknown"):
        start_near(target, plan, "sideways")
    near = start_near(target, plan, "perturbed_3").coordinates[:, JOINT_COORDINATES]
    assert (near <= plan.ranges[JOINT_COORDINATES, 1] + 1e-12).all()
