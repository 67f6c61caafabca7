"""Learning styles: derivatives against differences, G against its definition, twins, bad input."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.nio.records import check_projection
from motionstyle.nio.derivatives import energy_by_style, mixed_derivatives
from motionstyle.nio.inner import InnerSettings, inner_solve
from motionstyle.nio.learning_problem import (
    ROOT_LIMIT_N,
    cost_at,
    learning_problem,
    target_cost,
)
from motionstyle.nio.optima import shoes_unbalanced
from motionstyle.nio.paper import PaperSettings, learn_as_paper, soft_constraints
from motionstyle.nio.preferences import PreferenceSettings, learn_preferences, lowest, plane
from motionstyle.nio.style_space import StyleSpace
from motionstyle.spacetime.footprint_constraints import captured_constraints
from motionstyle.spacetime.solver_point import FORCE_UNIT
from motionstyle.spacetime.spacetime_problem import Evaluator

GAIN = 60.0
# One of each kind of parameter: α, k_s1, k_s2, k_d, q̄ of some joints, and both of the shoe.
CHOSEN = (3, 29 + 3, 58 + 10, 87 + 4, 116 + 3, 116 + 9, 145, 146)


def quiet(_text):
    pass


@pytest.fixture(scope="module")
def style(made_learning):
    """Springs everywhere, so that every derivative is of something."""
    rng = np.random.default_rng(1)
    vector = made_learning.start.vector()
    vector[:29] = rng.dirichlet(np.full(29, 5.0))
    vector[29:87] = rng.uniform(20, 60, 58)
    vector[87:116] = rng.uniform(1, 4, 29)
    vector[116:145] += rng.normal(0, 0.05, 29)
    return made_learning.start.with_vector(vector)


@pytest.fixture(scope="module")
def solved(made_learning, style):
    found = inner_solve(made_learning, style, InnerSettings(0.0, GAIN, 200, 1e-8, 1e-3))
    assert found.result.status == "converged"
    return found


def moved(style, k, by):
    vector = style.vector()
    vector[k] += by
    return style.with_vector(vector)


def step_of(style, k):
    return 1e-5 if k >= 116 and k != 145 else 1e-5 * max(1.0, abs(style.vector()[k]))


def test_the_projected_motion_obeys_newton_and_g_is_not_negative(made_learning, style, solved):
    assert made_learning.projection.root_n < ROOT_LIMIT_N
    # Forces found anew give a little of that up for smaller torques.
    cost = target_cost(made_learning, made_learning.start)
    assert cost.root < 0.1 * cost.energy
    gap = target_cost(made_learning, style, GAIN).total - solved.cost.total
    assert gap >= 0
    for sample in (made_learning.start, style):
        near = inner_solve(made_learning, sample, InnerSettings(0.0, GAIN, 200, 1e-6, 1e-3))
        assert target_cost(made_learning, sample, GAIN).total >= near.cost.total


def test_e_by_theta_is_what_differences_of_e_are(made_learning, style, solved):
    problem = made_learning.problem(style, gain=GAIN)
    controls = solved.result.point.controls + 1e-3
    forces = solved.result.point.coefficients * FORCE_UNIT
    exact = energy_by_style(problem, cost_at(problem, controls, forces).values)
    for k in CHOSEN:
        h = step_of(style, k)
        up, down = (
            cost_at(replace(problem, style=moved(style, k, s * h)), controls, forces).energy
            for s in (1, -1)
        )
        assert exact[k] == pytest.approx((up - down) / (2 * h), rel=1e-4, abs=1e-6 * exact.max())


def test_mixed_derivatives_are_differences_of_the_gradient(made_learning, style, solved):
    problem = made_learning.problem(style, gain=GAIN)
    controls = solved.result.point.controls
    forces = solved.result.point.coefficients * FORCE_UNIT
    by_state, by_force = mixed_derivatives(
        problem, cost_at(problem, controls, forces).values, forces
    )
    for k in CHOSEN:
        h = step_of(style, k)
        ends = []
        for s in (1, -1):
            evaluator = Evaluator(replace(problem, style=moved(style, k, s * h)))
            values = evaluator.values(controls, forces)
            slopes = evaluator.slopes(values)
            ends.append(
                [
                    2 * np.einsum("frx,fr->fx", part, values.residuals)
                    for part in (slopes.by_state, slopes.by_coefficients)
                ]
            )
        for exact, up, down in zip((by_state, by_force), *ends, strict=True):
            difference = (up - down) / (2 * h)
            scale = max(np.abs(difference).max(), 1e-9)
            assert np.abs(exact[..., k] - difference).max() < 1e-3 * scale


def test_g_by_theta_is_exact_at_an_optimum(made_learning, style, solved):
    """The envelope theorem, eq. (21), against differences of converged solves."""
    target = target_cost(made_learning, style, GAIN)
    exact = energy_by_style(solved.problem, target.values)
    exact = exact - energy_by_style(solved.problem, solved.cost.values)
    settings = InnerSettings(0.0, GAIN, 200, 1e-9, 1e-3)
    # Multiplied by usual sizes, parameters are alike.
    for k, unit in ((3, 1 / 29), (29 + 3, 50.0), (116 + 3, 0.2)):
        gaps = []
        for sign in (1, -1):
            near = moved(style, k, sign * 1e-3 * unit)
            found = inner_solve(made_learning, near, settings, None, solved.result.point)
            gaps.append(target_cost(made_learning, near, GAIN).total - found.cost.total)
        difference = (gaps[0] - gaps[1]) / 2e-3
        assert unit * exact[k] == pytest.approx(difference, rel=0.03, abs=0.02 * target.total)


def test_at_an_exact_solution_g_and_its_gradient_vanish(made_learning, style, solved):
    """X* made with θ* is optimal for θ*, and for no other."""
    twin = replace(
        made_learning,
        controls=solved.result.point.controls,
        coordinates=solved.cost.values.coordinates,
    )
    target = target_cost(twin, style, GAIN)
    again = inner_solve(twin, style, InnerSettings(0.0, GAIN, 200, 1e-8, 1e-3))
    assert abs(target.total - again.cost.total) < 1e-4 * target.total
    unit = np.concatenate([np.repeat((1 / 29, 50, 50, 3, 0.2), 29), (1e3, 5e-4)])
    slope = energy_by_style(solved.problem, target.values)
    slope -= energy_by_style(solved.problem, again.cost.values)
    assert np.abs(unit * slope).max() < 1e-2 * target.total
    other = inner_solve(twin, made_learning.start, InnerSettings(0.0, GAIN, 200, 1e-6, 1e-3))
    assert target_cost(twin, made_learning.start, GAIN).total > 1.05 * other.cost.total


QUICK = PaperSettings(iterations=4, first_iterations=40, inner_iterations=12, kept=3)


@pytest.fixture(scope="module")
def as_paper(made_learning):
    return learn_as_paper(made_learning, QUICK, quiet)


def test_the_papers_objective_never_rises_and_learning_goes_on(made_learning, as_paper):
    rows = as_paper.rows
    assert [row["iteration"] for row in rows] == list(range(QUICK.iterations + 1))
    objectives = [row["objective"] for row in rows]
    assert all(b < a for a, b in pairwise(objectives))
    assert objectives[-1] < 0.7 * objectives[0]
    solves = [row["inner_solves"] for row in rows]
    assert all(b > a for a, b in pairwise(solves))
    # What is told of the last style is true: its X_S is feasible, and E(X_T) that of its θ.
    target = target_cost(made_learning, as_paper.style)
    assert rows[-1]["E_target"] == pytest.approx(target.energy)
    assert rows[-1]["G"] + soft_constraints(as_paper.style.preferences) == pytest.approx(
        objectives[-1]
    )


def test_the_papers_unknowns_stay_in_bounds_and_in_the_box_of_a_step(made_learning, as_paper):
    style, start = as_paper.style, made_learning.start
    assert style.preferences.min() >= QUICK.least_preference / 29 - 1e-15
    passive = style.vector()[29:116]
    assert passive.min() >= 0
    low, high = made_learning.ranges[6:].T
    assert np.all((style.passive.rest_angle >= low) & (style.passive.rest_angle <= high))
    farthest = np.abs(np.log(style.preferences / start.preferences)).max()
    assert 0 < farthest <= QUICK.iterations * QUICK.longest_step


def test_a_solve_cut_off_above_the_captured_motion_lowers_nothing(made_learning):
    """Far away and cut off at once, E(X_S) ends above E(X_T): no reason to believe that G is 0."""
    far = replace(QUICK, iterations=2, first_iterations=100, inner_iterations=1, longest_step=8.0)
    rows = learn_as_paper(made_learning, far, quiet).rows
    assert len(rows) == 3
    assert all(row["G"] > 0.5 * row["E_target"] for row in rows)
    assert rows[-1]["E_target"] < rows[0]["E_target"]


def test_in_printed_units_no_step_can_be_taken(made_learning):
    """A5's defect iii: a step short enough for one unknown moves all others by next to nothing."""
    printed = replace(QUICK, scaled=False, iterations=1, trials=12)
    found = learn_as_paper(made_learning, printed, quiet)
    assert len(found.rows) == 1
    np.testing.assert_array_equal(found.style.vector(), made_learning.start.vector())
    # All lengths were tried, and again after another solve at the same θ.
    assert 1 + printed.trials < found.rows[0]["inner_solves"] <= 2 + 2 * printed.trials
    scaled = learn_as_paper(made_learning, replace(QUICK, iterations=1), quiet)
    assert len(scaled.rows) == 2


