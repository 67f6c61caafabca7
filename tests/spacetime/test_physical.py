"""The physics fit: what obeys already stays, what does not is made to, and says how well."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from motionstyle.body.kinematics import centre_of_mass, points_in_world
from motionstyle.body.layout import COORDINATE_INDEX
from motionstyle.dynamics.codegen import load_functions
from motionstyle.dynamics.functions import dynamics_functions
from motionstyle.dynamics.inverse import GRAVITY
from motionstyle.dynamics.symbols import parameter_vector
from motionstyle.errors import MotionStyleError
from motionstyle.motion.markers import MarkerPaths
from motionstyle.motion.motion import Motion
from motionstyle.spacetime.physical import fit_physical
from motionstyle.spacetime.physical_problem import PhysicalSettings


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


def test_a_still_body_bears_its_weight(functions, plain_body):
    """The known truth of statics: m g within a thousandth, and nothing along the floor.

    Away from the clip's ends, where a spline's acceleration is held by markers on one side only.
    """
    still = standing(plain_body)
    q = np.tile(still.coordinates[:1], (still.frames, 1))
    q[:, 20] = 0.0
    fit = fit_physical(
        replace(still, coordinates=q), functions, PhysicalSettings(shoes=False), silent
    )
    force = fit.motion.contact_forces.sum(axis=1)[5:-5]
    weight = plain_body.mass * GRAVITY
    assert fit.report["status"] == "converged"
    assert force[:, 1].mean() == pytest.approx(weight, rel=1e-3)
    assert np.abs(force[:, [0, 2]]).max() < 0.01 * weight


def squatting(body, frames=30):
    """Both feet stand while hips, knees and ankles bend alike, so that the trunk sinks and rises.

    Its centre of mass stays over the feet: the thighs go forward by as much as the shanks.
    """
    still = standing(body, frames)
    thigh, shank = -body.joint_offsets[[2, 3], 1]
    t = np.arange(frames) / 30.0
    hip = 0.35 * (1 - np.cos(6 * t)) / 2
    ankle = np.arcsin(thigh / shank * np.sin(hip))
    q = np.zeros((frames, 35))
    q[:, 1] = still.coordinates[0, 1] - thigh * (1 - np.cos(hip)) - shank * (1 - np.cos(ankle))
    for side in "rl":
        q[:, COORDINATE_INDEX[f"hip_flexion_{side}"]] = hip
        q[:, COORDINATE_INDEX[f"knee_flexion_{side}"]] = hip + ankle
        q[:, COORDINATE_INDEX[f"ankle_dorsiflexion_{side}"]] = ankle
    return replace(still, coordinates=q)


def test_the_known_forces_of_a_squat_are_recovered(functions, plain_body):
    """m (g + a) of the centre of mass, by differences of the given motion, on two equal feet."""
    motion = squatting(plain_body)
    fit = fit_physical(motion, functions, PhysicalSettings(shoes=False), silent)
    assert fit.report["status"] == "converged"
    height = centre_of_mass(plain_body, motion.pose())[:, 1]
    rise = np.gradient(np.gradient(height, 1 / 30), 1 / 30)
    truth = plain_body.mass * (GRAVITY + rise)
    force = fit.motion.contact_forces
    inner = slice(4, -4)
    weight = plain_body.mass * GRAVITY
    np.testing.assert_allclose(
        force.sum(axis=1)[inner, 1] / weight, truth[inner] / weight, atol=0.02
    )
    assert truth[inner].max() - truth[inner].min() > 0.1 * weight  # not the still body's
    right, left = force[:, :4, 1].sum(axis=1), force[:, 4:, 1].sum(axis=1)
    assert np.abs(right - left).mean() < 0.05 * weight


def test_no_foot_no_force_between_two_jumps(functions, plain_body):
    """Free flight between stances: nothing pushes while no foot stands."""
    still = standing(plain_body, 24)
    contacts = still.contacts.copy()
    contacts[8:16] = False
    q = still.coordinates.copy()
    flight = np.arange(-4.5, 4.5) / 30.0
    q[8:17, 1] += GRAVITY / 2 * (4.5**2 / 900 - flight**2)
    jump = replace(still, coordinates=q, contacts=contacts)
    settings = PhysicalSettings(shoes=False, spread_s=0.0)
    fit = fit_physical(jump, functions, settings, silent)
    assert (fit.motion.contact_forces[8:16] == 0).all()
    assert fit.motion.contact_forces[:8, :, 1].sum(axis=1).mean() > 0.5 * plain_body.mass * GRAVITY


def stairs(body):
    """A body that stands on its right foot, lower, then on its left, higher by one stair."""
    still = standing(body, 30)
    contacts = np.zeros((30, 8), dtype=bool)
    contacts[:16, :4] = contacts[14:, 4:] = True
    q = np.array(still.coordinates)
    for side, bent in (("r", slice(15, 30)), ("l", slice(0, 15))):
        q[bent, COORDINATE_INDEX[f"knee_flexion_{side}"]] = 0.6
        q[bent, COORDINATE_INDEX[f"hip_flexion_{side}"]] = 0.3
    q[15:, 1] += 0.17
    q = gaussian_filter1d(q, 3, axis=0)
    provenance = {**still.provenance, "surface": "stairs"}
    return replace(still, coordinates=q, contacts=contacts, provenance=provenance)


def test_stairs_are_planes_of_their_own(functions, plain_body):
    fit = fit_physical(stairs(plain_body), functions, PhysicalSettings(shoes=False), silent)
    force = fit.motion.contact_forces
    weight = plain_body.mass * GRAVITY
    assert fit.report["marker_rms_cm"] < 5  # the made-up climb is no physical one
    assert fit.report["foot_slip_mm"] < 15
    assert force[2:10, :4, 1].sum(axis=1).mean() > 0.5 * weight
    assert force[20:28, 4:, 1].sum(axis=1).mean() > 0.5 * weight
    assert (force[20:, :4] == 0).all()


def test_measured_markers_are_the_targets(functions, plain_body):
    """A constant offset of one marker is no motion: the fit stays, and reports it as distance."""
    motion = standing(plain_body)
    nodes = np.array([0, 0, 0, 3, 3, 3, 7, 7, 7, 10, 10, 10])
    local = np.random.default_rng(3).normal(0, 0.1, (12, 3))
    paths = points_in_world(motion.pose(), nodes, local)
    noisy = paths + np.random.default_rng(4).normal(0, 0.005, paths.shape)
    names = tuple(str(k) for k in range(12))
    markers = MarkerPaths(names, nodes, local, noisy, paths, np.ones(paths.shape[:2]), 30.0)
    fit = fit_physical(motion, functions, PhysicalSettings(shoes=False), silent, markers=markers)
    assert fit.report["markers"] == "measured"
    expected = 100 * np.sqrt(((noisy - paths) ** 2).sum(axis=-1).mean())
    assert fit.report["marker_rms_cm"] == pytest.approx(expected, rel=0.2)
    short = replace(markers, smooth=paths[:20])
    with pytest.raises(MotionStyleError, match="24 frames, but its markers have 20"):
        fit_physical(motion, functions, PhysicalSettings(), silent, markers=short)


def test_a_failed_fit_is_diagnosed(functions, plain_body):
    hovering = replace(standing(plain_body), contacts=np.zeros((24, 8), dtype=bool))
    fit = fit_physical(hovering, functions, PhysicalSettings(outer=2, inner=2), silent)
    worst = fit.diagnosis["worst"]
    assert fit.diagnosis["status"] == "not converged"
    assert "root force" in fit.report["reason"]
    assert worst[0]["constraint"].startswith("root")
    assert 0 <= worst[0]["frame"] < 24
    assert set(fit.diagnosis["terms"]) >= {"markers", "root residual", "joint torques"}
