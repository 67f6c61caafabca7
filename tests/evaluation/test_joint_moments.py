"""Joint moments: against statics, virtual power and wrenches; rows against the published bands."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionstyle.body.kinematics import contact_points
from motionstyle.body.layout import (
    CONTACT_POINT_NODES,
    CONTACT_POINTS,
    JOINT_SLICES,
    NODE_INDEX,
    NODES,
)
from motionstyle.dynamics.codegen import load_functions
from motionstyle.dynamics.functions import dynamics_functions
from motionstyle.dynamics.inverse import GRAVITY
from motionstyle.dynamics.symbols import parameter_vector
from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.joint_loads import JointLoads, Wrench, joint_loads, spline_rates
from motionstyle.evaluation.joint_moments import (
    INSTANTS,
    JOINT_MOMENT_COLUMNS,
    PLATE_MOMENT_COLUMNS,
    SAGITTAL,
    MeasuredFoot,
    cycle_curves,
    joint_moment_rows,
    measured_foot,
    plate_curves,
    plate_moment_rows,
    seen_cycles,
)
from motionstyle.evaluation.normative import read_normative
from motionstyle.motion.motion import Motion
from motionstyle.motion.opensim_export import BALL_JOINTS, PELVIS, opensim_angles
from motionstyle.spacetime.splines import SplineBasis
from synthetic_walk import make_walk

NORMATIVE = read_normative(Path(__file__).parents[2] / "config" / "normative_gait.yaml")


@pytest.fixture(scope="module")
def functions():
    return load_functions(dynamics_functions, None)


def make_still(body, standing, forces):
    """A body in the zero pose under contact forces (F, 8, 3)."""
    frames = len(forces)
    normals = np.tile([0.0, 1.0, 0.0], (frames, 8, 1))
    q = np.tile(standing, (frames, 1))
    seen = np.ones(35, dtype=bool)
    return Motion("still", "captured", 60.0, q, body, forces[..., 1] > 0, normals, seen, forces)


def test_standing_on_the_forefoot_loads_the_plantarflexors_by_the_lever(
    functions, plain_body, standing
):
    forces = np.zeros((12, 8, 3))
    ball = CONTACT_POINTS.index("ball_lateral_r")
    forces[:, ball, 1] = plain_body.mass * GRAVITY
    motion = make_still(plain_body, standing, forces)
    pose, points = motion.pose(), contact_points(plain_body, motion.pose())
    ankle = pose.positions[0, NODE_INDEX["foot_r"]]
    expected = -plain_body.mass * GRAVITY * (points[0, ball, 0] - ankle[0])
    for node in ("foot_r", "toes_r"):
        k = NODE_INDEX[node]
        com = pose.positions[0, k] + plain_body.coms[k]
        expected += plain_body.masses[k] * GRAVITY * (com[0] - ankle[0])
    found = joint_loads(motion, functions)
    assert expected < -50
    np.testing.assert_allclose(found.moments["ankle_angle_r"], expected, rtol=1e-9)
    np.testing.assert_allclose(found.root_force, 0, atol=1e-8)  # the person's whole weight is borne


def test_moments_and_cardan_rates_have_the_power_of_the_coordinates(functions, plain_motion):
    """Virtual power: what a ball joint's three moments do is what its exponential map does."""
    loads = joint_loads(plain_motion, functions)
    q, qd, qdd = spline_rates(plain_motion)
    contacts = plain_motion.contact_forces.reshape(len(q), -1)
    tau = functions["forces"](q, qd, qdd, contacts, parameter_vector(plain_motion.body))[0]
    angles = opensim_angles(plain_motion)
    for joint in (PELVIS, *BALL_JOINTS):
        if joint.names[0] == "lumbar_extension":
            continue  # its angles span two joints
        node = NODE_INDEX[joint.node]
        block = slice(3, 6) if node == 0 else JOINT_SLICES[node]
        expected = (tau[:, block] * qd[:, block]).sum(axis=1)
        rates = [
            np.gradient(np.radians(angles[n]), 1 / plain_motion.rate_hz, edge_order=2)
            for n in joint.names
        ]
        found = sum(loads.moments[n] * r for n, r in zip(joint.names, rates, strict=True))
        inner = slice(3, -3)
        scale = np.abs(expected).max()
        np.testing.assert_allclose(found[inner], expected[inner], atol=0.01 * scale)


