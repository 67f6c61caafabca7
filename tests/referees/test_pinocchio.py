"""Inverse dynamics against pinocchio on random states: goal 1e-8 relative."""

import numpy as np
import pytest

from motionstyle.body.layout import CONTACT_POINTS, JOINT_SLICES, JOINTS, NODES, PARENTS
from motionstyle.body.rotations import exponential, left_jacobian
from motionstyle.dynamics.codegen import load_functions
from motionstyle.dynamics.functions import dynamics_functions
from motionstyle.dynamics.symbols import parameter_vector

pin = pytest.importorskip("pinocchio")


def model_of(body):
    """The same body out of pinocchio's own joints; returns it and each node's last joint."""
    model = pin.Model()
    last = {}
    for i, joint in enumerate(JOINTS):
        parent = last[PARENTS[i]] if PARENTS[i] >= 0 else 0
        place = pin.SE3(np.eye(3), body.joint_offsets[i])
        if joint.kind == "weld":
            inertia = pin.Inertia(body.masses[i], body.coms[i], body.inertias[i])
            model.appendBodyToJoint(parent, inertia, place)
            last[i] = parent
            continue
        if joint.kind == "free":
            kinds = [pin.JointModelTranslation(), pin.JointModelSpherical()]
        elif joint.kind == "exponential":
            kinds = [pin.JointModelSpherical()]
        else:
            kinds = [pin.JointModelRevoluteUnaligned(np.array(axis)) for axis in joint.axes]
        for k, kind in enumerate(kinds):
            at = place if k == 0 else pin.SE3.Identity()
            parent = model.addJoint(parent, kind, at, f"{joint.node}{k}")
        inertia = pin.Inertia(body.masses[i], body.coms[i], body.inertias[i])
        model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
        last[i] = parent
    return model, last


def right_jacobian(v):
    return left_jacobian(-v)


def to_pinocchio(q, qd, qdd):
    """Return pinocchio's configuration, velocity, acceleration and G with τ = Gᵀ τ_pin."""
    place, rate, second, g = [], [], [], np.zeros((35, 35))
    for joint, block in zip(JOINTS, JOINT_SLICES, strict=True):
        if joint.kind == "free":
            place += list(q[:3])
            rate += list(qd[:3])
            second += list(qdd[:3])
            g[:3, :3] = np.eye(3)
            block = slice(3, 6)  # noqa: PLW2901 - the translations are done
        if joint.kind in {"free", "exponential"}:
            basis = np.array(joint.axes)[-3:].T
            v, vd, vdd = (basis @ x[block] for x in (q, qd, qdd))
            quaternion = pin.Quaternion(exponential(v)).coeffs()
            step = 1e-6
            slope = (right_jacobian(v + step * vd) - right_jacobian(v - step * vd)) / (2 * step)
            place += list(quaternion)
            rate += list(right_jacobian(v) @ vd)
            second += list(right_jacobian(v) @ vdd + slope @ vd)
            g[block, block] = right_jacobian(v) @ basis
        elif joint.names:
            place += list(q[block])
            rate += list(qd[block])
            second += list(qdd[block])
            g[block, block] = np.eye(len(joint.names))
    return np.array(place), np.array(rate), np.array(second), g


def test_forces_equal_pinocchio(plain_body):
    functions = load_functions(dynamics_functions, None)
    model, _ = model_of(plain_body)
    model.gravity = pin.Motion(np.array([0, -9.81, 0]), np.zeros(3))
    data = model.createData()
    rng = np.random.default_rng(11)
    for _ in range(20):
        q, qd, qdd = (rng.standard_normal(35) * s for s in (0.5, 2.0, 8.0))
        tau = functions["forces"](
            q[None], qd[None], qdd[None], np.zeros((1, 24)), parameter_vector(plain_body)
        )[0][0]
        place, rate, second, g = to_pinocchio(q, qd, qdd)
        wanted = g.T @ pin.rnea(model, data, place, rate, second)
        # the slope of the right Jacobian is a difference: it limits this to 1e-8
        np.testing.assert_allclose(tau, wanted, atol=1e-8 * np.abs(wanted).max())


def test_contact_forces_equal_pinocchio(plain_body):
    functions = load_functions(dynamics_functions, None)
    model, last = model_of(plain_body)
    model.gravity = pin.Motion(np.array([0, -9.81, 0]), np.zeros(3))
    data = model.createData()
    rng = np.random.default_rng(12)
    q, qd, qdd = (rng.standard_normal(35) * s for s in (0.4, 1.0, 4.0))
    forces = rng.standard_normal((8, 3)) * 200
    place, rate, second, g = to_pinocchio(q, qd, qdd)
    pin.forwardKinematics(model, data, place)
    external = [pin.Force.Zero() for _ in range(model.njoints)]
    for k, name in enumerate(CONTACT_POINTS):
        node = NODES.index(f"{'toes' if name.startswith('toe') else 'foot'}_{name[-1]}")
        local = data.oMi[last[node]].rotation.T @ forces[k]
        arm = plain_body.geometry.contact_points[k]
        external[last[node]] += pin.Force(local, np.cross(arm, local))
    wanted = g.T @ pin.rnea(model, data, place, rate, second, external)
    found = functions["forces"](
        q[None], qd[None], qdd[None], forces.reshape(1, 24), parameter_vector(plain_body)
    )[0][0]
    np.testing.assert_allclose(found, wanted, atol=1e-8 * np.abs(wanted).max())
