"""Inverse dynamics against pinocchio on random states: goal 1e-8 relative."""

import numpy as np
import pytest

from motionstyle.body.layout import CONTACT_POINTS, NODES
from motionstyle.dynamics.codegen import load_functions
from motionstyle.dynamics.functions import dynamics_functions
from motionstyle.dynamics.referee import pinocchio_model, pinocchio_state
from motionstyle.dynamics.symbols import parameter_vector

pin = pytest.importorskip("pinocchio")


def test_forces_equal_pinocchio(plain_body):
    functions = load_functions(dynamics_functions, None)
    model, _ = pinocchio_model(pin, plain_body)
    np.testing.assert_array_equal(model.gravity.linear, [0, -9.81, 0])
    data = model.createData()
    rng = np.random.default_rng(11)
    for _ in range(20):
        q, qd, qdd = (rng.standard_normal(35) * s for s in (0.5, 2.0, 8.0))
        tau = functions["forces"](
            q[None], qd[None], qdd[None], np.zeros((1, 24)), parameter_vector(plain_body)
        )[0][0]
        place, rate, second, g = pinocchio_state(pin, q, qd, qdd)
        wanted = g.T @ pin.rnea(model, data, place, rate, second)
        # the slope of the right Jacobian is a difference: it limits this to 1e-8
        np.testing.assert_allclose(tau, wanted, atol=1e-8 * np.abs(wanted).max())


def test_contact_forces_equal_pinocchio(plain_body):
    functions = load_functions(dynamics_functions, None)
    model, last = pinocchio_model(pin, plain_body)
    data = model.createData()
    rng = np.random.default_rng(12)
    q, qd, qdd = (rng.standard_normal(35) * s for s in (0.4, 1.0, 4.0))
    forces = rng.standard_normal((8, 3)) * 200
    place, rate, second, g = pinocchio_state(pin, q, qd, qdd)
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