def test_contact_forces_given_as_wrenches_give_the_same_moments(functions, plain_motion):
    """Measured loads enter through NumPy's Jacobian, contact forces through the generated code."""
    points = contact_points(plain_motion.body, plain_motion.pose())
    wrenches = []
    for p, node in enumerate(CONTACT_POINT_NODES):
        force = plain_motion.contact_forces[:, p]
        wrenches.append(Wrench(NODES[node], force, np.cross(points[:, p], force)))
    own, given = (joint_loads(plain_motion, functions, w) for w in (None, wrenches))
    for name, values in own.columns().items():
        np.testing.assert_allclose(given.columns()[name], values, atol=1e-7, err_msg=name)
    assert np.abs(own.root_force - joint_loads(plain_motion, functions, []).root_force).max() > 100


def test_rates_of_a_sampled_spline_are_exact_up_to_its_ends(plain_motion):
    frames, rng = 101, np.random.default_rng(1)
    basis = SplineBasis.uniform(frames, 60.0, 4.0)
    q, qd, qdd = basis.evaluate(0.3 * rng.standard_normal((basis.controls, 35)))
    motion = replace(plain_motion.window(0, frames - 1), rate_hz=60.0, coordinates=q)
    _q, rates, bends = spline_rates(motion)
    np.testing.assert_allclose(rates, qd, atol=2e-3 * np.abs(qd).max())
    np.testing.assert_allclose(bends, qdd, atol=2e-3 * np.abs(qdd).max())


def test_a_motion_without_forces_is_refused_with_the_way_out(functions, plain_motion):
    with pytest.raises(MotionStyleError, match=r"no contact forces.*plain_physical"):
        joint_loads(replace(plain_motion, contact_forces=None), functions)


def test_a_plate_is_brought_to_the_frames_with_its_moment_about_the_origin():
    times = np.arange(0, 1, 0.001)
    force = np.tile([10.0, 700.0, -20.0], (1000, 1))
    centre, free = np.tile([0.4, 0.0, 0.1], (1000, 1)), np.tile([0.0, 3.0, 0.0], (1000, 1))
    foot = measured_foot(times, force, centre, free, np.array([-0.5, 0.25, 0.5, 2.0]))
    assert foot.loaded.tolist() == [False, True, True, False]
    np.testing.assert_allclose(foot.force[1], force[0], rtol=1e-6)
    np.testing.assert_allclose(foot.moment[1], np.cross(centre[0], force[0]) + free[0], rtol=1e-6)
    np.testing.assert_array_equal(foot.force[[0, 3]], 0)


def loads_of(motion, values):
    """Loads whose sagittal moments stay at some values, N·m/kg, all through the motion."""
    moments = {
        f"{name}_{side}": np.full(motion.frames, values[joint] * motion.body.mass)
        for joint, name in SAGITTAL.items()
        for side in "rl"
    }
    nothing = np.zeros((motion.frames, 3))
    return JointLoads(moments, nothing, nothing)


@pytest.fixture(scope="module")
def walk():
    return make_walk(action="walk", surface="level", style="neutral", dataset="made")


