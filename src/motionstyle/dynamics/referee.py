"""The same body out of pinocchio's own joints, for tests and the benchmark.

pinocchio (package `pin`) is no dependency of the program: callers import it and pass it on.
"""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.body import Body
from motionstyle.body.layout import JOINT_SLICES, JOINTS, PARENTS
from motionstyle.body.rotations import exponential, left_jacobian
from motionstyle.dynamics.inverse import GRAVITY

Array = NDArray[np.float64]


def pinocchio_model(pin: ModuleType, body: Body) -> tuple[Any, dict[int, int]]:
    """Return pinocchio's model of a body, gravity along −y, and each node's last joint in it."""
    model = pin.Model()
    last: dict[int, int] = {}
    for i, joint in enumerate(JOINTS):
        parent = last[PARENTS[i]] if PARENTS[i] >= 0 else 0
        place = pin.SE3(np.eye(3), body.joint_offsets[i])
        inertia = pin.Inertia(body.masses[i], body.coms[i], body.inertias[i])
        if joint.kind == "weld":
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
        model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
        last[i] = parent
    model.gravity = pin.Motion(np.array([0, -GRAVITY, 0]), np.zeros(3))
    return model, last


def _right_jacobian(v: Array) -> Array:
    return left_jacobian(-v)


def pinocchio_state(
    pin: ModuleType, q: Array, qd: Array, qdd: Array
) -> tuple[Array, Array, Array, Array]:
    """Return pinocchio's configuration, velocity and acceleration, and G with τ = Gᵀ τ_pin.

    Ball joints are quaternions with angular velocities there and exponential maps here; the
    rate of the right Jacobian between them is a central difference, good to about 1e-10.
    """
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
            step = 1e-6
            slope = (_right_jacobian(v + step * vd) - _right_jacobian(v - step * vd)) / (2 * step)
            place += list(pin.Quaternion(exponential(v)).coeffs())
            rate += list(_right_jacobian(v) @ vd)
            second += list(_right_jacobian(v) @ vdd + slope @ vd)
            g[block, block] = _right_jacobian(v) @ basis
        elif joint.names:
            place += list(q[block])
            rate += list(qd[block])
            second += list(qdd[block])
            g[block, block] = np.eye(len(joint.names))
    return np.array(place), np.array(rate), np.array(second), g
