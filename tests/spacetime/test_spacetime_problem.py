"""The problem's values by hand, and its derivatives by finite differences."""

from dataclasses import replace

import numpy as np
import pytest

from motionstyle.body.layout import CONTACT_POINTS
from motionstyle.body.ranges import joint_ranges
from motionstyle.dynamics.inverse import GRAVITY
from motionstyle.dynamics.passive import PassiveParameters, passive_forces
from motionstyle.dynamics.symbols import parameter_vector
from motionstyle.errors import MotionStyleError
from motionstyle.spacetime.banded import assemble_gradient, spread
from motionstyle.spacetime.foot_constraints import FootConstraints
from motionstyle.spacetime.forces import cone_basis
from motionstyle.spacetime.spacetime_problem import (
    Evaluator,
    SpacetimeProblem,
    SpacetimeSettings,
)
from motionstyle.spacetime.style import Style
from spacetime_problems import FREE, RATE, bent, flat_feet, flight_problem, plain_style, throw

FRAMES = 9


@pytest.fixture(scope="module")
def rough(all_functions, plain_body, standing):
    """A problem with all there is, at a place where springs and shoes are about to switch.

    Rest angles lie within some 2 mrad of the joints and shoes' rest within some 2 mm of the heels,
    where sigmoids of gain 500 are steepest; planes are ramps; some held points slide.
    """
    rng = np.random.default_rng(10)
    q = bent(standing, FRAMES) + 2e-3 * rng.standard_normal((FRAMES, 35))
    q[:, :6] += 0.1 * rng.standard_normal((FRAMES, 6))
    points = all_functions["foot_points"](q, parameter_vector(plain_body))[0].reshape(-1, 8, 3)
    normals = np.array([0.0, 1.0, 0.0]) + 0.3 * rng.standard_normal((FRAMES, 8, 3))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    held = rng.random((FRAMES, 8)) < 0.6
    rest = 0.02
    depth = rest + 2e-3 * rng.standard_normal((FRAMES, 8, 1))
    feet = FootConstraints(
        held=held,
        sliding=held & (rng.random((FRAMES, 8)) < 0.4),
        targets=points + 0.01 * rng.standard_normal(points.shape),
        ground=points - depth * normals,
        normals=normals,
        clearance=0.01 * rng.standard_normal((FRAMES, 8)),
        friction=rng.uniform(0.4, 0.9, (FRAMES, 8)),
    )
    passive = PassiveParameters(*rng.uniform(10, 100, (3, 29)), q[:, 6:].mean(axis=0))
    style = Style(rng.uniform(0.01, 0.1, 29), passive, 2e4, rest)
    problem = SpacetimeProblem(plain_body, RATE, feet, joint_ranges(), style, all_functions)
    assert problem.settings.sigmoid_gain == 500
    evaluator = Evaluator(problem)
    coefficients = rng.uniform(0, 100, (FRAMES, 32)) * evaluator.bearing
    return evaluator, evaluator.basis.fit(q), coefficients, rng


def slopes_of(evaluator, controls, coefficients, y, y_feet, pushes):
    """Gradients by control points and λ of y·r + y_f·r_f + pushes·heights."""
    slopes = evaluator.slopes(evaluator.values(controls, coefficients))
    by_state = np.einsum("fru,fr->fu", slopes.by_state, y)
    by_state[:, :35] += np.einsum("fru,fr->fu", slopes.feet, y_feet)
    by_state[:, :35] += np.einsum("fpq,fp->fq", slopes.heights, pushes)
    by_force = np.einsum("fru,fr->fu", slopes.by_coefficients, y)
    return assemble_gradient(evaluator.basis, by_state), by_force