def test_planes_bound_g_from_below(made_learning, style, solved):
    """G is convex in α, so that every X_S bounds it at any other α (nio.md E3)."""
    vector = style.vector()
    vector[:29] = np.random.default_rng(3).dirichlet(np.full(29, 8.0))
    other = style.with_vector(vector)
    settings = InnerSettings(0.0, GAIN, 200, 1e-6, 1e-3)
    found = inner_solve(made_learning, other, settings, None, solved.result.point)
    target = target_cost(made_learning, style, GAIN)
    slope, offset = plane(target, solved.cost)
    here = target.total - solved.cost.total
    assert slope @ style.preferences + offset == pytest.approx(here, rel=1e-9)
    elsewhere = target_cost(made_learning, other, GAIN)
    gap = elsewhere.total - found.cost.total
    assert slope @ other.preferences + offset <= gap + 1e-3 * elsewhere.total


def test_the_next_preferences_are_least_in_the_highest_plane():
    rng = np.random.default_rng(0)
    planes = [(rng.normal(size=29), float(rng.normal())) for _ in range(4)]
    best = np.full(29, 1 / 29)
    found = lowest(planes, best, 1e-6, (0.1, 10.0))
    assert found.sum() == pytest.approx(1)

    def height(alpha):
        return max(slope @ alpha + offset for slope, offset in planes)

    for _ in range(300):
        other = np.clip(29 * rng.dirichlet(np.full(29, rng.uniform(0.1, 3))), 0.1, 10)
        assert height(found) <= height(other / other.sum()) + 0.02


