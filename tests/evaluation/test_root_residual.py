"""The force at the pelvis: what contacts can bear is not counted, what they cannot is."""

from dataclasses import replace

import numpy as np
import pytest

from motionstyle.body.kinematics import contact_points
from motionstyle.dynamics.codegen import load_functions
from motionstyle.dynamics.functions import dynamics_functions
from motionstyle.dynamics.inverse import GRAVITY
from motionstyle.evaluation.joint_loads import joint_loads
from motionstyle.evaluation.root_residual import (
    ROOT_RESIDUAL_COLUMNS,
    least_root_residual,
    root_residual_row,
)


@pytest.fixture(scope="module")
def functions():
    return load_functions(dynamics_functions, None)


@pytest.fixture
def still(plain_motion, standing):
    """Standing on both feet, without forces."""
    frames = 12
    contacts = np.tile([True, True, True, False], (frames, 2))
    normals = np.tile([0.0, 1.0, 0.0], (frames, 8, 1))
    return replace(
        plain_motion.window(0, frames - 1),
        coordinates=np.tile(standing, (frames, 1)),
        contacts=contacts,
        contact_normals=normals,
        contact_forces=None,
    )


def test_a_person_who_stands_needs_nothing(functions, still):
    loads = joint_loads(still, functions, [])
    np.testing.assert_allclose(loads.root_force[:, 1], still.body.mass * GRAVITY)
    force, moment = least_root_residual(still, loads, 0.8)
    np.testing.assert_allclose(force, 0, atol=1e-6)
    np.testing.assert_allclose(moment, 0, atol=1e-6)


def test_a_person_who_floats_needs_the_weight(functions, still):
    floating = replace(still, contacts=np.zeros_like(still.contacts))
    loads = joint_loads(floating, functions, [])
    force, _moment = least_root_residual(floating, loads, 0.8)
    np.testing.assert_allclose(np.linalg.norm(force, axis=1), still.body.mass * GRAVITY)


def test_a_push_beyond_the_friction_cone_is_left(functions, still):
    """Accelerating at 2 g along x needs twice the weight sideways: friction gives 0.5 of it."""
    t = still.times
    q = still.coordinates.copy()
    q[:, 0] += GRAVITY * t**2
    rushing = replace(still, coordinates=q)
    loads = joint_loads(rushing, functions, [])
    np.testing.assert_allclose(loads.root_force[:, 0], 2 * still.body.mass * GRAVITY, rtol=1e-6)
    force, _moment = least_root_residual(rushing, loads, 0.5)
    assert (np.linalg.norm(force, axis=1) > 0.5 * still.body.mass * GRAVITY).all()


def test_a_row_compares_both_motions(functions, still):
    forces = np.zeros((still.frames, 8, 3))
    points = contact_points(still.body, still.pose())[0]
    forces[:, 1, 1] = still.body.mass * GRAVITY
    lever = points[1] - still.coordinates[0, :3]
    physical = replace(still, contact_forces=forces, provenance={"example": "a", "action": "walk"})
    row = root_residual_row(still, physical, functions, 0.8, "converged", "test")
    assert set(row) <= set(ROOT_RESIDUAL_COLUMNS)
    assert row["id"] == "a"
    assert row["force_before_n"] == pytest.approx(0, abs=1e-6)
    assert row["force_after_n"] == pytest.approx(0, abs=1e-6)  # the weight, but far off the middle
    assert row["moment_after_nm"] > 0.5 * still.body.mass * GRAVITY * np.abs(lever[0])