def test_gradient_and_hessian_are_those_of_finite_differences(rough):
    evaluator, controls, coefficients, rng = rough
    feet = evaluator.problem.feet
    y, y_feet, pushes = (rng.standard_normal((FRAMES, n)) for n in (35, 24, 8))

    def scalar(c, lam):
        values = evaluator.values(c, lam)
        heights = ((values.points - feet.ground) * feet.normals).sum(-1)
        feet_part = (y_feet * values.foot_residuals).sum()
        return (y * values.residuals).sum() + feet_part + (pushes * heights).sum()

    values = evaluator.values(controls, coefficients)
    assert np.abs(values.shoe_forces).max() > 1
    hessian, mixed = evaluator.curvature(values, evaluator.slopes(values), y, y_feet, pushes)
    by_controls, by_force = slopes_of(evaluator, controls, coefficients, y, y_feet, pushes)
    for _ in range(3):
        move = 1e-2 * rng.standard_normal(controls.shape)
        force = rng.standard_normal(coefficients.shape) * evaluator.bearing
        h = 1e-5
        ahead, behind = ((controls + s * h * move, coefficients + s * h * force) for s in (1, -1))
        numeric = (scalar(*ahead) - scalar(*behind)) / (2 * h)
        exact = (by_controls * move).sum() + (by_force * force).sum()
        assert exact == pytest.approx(numeric, rel=1e-6)
        up, down = (slopes_of(evaluator, *p, y, y_feet, pushes) for p in (ahead, behind))
        state = spread(evaluator.basis, move)
        bent_state = np.einsum("fuv,fv->fu", hessian.dense(), state)
        bent_state[:, :35] += np.einsum("ful,fl->fu", mixed, force)
        exact_parts = (
            assemble_gradient(evaluator.basis, bent_state),
            np.einsum("ful,fu->fl", mixed, state[:, :35]),
        )  # fmt: skip
        for found, plus, minus in zip(exact_parts, up, down, strict=True):
            numeric = (plus - minus) / (2 * h)
            np.testing.assert_allclose(found, numeric, atol=1e-5 * np.abs(numeric).max())


def test_concave_bends_are_the_springs_share_of_second_derivatives_below_zero(rough):
    evaluator, controls, coefficients, rng = rough
    values = evaluator.values(controls, coefficients)
    y = rng.standard_normal((FRAMES, 35))
    nothing = np.zeros((FRAMES, 24)), np.zeros((FRAMES, 8))
    found, _mixed = evaluator.curvature(values, evaluator.slopes(values), y, *nothing)
    passive, h = evaluator.problem.style.passive, 1e-5

    def springs(step):
        return passive_forces(passive, values.coordinates[:, 6:] + step, values.rates[:, 6:])

    # Q_m = τ − Q_p, scaled by the root of α.
    bends = -(springs(h) - 2 * springs(0.0) + springs(-h)) / h**2
    bends *= np.sqrt(evaluator.problem.style.preferences) * y[:, 6:]
    assert (bends < 0).mean() > 0.3
    assert (bends > 0).mean() > 0.3
    expected = np.minimum(bends, 0.0)
    np.testing.assert_allclose(found.concave[:, 6:], expected, atol=1e-4 * np.abs(bends).max())
    np.testing.assert_array_equal(found.concave[:, :6], 0.0)


def test_inequality_rows_are_distances_to_the_ranges_and_clearances(rough):
    evaluator, controls, coefficients, _rng = rough
    values = evaluator.values(controls, coefficients)
    problem, n = evaluator.problem, len(evaluator.limited)
    assert n == np.isfinite(problem.ranges).all(axis=1).sum() > 20
    low, high = problem.ranges[evaluator.limited].T
    rows, q = values.inequalities / evaluator.row_scale, values.coordinates[:, evaluator.limited]
    np.testing.assert_allclose(rows[:, :n], q - low, atol=1e-12)
    np.testing.assert_allclose(rows[:, n : 2 * n], high - q, atol=1e-12)
    for t, p in ((0, 0), (4, 3), (8, 7)):
        height = (values.points[t, p] - problem.feet.ground[t, p]) @ problem.feet.normals[t, p]
        assert rows[t, 2 * n + p] == pytest.approx(height - problem.feet.clearance[t, p])
    np.testing.assert_array_equal(evaluator.row_active[:, 2 * n :], ~problem.feet.held)


