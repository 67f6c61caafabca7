"""The fit's cost and its model: slopes by differences, with shoes, markers and stairs."""

from dataclasses import replace

import numpy as np
import pytest

from motionstyle.body.kinematics import forward_kinematics, points_in_world
from motionstyle.dynamics.codegen import load_functions
from motionstyle.dynamics.functions import dynamics_functions
from motionstyle.dynamics.shoes import Shoes
from motionstyle.motion.markers import MarkerPaths
from motionstyle.motion.motion import Motion
from motionstyle.spacetime.physical_problem import PhysicalSettings, set_up
from motionstyle.spacetime.physical_step import (
    Variables,
    evaluate,
    force_costs,
    kinematic,
    kinematic_costs,
    step,
)


@pytest.fixture(scope="module")
def functions():
    return load_functions(dynamics_functions, None)


def shifting(body, frames=12):
    """A standing body that sways and steps: right foot first, both, left foot."""
    leg = -body.joint_offsets[[2, 3], 1].sum() - body.geometry.contact_points[0, 1]
    t = np.arange(frames) / 30.0
    q = np.zeros((frames, 35))
    q[:, 1] = leg - 0.004 * np.cos(5 * t)
    q[:, 2] = 0.02 * np.sin(5 * t)
    q[:, 20] = 0.05 * np.sin(4 * t)
    contacts = np.zeros((frames, 8), dtype=bool)
    contacts[:8, :4] = contacts[4:, 4:] = True
    normals = np.tile([0.0, 1.0, 0.0], (frames, 8, 1))
    return Motion("sways", "captured", 30.0, q, body, contacts, normals, np.ones(35, dtype=bool))


def measured(motion):
    """Markers on pelvis, thorax and feet, a centimetre off, one unseen for some frames."""
    rng = np.random.default_rng(4)
    nodes = np.array([0, 0, 0, 10, 10, 3, 3, 7, 7])
    local = rng.normal(0, 0.1, (9, 3))
    paths = points_in_world(forward_kinematics(motion.body, motion.coordinates), nodes, local)
    paths += rng.normal(0, 0.01, (1, 9, 3))
    weights = np.ones(paths.shape[:2])
    weights[3:6, 4] = 0
    names = tuple("abcdefghi")
    return MarkerPaths(names, nodes, local, paths, paths, weights, motion.rate_hz)


@pytest.mark.parametrize("shoes", [None, Shoes(18000.0, 0.008)])
@pytest.mark.parametrize("with_markers", [False, True])
def test_the_models_slope_is_that_of_the_cost(functions, plain_body, shoes, with_markers):
    motion = shifting(plain_body)
    problem = set_up(
        motion,
        functions,
        PhysicalSettings(shoes=shoes is not None),
        measured(motion) if with_markers else None,
    )
    rng = np.random.default_rng(7)
    problem.shift = rng.normal(0, 3, problem.shift.shape)
    controls = problem.basis.fit(motion.coordinates)
    controls = controls + rng.normal(0, 2e-3, controls.shape)
    here = Variables(controls, shoes)
    state = evaluate(problem, here)
    from motionstyle.spacetime.physical_step import SHOE_SCALE, _model
    from motionstyle.spacetime.splines import BandedSystem

    model = _model(problem, here, state)
    _, gradient = BandedSystem(problem.basis, 35).assemble(model.hessians, model.gradients)
    for _ in range(3):
        along = rng.normal(0, 1, controls.shape)
        shoe_along = rng.normal(0, 1, 2) if shoes else np.zeros(2)
        e = 1e-6
        ahead = evaluate(problem, here.moved(e * along, e * shoe_along * SHOE_SCALE)).cost
        back = evaluate(problem, here.moved(-e * along, -e * shoe_along * SHOE_SCALE)).cost
        slope = float((gradient * along).sum()) + float(model.shoe_gradient @ shoe_along)
        assert (ahead - back) / (2 * e) == pytest.approx(slope, rel=2e-3, abs=0.05 * abs(slope))


def test_terms_add_up_to_the_cost(functions, plain_body):
    motion = shifting(plain_body)
    problem = set_up(motion, functions, PhysicalSettings(shoes=False, ridge_n=1e6))
    state = evaluate(problem, Variables(problem.basis.fit(motion.coordinates), None))
    shown = kinematic(problem, state.coordinates)
    terms = {**kinematic_costs(problem, state.coordinates, shown), **force_costs(problem, state)}
    assert sum(terms.values()) == pytest.approx(state.cost, rel=1e-4)


def test_a_tiny_step_falls_as_promised(functions, plain_body):
    motion = shifting(plain_body)
    problem = set_up(motion, functions, PhysicalSettings())
    here = Variables(problem.basis.fit(motion.coordinates), problem.shoes)
    state = evaluate(problem, here)
    taken = step(problem, here, state, 1e3)
    assert taken.state.cost < state.cost
    assert state.cost - taken.state.cost <= 2.05 * taken.promised


def test_shoes_stay_within_their_bounds(functions, plain_body):
    motion = shifting(plain_body)
    settings = PhysicalSettings(shoe_rest_m=0.0, shoe_stiffness=1e5)
    problem = set_up(motion, functions, settings)
    here = Variables(problem.basis.fit(motion.coordinates), problem.shoes)
    state = evaluate(problem, here)
    for _ in range(4):
        taken = step(problem, here, state, 1e-3)
        here, state = taken.variables, taken.state
        assert 0 <= here.shoes.stiffness <= 1e5
        assert 0 <= here.shoes.rest_length <= 0.04


def test_what_feet_are_expected_to_bear_is_what_the_motion_needs(functions, plain_body):
    motion = replace(shifting(plain_body, 24), coordinates=np.tile(
        shifting(plain_body).coordinates[:1], (24, 1)
    ))  # fmt: skip
    problem = set_up(motion, functions, PhysicalSettings())
    weight = plain_body.mass * 9.81
    np.testing.assert_allclose(np.nansum(problem.expected, axis=1), weight, rtol=1e-3)
    np.testing.assert_allclose(problem.settled.sum(axis=1), weight, rtol=1e-3)
    assert (problem.settled[~problem.bearing] == 0).all()
