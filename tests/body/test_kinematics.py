"""Signs of every coordinate, one by one; positions and Jacobians against finite differences."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionstyle.body.kinematics import (
    centre_of_mass,
    contact_points,
    coordinate_axes,
    end_points,
    forward_kinematics,
    point_jacobian,
    points_in_world,
)
from motionstyle.body.layout import (
    CONTACT_POINT_NODES,
    CONTACT_POINTS,
    COORDINATE_INDEX,
    COORDINATE_NODE,
    COORDINATES,
    END_POINT_NODES,
    JOINTS,
    NODE_INDEX,
    PARENTS,
)

X, Y, Z = np.eye(3)
OUTWARDS = {"r": Z, "l": -Z}


def posed(body, standing, **degrees):
    """Points by name of the standing pose with some joint angles changed."""
    q = standing.copy()
    for name, value in degrees.items():
        q[0, COORDINATE_INDEX[name]] = np.radians(value)
    pose = forward_kinematics(body, q)
    found = {name: pose.positions[0, i] for name, i in NODE_INDEX.items()}
    found |= dict(zip(CONTACT_POINTS, contact_points(body, pose)[0], strict=True))
    names = ("head_top", "fingertip_r", "fingertip_l")
    return found | dict(zip(names, end_points(body, pose)[0], strict=True))


def moved(body, standing, point, **degrees):
    """How far a point moves (m) when joint angles change."""
    return posed(body, standing, **degrees)[point] - posed(body, standing)[point]


def random_coordinates(frames, seed=3):
    rng = np.random.default_rng(seed)
    q = rng.uniform(-1.2, 1.2, size=(frames, len(COORDINATES)))
    q[:, 3:6] *= 2.0
    return q


def test_standing_zero_pose(plain_body, standing):
    at = posed(plain_body, standing)
    assert np.isclose(at["head_top"][1], 1.74)
    assert np.allclose([at[name][1] for name in CONTACT_POINTS], 0, atol=1e-12)
    for side, outwards in OUTWARDS.items():
        assert at[f"thigh_{side}"] @ outwards > 0.05
        assert at[f"toe_{side}"][0] > at[f"ball_medial_{side}"][0] > 0.05
        assert at[f"heel_{side}"][0] < 0
        assert at[f"fingertip_{side}"][1] < at[f"hand_{side}"][1] < at[f"forearm_{side}"][1]
        medial, lateral = at[f"ball_medial_{side}"], at[f"ball_lateral_{side}"]
        assert (lateral - medial) @ outwards > 0.05


@pytest.mark.parametrize("side", ["r", "l"])
class TestSignsOfBothSides:
    def test_hip_flexion_moves_the_knee_forward(self, plain_body, standing, side):
        step = moved(plain_body, standing, f"shank_{side}", **{f"hip_flexion_{side}": 30})
        assert step[0] > 0.15
        assert abs(step[2]) < 1e-12

    def test_hip_adduction_moves_the_knee_inwards(self, plain_body, standing, side):
        step = moved(plain_body, standing, f"shank_{side}", **{f"hip_adduction_{side}": 30})
        assert step @ OUTWARDS[side] < -0.15
        assert abs(step[0]) < 1e-12

    def test_hip_abduction_moves_the_knee_outwards(self, plain_body, standing, side):
        step = moved(plain_body, standing, f"shank_{side}", **{f"hip_adduction_{side}": -30})
        assert step @ OUTWARDS[side] > 0.15

    def test_internal_hip_rotation_turns_the_toes_inwards(self, plain_body, standing, side):
        step = moved(plain_body, standing, f"toe_{side}", **{f"hip_rotation_{side}": 30})
        assert step @ OUTWARDS[side] < -0.05
        assert abs(step[1]) < 1e-12

    def test_knee_flexion_moves_the_ankle_backward(self, plain_body, standing, side):
        step = moved(plain_body, standing, f"foot_{side}", **{f"knee_flexion_{side}": 30})
        assert step[0] < -0.15
        assert step[1] > 0

    def test_ankle_dorsiflexion_lifts_the_toe(self, plain_body, standing, side):
        change = {f"ankle_dorsiflexion_{side}": 20}
        assert moved(plain_body, standing, f"toe_{side}", **change)[1] > 0.04
        assert moved(plain_body, standing, f"heel_{side}", **change)[1] < 0

    def test_inversion_turns_the_sole_inwards(self, plain_body, standing, side):
        at = posed(plain_body, standing, **{f"foot_inversion_{side}": 20})
        assert at[f"ball_medial_{side}"][1] - at[f"ball_lateral_{side}"][1] > 0.02
        q = standing.copy()
        q[0, COORDINATE_INDEX[f"foot_inversion_{side}"]] = np.radians(20)
        foot = forward_kinematics(plain_body, q).rotations[0, NODE_INDEX[f"foot_{side}"]]
        assert (foot @ -Y) @ OUTWARDS[side] < -0.3  # the sole's outward normal

    def test_toes_extension_lifts_the_tip(self, plain_body, standing, side):
        change = {f"toes_extension_{side}": 30}
        assert moved(plain_body, standing, f"toe_{side}", **change)[1] > 0.02
        assert np.allclose(moved(plain_body, standing, f"ball_medial_{side}", **change), 0)

    def test_shoulder_flexion_moves_the_elbow_forward(self, plain_body, standing, side):
        step = moved(plain_body, standing, f"forearm_{side}", **{f"shoulder_flexion_{side}": 30})
        assert step[0] > 0.1

    def test_shoulder_abduction_raises_the_arm_sideways(self, plain_body, standing, side):
        step = moved(plain_body, standing, f"hand_{side}", **{f"shoulder_abduction_{side}": 80})
        assert step @ OUTWARDS[side] > 0.3
        assert step[1] > 0.3
        assert abs(step[0]) < 1e-12

    def test_internal_shoulder_rotation_turns_the_bent_forearm_inwards(
        self, plain_body, standing, side
    ):
        bent = {f"elbow_flexion_{side}": 90}
        before = posed(plain_body, standing, **bent)[f"hand_{side}"]
        turned = posed(plain_body, standing, **bent, **{f"shoulder_rotation_{side}": 30})
        assert (turned[f"hand_{side}"] - before) @ OUTWARDS[side] < -0.1

    def test_elbow_flexion_moves_the_wrist_forward(self, plain_body, standing, side):
        step = moved(plain_body, standing, f"hand_{side}", **{f"elbow_flexion_{side}": 60})
        assert step[0] > 0.15
        assert step[1] > 0.1

    def test_a_leg_moves_nothing_of_the_other_side(self, plain_body, standing, side):
        other = "l" if side == "r" else "r"
        change = {
            name: 20.0
            for name in COORDINATES
            if name.endswith(f"_{side}") and not name.startswith("pelvis")
        }
        before, after = posed(plain_body, standing), posed(plain_body, standing, **change)
        assert len(change) == 11
        for name in before:
            if name.endswith(f"_{other}") or name in {"pelvis", "head_top"}:
                assert np.array_equal(before[name], after[name]), name


@pytest.mark.parametrize("name", ["abdomen_flexion", "thorax_flexion", "head_flexion"])
def test_flexion_of_trunk_and_neck_moves_the_head_forward(plain_body, standing, name):
    step = moved(plain_body, standing, "head_top", **{name: 20})
    assert step[0] > 0.05
    assert step[1] < 0


def test_trunk_bending_moves_the_head_to_the_right(plain_body, standing):
    step = moved(plain_body, standing, "head_top", abdomen_bending=20)
    assert step[2] > 0.1
    assert abs(step[0]) < 1e-12


@pytest.mark.parametrize("name", ["abdomen_rotation", "thorax_rotation"])
def test_trunk_rotation_turns_to_the_left(plain_body, standing, name):
    assert moved(plain_body, standing, "upper_arm_r", **{name: 30})[0] > 0.05
    assert moved(plain_body, standing, "upper_arm_l", **{name: 30})[0] < -0.05


def test_head_rotation_turns_the_face_to_the_left(plain_body, standing):
    q = standing.copy()
    q[0, COORDINATE_INDEX["head_rotation"]] = np.radians(40)
    head = forward_kinematics(plain_body, q).rotations[0, NODE_INDEX["head"]]
    assert (head @ X) @ Z < -0.5


def test_the_pelvis_moves_and_turns_everything(plain_body, standing):
    q = standing.copy()
    q[0, :6] = 1.0, 2.0, 3.0, 0.3, -0.5, 0.7
    turn = Rotation.from_rotvec([0.3, -0.5, 0.7]).as_matrix()
    pose, rest = forward_kinematics(plain_body, q), forward_kinematics(plain_body, standing)
    expected = [1.0, 2.0, 3.0] + (rest.positions[0] - rest.positions[0, 0]) @ turn.T
    assert np.allclose(pose.positions[0], expected, atol=1e-12)
    assert np.allclose(pose.rotations[0], turn, atol=1e-12)


def test_forward_kinematics_equals_chained_four_by_four_matrices(plain_body):
    q = random_coordinates(4)
    pose = forward_kinematics(plain_body, q)
    for frame in range(4):
        world = []
        for i, joint in enumerate(JOINTS):
            local = np.eye(4)
            value = q[frame, [k for k, node in enumerate(COORDINATE_NODE) if node == i]]
            if joint.kind == "free":
                local[:3, 3], vectors = value[:3], [value[3:]]
            else:
                local[:3, 3] = plain_body.joint_offsets[i]
                vectors = [v * np.array(a) for v, a in zip(value, joint.axes, strict=True)]
                if joint.kind == "exponential":
                    vectors = [np.sum(vectors, axis=0)]
            for vector in vectors:
                local[:3, :3] = local[:3, :3] @ Rotation.from_rotvec(vector).as_matrix()
            world.append(local if PARENTS[i] < 0 else world[PARENTS[i]] @ local)
        world = np.array(world)
        assert np.allclose(pose.positions[frame], world[:, :3, 3], atol=1e-12)
        assert np.allclose(pose.rotations[frame], world[:, :3, :3], atol=1e-12)


def test_rotations_are_orthonormal(plain_body):
    rotations = forward_kinematics(plain_body, random_coordinates(20)).rotations
    identity = np.swapaxes(rotations, -1, -2) @ rotations
    assert np.allclose(identity, np.eye(3), atol=1e-12)
    assert np.allclose(np.linalg.det(rotations), 1.0, atol=1e-12)


def every_point(body):
    """Nodes and local offsets of centres of mass, contact points and end points."""
    nodes = np.array([*range(len(JOINTS)), *CONTACT_POINT_NODES, *END_POINT_NODES])
    local = np.vstack([body.coms, body.geometry.contact_points, body.geometry.end_points])
    return nodes, local


@pytest.mark.parametrize("name", COORDINATES)
def test_axes_and_jacobian_equal_central_differences(plain_body, name):
    column, step = COORDINATE_INDEX[name], 1e-6
    q = random_coordinates(6, seed=11)
    nodes, local = every_point(plain_body)
    pose = forward_kinematics(plain_body, q)
    axes = coordinate_axes(pose, q)
    jacobian = point_jacobian(pose, axes, nodes, points_in_world(pose, nodes, local))
    plus, minus = q.copy(), q.copy()
    plus[:, column] += step
    minus[:, column] -= step
    ahead, behind = (forward_kinematics(plain_body, p) for p in (plus, minus))
    points = points_in_world(ahead, nodes, local) - points_in_world(behind, nodes, local)
    assert np.allclose(jacobian[..., column], points / (2 * step), atol=1e-6, rtol=0)
    if column < 3:
        assert np.array_equal(axes[:, column], np.tile(np.eye(3)[column], (6, 1)))
        return
    node = COORDINATE_NODE[column]
    change = (ahead.rotations[:, node] - behind.rotations[:, node]) / (2 * step)
    spin = change @ np.swapaxes(pose.rotations[:, node], 1, 2)
    omega = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
    assert np.allclose(axes[:, column], omega, atol=1e-6, rtol=0)
    assert np.linalg.norm(omega, axis=1).min() > 0.1


def test_jacobian_of_some_columns_is_those_columns(plain_body):
    q = random_coordinates(3)
    nodes, local = every_point(plain_body)
    pose = forward_kinematics(plain_body, q)
    axes = coordinate_axes(pose, q)
    points = points_in_world(pose, nodes, local)
    whole = point_jacobian(pose, axes, nodes, points)
    columns = np.array([33, 1, 7, 4, 20])
    assert whole.shape == (3, len(nodes), 3, 35)
    assert np.array_equal(point_jacobian(pose, axes, nodes, points, columns), whole[..., columns])


def test_centre_of_mass_is_the_weighted_mean(plain_body):
    pose = forward_kinematics(plain_body, random_coordinates(2))
    total = np.zeros(3)
    for i, mass in enumerate(plain_body.masses):
        total += mass * (pose.positions[1, i] + pose.rotations[1, i] @ plain_body.coms[i])
    expected = total / plain_body.masses.sum()
    assert np.allclose(centre_of_mass(plain_body, pose)[1], expected, atol=1e-12)