def test_forces_stay_within_each_points_own_friction_pyramid(rough):
    evaluator, _controls, coefficients, _rng = rough
    feet = evaluator.problem.feet
    forces = evaluator.contact_forces(coefficients)
    assert (forces[~feet.held] == 0).all()
    push = (forces * feet.normals).sum(-1)
    along = np.linalg.norm(forces - push[..., None] * feet.normals, axis=-1)
    assert (along <= feet.friction * push + 1e-9).all()
    t, p = np.argwhere(feet.held)[3]
    edges = cone_basis(feet.normals[t : t + 1, p : p + 1], feet.friction[t, p])[0, 0]
    np.testing.assert_allclose(forces[t, p], coefficients[t, 4 * p : 4 * p + 4] @ edges)


def test_held_points_are_pulled_to_targets_and_sliding_ones_to_the_plane_only(rough):
    evaluator, controls, coefficients, _rng = rough
    values, feet = evaluator.values(controls, coefficients), evaluator.problem.feet
    size = np.linalg.norm(values.foot_residuals.reshape(FRAMES, 8, 3), axis=-1)
    away = values.points - feet.targets
    normal_part = np.abs((away * feet.normals).sum(-1))
    wanted = np.where(feet.sliding, normal_part, np.linalg.norm(away, axis=-1)) * feet.held
    np.testing.assert_allclose(size, np.sqrt(1e7) * wanted, atol=1e-9)
    assert feet.sliding.any()
    assert (feet.held & ~feet.sliding).any()


def test_energy_of_springs_in_free_fall_by_hand(all_functions, plain_body):
    """Falling freely, muscles only balance the springs: E = F·Σ α (k·0.1)², eq. (13)."""
    q = throw(plain_body, 8)
    turned = np.where(np.arange(29) % 2, 0.1, -0.1)  # rest below and above the pose
    style = plain_style(0, 0, rest=turned)
    style = replace(
        style, preferences=np.arange(1, 30) / 435,
        passive=replace(style.passive, stiffness_above=np.full(29, 30.0),
                        stiffness_below=np.full(29, 50.0)),
    )  # fmt: skip
    evaluator = Evaluator(flight_problem(all_functions, plain_body, q, style=style))
    values = evaluator.values(evaluator.basis.fit(q), np.zeros((8, 32)))
    stiffness = np.where(turned < 0, 30.0, 50.0)  # the pose is above a rest angle below it
    by_hand = 8 * (style.preferences * (0.1 * stiffness) ** 2).sum()
    assert values.energy == pytest.approx(by_hand, rel=1e-6)


def test_energy_counts_the_root_a_hundredfold(all_functions, plain_body):
    """One frame's E from the forces function and eq. (6), term by term."""
    q = throw(plain_body, 8, wobble=0.05)
    q[:, 6:] += 0.3 * np.sin(np.arange(8))[:, None] * np.linspace(-1, 1, 29)
    style = replace(plain_style(40, 3), preferences=np.arange(1, 30) / 435)
    evaluator = Evaluator(flight_problem(all_functions, plain_body, q, style=style))
    values = evaluator.values(evaluator.basis.fit(q), np.zeros((8, 32)))
    total = 0.0
    for t in range(8):
        state = [a[t : t + 1] for a in (values.coordinates, values.rates, values.accelerations)]
        tau = all_functions["forces"](*state, np.zeros(24), parameter_vector(plain_body))[0][0]
        springs = passive_forces(style.passive, state[0][:, 6:], state[1][:, 6:])[0]
        total += 100 * sum(x**2 for x in tau[:6])
        total += sum(a * (x - s) ** 2 for a, x, s in zip(style.preferences, tau[6:], springs))  # noqa: B905
    assert values.energy == pytest.approx(total, rel=1e-9)
    assert (values.root[:, 1] ** 2).max() > 1


