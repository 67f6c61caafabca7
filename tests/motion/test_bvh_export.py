"""A written BVH file gives two independent readers the joint positions of the motion."""

from __future__ import annotations

import os
import warnings
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionstyle.body.kinematics import contact_points, end_points
from motionstyle.body.layout import CONTACT_POINTS, COORDINATE_INDEX, NODES, PARENTS
from motionstyle.body.rotations import exponential
from motionstyle.mocap.formats.bvh import read_bvh
from motionstyle.motion.bvh_export import euler_zxy, write_bvh

TOLERANCE_M = 1e-8  # 10⁻⁵ mm; asked for is 1 mm


def expected_points(motion):
    """Every node and end site of the file by its name there, (F, 3), m."""
    pose = motion.pose()
    found = {name: pose.positions[:, i] for i, name in enumerate(NODES)}
    ends = end_points(motion.body, pose)
    soles = contact_points(motion.body, pose)
    for k, node in enumerate(("head", "hand_r", "hand_l")):
        found[f"{node}_end"] = ends[:, k]
    for side in "rl":
        found[f"toes_{side}_end"] = soles[:, CONTACT_POINTS.index(f"toe_{side}")]
    return found


def assert_same_positions(path, motion):
    clip = read_bvh(path)
    expected = expected_points(motion)
    assert set(clip.joints) == set(expected)
    assert clip.rate_hz == pytest.approx(motion.rate_hz, rel=1e-9)
    assert clip.frames == motion.frames
    for k, name in enumerate(clip.joints):
        error = np.abs(clip.positions[:, k] / 100 - expected[name]).max()
        assert error < TOLERANCE_M, f"{name}: {error} m"
    return clip


def wild(plain_motion, seed=2, frames=200):
    """Random angles over the whole circle, and joints held at ±90°, where Euler angles fail."""
    rng = np.random.default_rng(seed)
    motion = plain_motion.window(0, frames - 1)
    q = rng.uniform(-3.0, 3.0, size=(frames, 35))
    quarter = np.pi / 2
    q[:40, 3:6] = quarter, 0.0, 0.0
    q[40:80, 3:6] = -quarter, 0.0, 0.0
    q[:, COORDINATE_INDEX["abdomen_flexion"]] = 0
    q[:, COORDINATE_INDEX["abdomen_rotation"]] = 0
    q[:, COORDINATE_INDEX["abdomen_bending"]] = quarter + np.linspace(-1e-9, 1e-9, frames)
    return replace(motion, coordinates=q, contact_forces=None)


def test_positions_survive_the_file(tmp_path, plain_motion):
    write_bvh(tmp_path / "plain.bvh", plain_motion)
    assert_same_positions(tmp_path / "plain.bvh", plain_motion)


def test_positions_survive_gimbal_lock_and_wild_angles(tmp_path, plain_motion):
    motion = wild(plain_motion)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        write_bvh(tmp_path / "wild.bvh", motion)
    assert_same_positions(tmp_path / "wild.bvh", motion)


def test_rotations_survive_the_file(tmp_path, plain_motion):
    write_bvh(tmp_path / "plain.bvh", plain_motion)
    clip, pose = read_bvh(tmp_path / "plain.bvh"), plain_motion.pose()
    for i, name in enumerate(NODES):
        found = clip.rotations[:, clip.joints.index(name)]
        assert np.allclose(found, pose.rotations[:, i], atol=1e-8), name


def test_another_reader_sees_the_same_positions(tmp_path, plain_motion):
    pybvh = pytest.importorskip("pybvh")
    motion = wild(plain_motion, frames=60)
    write_bvh(tmp_path / "wild.bvh", motion)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        positions = pybvh.read_bvh_file(tmp_path / "wild.bvh", world_up="+y").node_positions()
    expected = expected_points(motion)
    names = read_bvh(tmp_path / "wild.bvh").joints  # both keep the order of the file
    assert positions.shape == (60, len(names), 3)
    for k, name in enumerate(names):
        assert np.abs(positions[:, k] / 100 - expected[name]).max() < TOLERANCE_M, name


def test_hierarchy_is_the_body(tmp_path, plain_motion):
    write_bvh(tmp_path / "plain.bvh", plain_motion)
    text = (tmp_path / "plain.bvh").read_text()
    assert text.startswith("HIERARCHY\nROOT pelvis\n{\n")
    assert text.count("JOINT ") == 17
    assert text.count("End Site") == 5
    assert text.count("{") == text.count("}") == 23
    assert text.count("CHANNELS 3 Zrotation Xrotation Yrotation\n") == 17
    root = "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
    assert text.count(root) == 1
    assert "\nMOTION\nFrames: 241\nFrame Time: 0.008333333333\n" in text
    clip = read_bvh(tmp_path / "plain.bvh")
    offsets = plain_motion.body.joint_offsets
    for i, name in enumerate(NODES):
        at = clip.joints.index(name)
        assert np.allclose(clip.rest_offsets[at], 100 * offsets[i], atol=1e-8)
        if PARENTS[i] >= 0:
            assert clip.joints[clip.parents[at]] == NODES[PARENTS[i]]


