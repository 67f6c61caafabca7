"""The physics fit: what obeys already stays, what does not is made to, and says how well."""

from dataclasses import replace

import numpy as np
import pytest

from motionstyle.dynamics.codegen import load_functions
from motionstyle.dynamics.functions import dynamics_functions
from motionstyle.dynamics.inverse import GRAVITY
from motionstyle.dynamics.symbols import parameter_vector
from motionstyle.errors import MotionStyleError
from motionstyle.motion.motion import Motion
from motionstyle.spacetime.physical import PhysicalSettings, fit_physical


@pytest.fixture(scope="module")
def functions():
    return load_functions(dynamics_functions, None)


def silent(_text):
    pass


def falling(body, frames=20, wobble=0.0):
    """A body thrown upwards, not turning, with an optional unphysical wobble of its height (m)."""
    t = np.arange(frames) / 30.0
    q = np.zeros((frames, 35))
    q[:, 0] = 1.2 * t
    q[:, 1] = 2.0 + 3.0 * t - GRAVITY / 2 * t**2 + wobble * np.sin(9 * t)
    points = np.zeros((frames, 8), dtype=bool)
    normals = np.tile([0.0, 1.0, 0.0], (frames, 8, 1))
    return Motion("thrown", "captured", 30.0, q, body, points, normals, np.ones(35, dtype=bool))


def test_a_throw_needs_no_change(functions, plain_body):
    fit = fit_physical(falling(plain_body), functions, PhysicalSettings(), silent)
    assert fit.report["status"] == "converged"
    assert fit.report["marker_rms_cm"] < 0.01
    assert (fit.motion.contact_forces == 0).all()


def test_flight_is_made_a_parabola(functions, plain_body):
    wrong = falling(plain_body, wobble=0.02)
    fit = fit_physical(wrong, functions, PhysicalSettings(), silent)
    assert fit.report["root_force_rms_n"] < 0.5
    t, height = wrong.times, fit.motion.coordinates[:, 1]
    parabola = np.polyfit(t, height, 2)
    assert 2 * parabola[0] == pytest.approx(-GRAVITY, abs=0.02)
    assert fit.report["marker_rms_cm"] < 2.5


def standing(body, frames=24):
    """A body that stands on both feet and sways a little."""
    points = body.geometry.contact_points
    low = min(points[k][1] for k in (0, 4))
    leg = -body.joint_offsets[[2, 3], 1].sum() - low
    t = np.arange(frames) / 30.0
    q = np.zeros((frames, 35))
    q[:, 1] = leg
    q[:, 20] = 0.05 * np.sin(4 * t)
    contacts = np.ones((frames, 8), dtype=bool)
    normals = np.tile([0.0, 1.0, 0.0], (frames, 8, 1))
    return Motion("stands", "captured", 30.0, q, body, contacts, normals, np.ones(35, dtype=bool))


def test_standing_feet_carry_the_weight(functions, plain_body):
    fit = fit_physical(standing(plain_body), functions, PhysicalSettings(), silent)
    assert fit.report["status"] == "converged"
    force = fit.motion.contact_forces.sum(axis=1)
    weight = plain_body.mass * GRAVITY
    assert force[:, 1].mean() == pytest.approx(weight, rel=0.01)
    sliding = np.linalg.norm(fit.motion.contact_forces[..., [0, 2]], axis=-1)
    assert (sliding <= 0.8 * fit.motion.contact_forces[..., 1] + 1e-9).all()
    assert fit.report["foot_slip_mm"] < 5


def test_the_reported_residual_is_that_of_the_returned_motion(functions, plain_body):
    """Recomputed from the returned motion's own spline, forces included."""
    motion = standing(plain_body)
    fit = fit_physical(motion, functions, PhysicalSettings(), silent)
    from motionstyle.spacetime.splines import SplineBasis

    basis = SplineBasis.uniform(motion.frames, 30.0, 2.0)
    q, qd, qdd = basis.evaluate(basis.fit(fit.motion.coordinates))
    forces = fit.motion.contact_forces.reshape(len(q), 24)
    tau = functions["forces"](q, qd, qdd, forces, parameter_vector(plain_body))[0]
    rms = np.sqrt((tau[:, :3] ** 2).sum(axis=1).mean())
    assert rms == pytest.approx(fit.report["root_force_rms_n"], abs=0.3)


def test_a_motion_that_cannot_obey_says_so(functions, plain_body):
    hovering = replace(standing(plain_body), contacts=np.zeros((24, 8), dtype=bool))
    strict = PhysicalSettings(outer=2, inner=2)
    fit = fit_physical(hovering, functions, strict, silent)
    assert fit.report["status"] == "not converged"
    assert fit.report["root_force_rms_n"] > 1


def test_too_short_a_motion_is_refused(functions, plain_body):
    with pytest.raises(MotionStyleError, match="6 frames are too few, need 8"):
        fit_physical(falling(plain_body, 6), functions, PhysicalSettings(), silent)