def test_preferences_alone_lower_g(made_learning):
    found = learn_preferences(made_learning, PreferenceSettings(rounds=2, iterations=80), quiet)
    accepted = [row["objective"] for row in found.rows if row["accepted"]]
    assert accepted == sorted(accepted, reverse=True)
    assert accepted[-1] == min(r["objective"] for r in found.rows if r["optimality"] < 1)
    assert not found.style.vector()[29:].any()
    assert found.style.preferences.sum() == pytest.approx(1)


def test_a_motion_without_forces_teaches_no_style(made_walk, all_functions):
    with pytest.raises(MotionStyleError, match="no contact forces"):
        learning_problem(replace(made_walk, contact_forces=None), all_functions)


def test_a_window_without_its_contacts_is_refused(made_walk, all_functions):
    """Nothing holds the body up, so that the motion nearest to it falls."""
    afloat = replace(
        made_walk,
        contacts=np.zeros_like(made_walk.contacts),
        contact_forces=np.zeros_like(made_walk.contact_forces),
    )
    with pytest.raises(MotionStyleError, match="choose a window without wrong contacts"):
        check_projection(learning_problem(afloat, all_functions))


def test_a_walk_is_near_one_that_obeys_the_dynamics(made_learning):
    check_projection(made_learning)


def test_the_projected_motion_keeps_its_feet_above_the_ground_it_was_projected_on(made_learning):
    """Found anew, the ground would lie elsewhere, and shoes would push where nothing balances."""
    feet = made_learning.feet
    evaluator = Evaluator(made_learning.problem(made_learning.start))
    values = evaluator.values(made_learning.controls, np.zeros((feet.frames, 32)))
    before = captured_constraints(made_learning.captured, "path")
    assert not np.allclose(before.targets[feet.held], feet.targets[feet.held], atol=1e-6)
    np.testing.assert_array_equal(feet.ground, before.ground)
    np.testing.assert_array_equal(feet.held, before.held)
    assert np.abs(values.foot_residuals).max() < 1e-9
    heights = ((values.points - feet.ground) * feet.normals).sum(axis=-1)
    assert (heights >= feet.clearance - 1e-12)[~feet.held].all()