def test_rows_hold_each_side_joint_and_instant_against_its_band(walk):
    rows = joint_moment_rows(walk, loads_of(walk, {"hip": 0.2, "knee": 0.2, "ankle": -1.1}),
                             NORMATIVE, "test")  # fmt: skip
    assert all(set(row) <= set(JOINT_MOMENT_COLUMNS) for row in rows)
    keys = {(r["side"], r["joint"], r["cycle_pct"]) for r in rows}
    assert len(rows) == len(keys) == 2 * 3 * 3
    inside = {(r["joint"], r["cycle_pct"]): r["inside_band"] for r in rows}
    assert [inside["hip", p] for p in INSTANTS] == [False, True, True]
    assert [inside["knee", p] for p in INSTANTS] == [True, True, True]
    assert [inside["ankle", p] for p in INSTANTS] == ["", True, True]
    assert all(r["has_cycle"] and r["moment_nm_per_kg"] == pytest.approx(
        {"hip": 0.2, "knee": 0.2, "ankle": -1.1}[r["joint"]]) for r in rows)  # fmt: skip


def test_movements_without_a_published_band_have_values_alone(walk):
    run = replace(walk, provenance={**walk.provenance, "action": "run"})
    rows = joint_moment_rows(run, loads_of(run, dict.fromkeys(SAGITTAL, 0.1)), NORMATIVE, "test")
    assert not any(r["has_band"] for r in rows)
    assert {r["inside_band"] for r in rows} == {""}
    assert all(np.isfinite(r["moment_nm_per_kg"]) for r in rows)


def test_a_clip_without_a_cycle_has_rows_without_values(walk):
    short = walk.window(0, 60)
    rows = joint_moment_rows(
        short, loads_of(short, dict.fromkeys(SAGITTAL, 0.1)), NORMATIVE, "test"
    )
    assert not any(r["has_cycle"] for r in rows)
    assert all(np.isnan(r["moment_nm_per_kg"]) for r in rows)


def foot_of(motion, loaded):
    nothing = np.zeros((motion.frames, 3))
    return MeasuredFoot(nothing, nothing, loaded)


def test_a_cycle_is_compared_only_if_the_plate_bears_its_stance(walk):
    on = walk.contacts[:, :4].any(axis=1)
    assert len(seen_cycles(walk, "r", foot_of(walk, on))) == 3
    first_only = on & (np.arange(walk.frames) < 130)
    assert seen_cycles(walk, "r", foot_of(walk, first_only)) == [(30, 130)]
    assert seen_cycles(walk, "r", foot_of(walk, ~on)) == []


def test_moments_under_plates_are_compared_where_the_plate_bears_the_foot(walk):
    ours, theirs = (loads_of(walk, dict.fromkeys(SAGITTAL, v)) for v in (0.5, 0.2))
    loaded = np.arange(walk.frames) < 50
    feet = {"r": foot_of(walk, loaded), "l": foot_of(walk, np.zeros(walk.frames, dtype=bool))}
    rows = plate_moment_rows(walk, ours, theirs, feet, "test")
    assert all(set(row) <= set(PLATE_MOMENT_COLUMNS) for row in rows)
    right, left = ([r for r in rows if r["side"] == s] for s in "rl")
    assert [r["rms_difference_nm_per_kg"] for r in right] == pytest.approx([0.3] * 3)
    assert {r["seconds_compared"] for r in right} == {0.5}
    assert {(r["status"], "fewer than 5" in r["reason"]) for r in left} == {("not compared", True)}
    curve = plate_curves(walk, ours, theirs, feet)[0]
    assert [v is None for v in curve["measured"][0]] == (~loaded).tolist()
    seen = cycle_curves(walk, ours, NORMATIVE, theirs, feet)
    assert list(seen["estimated"]["hip"]) == ["r", "l"]
    assert seen["measured"]["hip"] == {}


def test_a_force_behind_the_knee_loads_its_extensors(functions, plain_body, standing):
    forces = np.zeros((12, 8, 3))
    heel = CONTACT_POINTS.index("heel_l")
    forces[:, heel, 1] = plain_body.mass * GRAVITY
    found = joint_loads(make_still(plain_body, standing, forces), functions)
    assert (found.moments["knee_angle_l"] < -10).all()  # heel behind the knee: extensors