def test_a_body_at_rest_in_the_air_needs_its_weight_from_the_root(all_functions, plain_body):
    q = np.tile([[0.0, 2.0] + [0.0] * 33], (8, 1))
    evaluator = Evaluator(flight_problem(all_functions, plain_body, q))
    values = evaluator.values(evaluator.basis.fit(q), np.zeros((8, 32)))
    weight = plain_body.mass * GRAVITY
    np.testing.assert_allclose(values.root[:, :3], [[0, weight, 0]] * 8, atol=1e-6)


def test_shoes_push_up_when_squeezed_and_not_at_all_above_their_rest(
    all_functions, plain_body, standing
):
    q = np.tile(standing, (8, 1))
    feet = flat_feet(all_functions, plain_body, q, held=True)
    heels = [name.startswith("heel") for name in CONTACT_POINTS]
    for depth, expected in ((0.01, 2e4 * 0.01), (-0.01, 0.0)):
        lowered = replace(feet, ground=feet.targets - [0, 0.03 - depth, 0])
        style = plain_style(shoe=(2e4, 0.03))
        problem = SpacetimeProblem(plain_body, RATE, lowered, FREE, style, all_functions)
        evaluator = Evaluator(problem)
        found = evaluator.values(evaluator.basis.fit(q), np.zeros((8, 32))).shoe_forces
        wanted = np.zeros((8, 8, 3))
        wanted[:, heels, 1] = expected
        np.testing.assert_allclose(found, wanted, atol=0.05)  # the sigmoid's tail is 0.01 N


def test_shoes_lighten_the_root(all_functions, plain_body, standing):
    """What the shoes push, the root needs not."""
    q = np.tile(standing, (8, 1))
    feet = flat_feet(all_functions, plain_body, q, held=True)
    feet = replace(feet, ground=feet.targets - [0, 0.02, 0])
    roots = []
    for shoe in ((0.0, 0.0), (1e4, 0.03)):
        style = plain_style(shoe=shoe)
        evaluator = Evaluator(SpacetimeProblem(plain_body, RATE, feet, FREE, style, all_functions))
        roots.append(evaluator.values(evaluator.basis.fit(q), np.zeros((8, 32))).root[:, 1])
    np.testing.assert_allclose(roots[0] - roots[1], 2 * 1e4 * 0.01, rtol=1e-3)


def test_problems_that_make_no_sense_are_refused(all_functions, plain_body):
    def problem(frames, body):
        return flight_problem(all_functions, body, throw(plain_body, frames))

    with pytest.raises(MotionStyleError, match="7 frames are too few for splines, need 8"):
        problem(7, plain_body)
    for mass in (0.0, np.nan):
        massless = replace(plain_body, masses=np.full_like(plain_body.masses, mass))
        with pytest.raises(MotionStyleError, match=r"mass is \S+ kg, must be positive"):
            SpacetimeProblem(
                massless, RATE, flat_feet(all_functions, plain_body, throw(plain_body, 9),
                held=False), FREE, plain_style(), all_functions, SpacetimeSettings(),
            )  # fmt: skip


def test_foot_constraints_of_other_shapes_or_not_finite_are_refused(all_functions, plain_body):
    feet = flat_feet(all_functions, plain_body, throw(plain_body, 9), held=True)
    with pytest.raises(MotionStyleError, match=r"targets has shape \(9, 8\), expected \(9, 8, 3\)"):
        replace(feet, targets=feet.targets[..., 0])
    ground = feet.ground.copy()
    ground[3, 2, 1] = np.nan
    with pytest.raises(MotionStyleError, match="ground has values not finite"):
        replace(feet, ground=ground)