def test_shoes_that_the_motion_cannot_balance_are_found(made_learning):
    """A millimetre more of h̄ pushes where no held point can push back."""
    start = made_learning.start
    higher = replace(start, shoe_rest_length=start.shoe_rest_length + 1e-3)
    before, after = (target_cost(made_learning, style) for style in (start, higher))
    assert before.root < 0.01 * before.energy
    assert after.root > before.energy
    assert shoes_unbalanced(made_learning)
    shoeless = replace(start, shoe_stiffness=0.0)
    assert not shoes_unbalanced(replace(made_learning, start=shoeless))


def test_shoes_that_are_wrong_from_the_start_are_learnt(made_learning):
    """A twin's motion was made with other shoes: kept, they left nine tenths of E to the root."""
    start = made_learning.start
    wrong = replace(start, shoe_rest_length=start.shoe_rest_length + 0.02, shoe_stiffness=5e4)
    cost = target_cost(made_learning, wrong)
    assert cost.root > 0.5 * cost.energy
    assert not shoes_unbalanced(replace(made_learning, start=wrong))


def test_a_space_that_keeps_shoes_leaves_all_else_free(made_learning, style):
    usual = StyleSpace.of(made_learning.ranges, 0.1, 10.0)
    space = usual.keeping_shoes(made_learning.start)
    y = space.coordinates(style) + 0.5
    found = space.style(y, style)
    assert (found.shoe_stiffness, found.shoe_rest_length) == (
        made_learning.start.shoe_stiffness,
        made_learning.start.shoe_rest_length,
    )
    np.testing.assert_allclose(found.vector()[:-2], usual.style(y, style).vector()[:-2])


def test_the_scaled_style_is_the_style_itself_and_its_chain_the_slope(made_learning, style):
    space = StyleSpace.of(made_learning.ranges, 1e-3, 29.0)
    y = space.coordinates(style)
    found = space.style(y, style)
    np.testing.assert_allclose(found.vector()[29:-2], style.vector()[29:-2], atol=1e-9)
    np.testing.assert_allclose(found.preferences, style.preferences, atol=1e-12)
    low, high = space.room(y)
    way = np.random.default_rng(3).standard_normal(len(y))
    way[(low > -1e-3) | (high < 1e-3)] = 0.0
    ends = [space.style(y + sign * 1e-4 * way, style).vector() for sign in (1, -1)]
    difference = (ends[0] - ends[1]) / 2e-4
    np.testing.assert_allclose(space.chain(style) @ way, difference, rtol=1e-5, atol=1e-6)