def test_axes_are_y_up_x_forward_z_right(tmp_path, plain_motion):
    write_bvh(tmp_path / "plain.bvh", plain_motion)
    clip = read_bvh(tmp_path / "plain.bvh")

    def at(name):
        return clip.positions[:, clip.joints.index(name)]

    assert (at("head")[:, 1] - at("pelvis")[:, 1]).min() > 40
    assert at("pelvis")[-1, 0] - at("pelvis")[0, 0] == pytest.approx(260)
    assert (at("thigh_r") - at("thigh_l"))[0, 2] > 15


def test_angles_do_not_jump_by_a_turn(tmp_path, plain_motion):
    t = np.linspace(0, 1, plain_motion.frames)
    q = plain_motion.coordinates.copy()
    q[:, 3:6] = 0
    q[:, 4] = 1.7 * np.pi * t
    write_bvh(tmp_path / "turn.bvh", replace(plain_motion, coordinates=q))
    header, _, motion = (tmp_path / "turn.bvh").read_text().partition("Frame Time")
    assert header.endswith("Frames: 241\n")
    rows = np.array([line.split() for line in motion.splitlines()[1:]], dtype=float)
    assert rows.shape == (241, 3 + 18 * 3)
    assert np.abs(np.diff(rows[:, 3:], axis=0)).max() < 10
    assert rows[-1, 5] == pytest.approx(306, abs=1e-6)


def test_numbers_are_plain_decimals_without_negative_zero(tmp_path, plain_motion):
    q = np.zeros((2, 35))
    q[:, COORDINATE_INDEX["knee_flexion_r"]] = 1e-12
    q[1, :3] = -1e-13, 1e7, -1e-5
    small = replace(plain_motion.window(0, 1), coordinates=q)
    write_bvh(tmp_path / "small.bvh", small)
    text = (tmp_path / "small.bvh").read_text()
    values = [w for w in text.split() if w[0] in "-0123456789"]
    assert len(values) > 150
    assert not any("e" in w.lower() for w in values)
    assert not any(w[0] == "-" and float(w) == 0 for w in values)
    assert b"\r" not in (tmp_path / "small.bvh").read_bytes()


@pytest.mark.parametrize("rate", [24.0, 29.97, 100.0, 120.0, 59.94])
def test_the_rate_survives(tmp_path, plain_motion, rate):
    write_bvh(tmp_path / "rate.bvh", replace(plain_motion, rate_hz=rate))
    assert read_bvh(tmp_path / "rate.bvh").rate_hz == pytest.approx(rate, rel=1e-9)


def test_one_frame_can_be_written(tmp_path, plain_motion):
    write_bvh(tmp_path / "one.bvh", plain_motion.window(5, 5))
    assert_same_positions(tmp_path / "one.bvh", plain_motion.window(5, 5))


def test_equal_motions_are_equal_files(tmp_path, plain_motion):
    write_bvh(tmp_path / "a.bvh", plain_motion)
    write_bvh(tmp_path / "b.bvh", plain_motion)
    assert (tmp_path / "a.bvh").read_bytes() == (tmp_path / "b.bvh").read_bytes()


def test_a_failed_write_keeps_the_former_file(tmp_path, plain_motion, monkeypatch):
    path = tmp_path / "plain.bvh"
    path.write_text("former")

    def full(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        write_bvh(path, plain_motion)
    assert path.read_text() == "former"
    assert [p.name for p in tmp_path.iterdir()] == ["plain.bvh"]


def rebuilt(angles):
    """Rz·Rx·Ry."""
    z, x, y = np.moveaxis(angles, -1, 0)[..., None]
    about = np.eye(3)
    return exponential(z * about[2]) @ exponential(x * about[0]) @ exponential(y * about[1])


angle = st.floats(-3.2, 3.2)


@given(
    angle,
    st.one_of(
        angle,
        st.sampled_from([np.pi / 2, -np.pi / 2]),
        st.floats(-1e-6, 1e-6).map(lambda d: np.pi / 2 + d),
    ),
    angle,
)
def test_euler_angles_rebuild_the_rotation(z, x, y):
    matrices = rebuilt(np.array([[z, x, y]]))
    found = euler_zxy(matrices)
    assert abs(found[0, 1]) <= np.pi / 2 + 1e-12
    assert np.allclose(rebuilt(found), matrices, atol=1e-14)
