"""`read_deepmimic` on a synthetic clip and URDF, the published clips, and `read_clip`."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionstyle.errors import MotionStyleError
from motionstyle.mocap.formats.deepmimic import read_deepmimic
from motionstyle.mocap.formats.readers import read_clip

PARTS = (
    ("chest", "root", "0 1 0", "spherical"),
    ("neck", "chest", "0 1.2 0", "spherical"),
    ("right_hip", "root", "0 0 0.4", "spherical"),
    ("right_knee", "right_hip", "0 -1.6 0", "revolute"),
    ("right_ankle", "right_knee", "0 -1.6 0", "spherical"),
    ("right_shoulder", "chest", "0 1 0.8", "spherical"),
    ("right_elbow", "right_shoulder", "0 -1.2 0", "revolute"),
    ("left_hip", "root", "0 0 -0.4", "spherical"),
    ("left_knee", "left_hip", "0 -1.6 0", "revolute"),
    ("left_ankle", "left_knee", "0 -1.6 0", "spherical"),
    ("left_shoulder", "chest", "0 1 -0.8", "spherical"),
    ("left_elbow", "left_shoulder", "0 -1.2 0", "revolute"),
    ("right_wrist", "right_elbow", "0 -1 0", "fixed"),
    ("left_wrist", "left_elbow", "0 -1 0", "fixed"),
)


def joint_text(name, parent, place, kind):
    axis = '<axis xyz="0 0 1"/>' if kind == "revolute" else ""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{name}"/>'
        f'<origin rpy="0 0 0" xyz="{place}"/>{axis}</joint>\n'
    )


def link_text(name):
    shape = ""
    if name == "neck":
        shape = '<origin xyz="0 0.6 0"/><geometry><sphere radius="0.4"/></geometry>'
    if name.endswith("ankle"):
        shape = '<origin xyz="0.2 -0.1 0"/><geometry><box size="0.8 0.2 0.4"/></geometry>'
    return f'<link name="{name}"><collision>{shape}</collision></link>\n'


URDF = "".join(
    [
        "<robot>\n",
        *(link_text(part[0]) for part in PARTS),
        *(joint_text(*part) for part in PARTS),
        "</robot>\n",
    ]
)
UNIT = [1.0, 0.0, 0.0, 0.0]


def row(duration=0.0333, place=(0.0, 0.8, 0.0), root=UNIT, knee=0.0, ankle=UNIT):
    leg = [*UNIT, knee, *ankle]
    arm = [*UNIT, 0.0]
    return [duration, *place, *root, *UNIT, *UNIT, *leg, *arm, *leg, *arm]


def document(rows=None, loop="wrap"):
    if rows is None:
        rows = [row(place=(0.1 * at, 0.8 + 0.01 * at, 0.05 * at)) for at in range(5)]
        rows[-1][0] = 0.0
    return {"Loop": loop, "Frames": rows}


def read(folder, content=None, urdf=URDF, **options):
    content = document() if content is None else content
    text = content if isinstance(content, str) else json.dumps(content)
    (folder / "a.txt").write_text(text)
    (folder / "a.urdf").write_text(urdf)
    return read_deepmimic(folder / "a.txt", folder / "a.urdf", **options)


def place(clip, name, frame=0):
    return clip.positions[frame, clip.joints.index(name)]


def test_skeleton_in_metres_with_end_joints(tmp_path):
    clip = read(tmp_path)
    assert clip.joints[:3] == ("root", "chest", "neck")
    assert len(clip.joints) == 13 + 7
    assert all(parent < at for at, parent in enumerate(clip.parents))
    expected = {
        "root": [0, 0.8, 0],
        "neck": [0, 0.8 + 0.55, 0],
        "neck_end": [0, 0.8 + 0.55 + 0.25, 0],
        "right_ankle": [0, 0, 0.1],
        "right_ankle_heel_end": [-0.05, -0.05, 0.1],
        "right_ankle_toe_end": [0.15, -0.05, 0.1],
        "left_ankle_toe_end": [0.15, -0.05, -0.1],
        "left_elbow_end": [0, 0.8 + 0.5 - 0.3 - 0.25, -0.2],
    }
    for name, where in expected.items():
        np.testing.assert_allclose(place(clip, name), where, atol=1e-12, err_msg=name)
    np.testing.assert_allclose(clip.rotations[0], np.tile(np.eye(3), (20, 1, 1)), atol=1e-12)


def test_rotations(tmp_path):
    root = Rotation.from_euler("xyz", [10, 20, 30], degrees=True)
    ankle = Rotation.from_euler("xyz", [-5, 15, 25], degrees=True)
    turned = row(
        root=root.as_quat(scalar_first=True).tolist(),
        knee=-0.7,
        ankle=ankle.as_quat(scalar_first=True).tolist(),
    )
    clip = read(tmp_path, document([turned, turned]))
    knee = root * Rotation.from_rotvec([0, 0, -0.7])
    for name, expected in (
        ("root", root),
        ("chest", root),
        ("left_knee", knee),
        ("left_ankle", knee * ankle),
        ("left_ankle_toe_end", knee * ankle),
    ):
        got = clip.rotations[0, clip.joints.index(name)]
        np.testing.assert_allclose(got, expected.as_matrix(), atol=1e-12, err_msg=name)
    hip = np.array([0, 0.8, 0]) + root.apply([0, 0, -0.1])
    at = hip + root.apply([0, -0.4, 0]) + knee.apply([0, -0.4, 0])
    np.testing.assert_allclose(place(clip, "left_ankle"), at, atol=1e-12)


@pytest.mark.parametrize(
    ("duration", "rate"), [(0.0333, 30), (0.016666, 60), (0.0417, 24), (0.0625, 16)]
)
def test_default_rate_and_every_frame_kept(tmp_path, duration, rate):
    rows = [row(duration, place=(0.1 * at, 0.8, 0)) for at in range(100)]
    rows[-1][0] = 0.0
    clip = read(tmp_path, document(rows))
    assert clip.rate_hz == rate
    assert clip.frames == 100  # a duration rounded in its third digit costs no frame
    np.testing.assert_allclose(clip.positions[:, 0, 0], 0.1 * np.arange(100), atol=1e-9)


def test_uneven_durations_are_resampled_by_time(tmp_path):
    times = np.array([0.0, 0.1, 0.2, 0.4, 0.5])
    rows = []
    for at, time in enumerate(times):
        angle = Rotation.from_rotvec([0, 0, 2.0 * time]).as_quat(scalar_first=True).tolist()
        gap = float(np.diff(times)[at]) if at < 4 else 0.0
        rows.append(row(gap, place=(3 * time, 0.8, 0), root=angle, knee=time))
    clip = read(tmp_path, document(rows), rate_hz=20.0)
    assert (clip.frames, clip.rate_hz) == (11, 20.0)
    time = np.arange(11) / 20.0
    np.testing.assert_allclose(clip.positions[:, 0, 0], 3 * time, atol=1e-12)
    for at, now in enumerate(time):
        for name, angle in (("root", 2 * now), ("left_knee", 3 * now)):
            expected = Rotation.from_rotvec([0, 0, angle]).as_matrix()
            got = clip.rotations[at, clip.joints.index(name)]
            np.testing.assert_allclose(got, expected, atol=1e-12)


def test_the_duration_of_the_last_frame_does_not_count(tmp_path):
    rows = document()["Frames"]
    rows[-1][0] = 0.5
    np.testing.assert_array_equal(
        read(tmp_path, document(rows)).positions, read(tmp_path).positions
    )


def test_sign_changes_of_quaternions_do_not_matter(tmp_path):
    turns = [Rotation.from_rotvec([0, 0.3 * at, 0]).as_quat(scalar_first=True) for at in range(5)]
    plain = [row(root=turn.tolist()) for turn in turns]
    flipped = [row(root=(turn * (-1) ** at).tolist()) for at, turn in enumerate(turns)]
    one = read(tmp_path, document(plain), rate_hz=100.0)
    two = read(tmp_path, document(flipped), rate_hz=100.0)
    np.testing.assert_allclose(one.rotations, two.rotations, atol=1e-12)


def test_quaternions_are_normalised_within_the_tolerance(tmp_path):
    rows = [row(root=[0.8, 0, 0, 0]), row()]
    clip = read(tmp_path, document(rows))
    np.testing.assert_allclose(clip.rotations[0, 0], np.eye(3), atol=1e-12)
    with pytest.raises(MotionStyleError, match=r"frame 0, root: quaternion of length 0\.8"):
        read(tmp_path, document(rows), norm_tolerance=1e-3)


def closed(knee=0.0, height=0.8):
    """Five frames whose last equals the first but for a step, a knee angle and a height."""
    rows = [row() for _ in range(5)]
    for at, one in enumerate(rows):
        one[1:4] = [0.1 * at, 0.8, 0.05 * at]
    rows[-1][2], rows[-1][20] = height, knee
    rows[-1][0] = 0.0
    return document(rows)


def test_cycles_shift_in_the_plane_and_share_the_boundary_frame(tmp_path):
    one, three = read(tmp_path, closed()), read(tmp_path, closed(), cycles=3)
    assert (one.frames, three.frames) == (5, 13)
    step = np.array([0.4, 0.0, 0.2])
    for cycle in range(3):
        part = slice(4 * cycle, 4 * cycle + 4)
        np.testing.assert_allclose(
            three.positions[part], one.positions[:4] + cycle * step, atol=1e-12
        )
    np.testing.assert_allclose(three.positions[-1], one.positions[-1] + 2 * step, atol=1e-12)


def test_repeats_of_a_cycle_that_does_not_close_meet_halfway(tmp_path):
    one = read(tmp_path, closed(knee=-0.4, height=0.9))
    three = read(tmp_path, closed(knee=-0.4, height=0.9), cycles=3)
    knee, shank = (one.joints.index(n) for n in ("right_hip", "right_knee"))

    def bend(clip, frame):
        local = clip.rotations[frame, knee].T @ clip.rotations[frame, shank]
        return Rotation.from_matrix(local).as_rotvec()[2]

    assert bend(one, 4) == pytest.approx(-0.4)
    for seam in (0, 4, 8, 12):
        assert bend(three, seam) == pytest.approx(-0.2)
        assert three.positions[seam, 0, 1] == pytest.approx(0.85)
    assert bend(three, 2) == pytest.approx(bend(one, 2))


def cut(**changes):
    rows = document()["Frames"]
    for key, value in changes.items():
        rows[int(key[1])][int(key[3:])] = value
    return document(rows)


TEXT = json.dumps(document())
REFUSED = {
    "short-frame": (document([row()[:-1], row()]), ["frame 0 has 43 values, expected 44"]),
    "long-frame": (document([row(), [*row(), 1]]), ["frame 1 has 45 values, expected 44"]),
    "frame-no-list": (document([row(), 3]), ["frame 1 has no list of values"]),
    "nan": (TEXT.replace("0.81", "NaN"), ["frame 1, root y: nan"]),
    "infinity": (TEXT.replace("0.81", "-Infinity"), ["frame 1, root y: -inf"]),
    "huge-integer": (TEXT.replace("0.81", "1" + "0" * 400), ["frame 1, root y"]),
    "text-value": (cut(f2c21="x"), ["frame 2, right_ankle qw: 'x'"]),
    "true-value": (cut(f2c20=True), ["frame 2, right_knee angle: True"]),
    "negative-duration": (cut(f1c0=-0.1), ["frame 1, duration: -0.1"]),
    "negative-last-duration": (cut(f4c0=-0.1), ["last frame, duration: -0.1"]),
    "zero-duration-inside": (cut(f1c0=0), ["frame 1, duration: 0, expected above 0"]),
    "zero-total": (document([row(0.0), row(0.0), row(0.5)]), ["durations add up to 0"]),
    "quaternion-length": (cut(f3c4=0.2), ["frame 3, root: quaternion of length 0.2"]),
    "zero-quaternion": (cut(f3c8=0), ["frame 3, chest: quaternion of length 0"]),
    "unknown-loop": (document(loop="Wrap"), ["Loop is 'Wrap'", "'wrap' or 'none'"]),
    "no-loop": ({"Frames": document()["Frames"]}, ["Loop is None"]),
    "no-frames": ({"Loop": "none"}, ["Frames holds no list"]),
    "one-frame": (document([row()]), ["Frames holds 1 frames, expected at least 2"]),
    "a-list": ([1, 2], ["expected a JSON object"]),
    "cut-json": (TEXT[:400], ["line 1, column 401", "not valid JSON"]),
    "broken-json": (
        '{"Loop": "wrap",\n  "Frames": [1 2]}',
        ["line 2, column 16", "not valid JSON"],
    ),
    "empty": ("", ["line 1, column 1", "not valid JSON"]),
}


@pytest.mark.parametrize(("content", "expected"), REFUSED.values(), ids=REFUSED.keys())
def test_refused(tmp_path, content, expected):
    with pytest.raises(MotionStyleError) as caught:
        read(tmp_path, content)
    assert str(tmp_path / "a.txt") in str(caught.value)
    for part in expected:
        assert part in str(caught.value)


def test_all_faults_of_a_file_are_listed(tmp_path):
    rows = document()["Frames"]
    rows[0][5], rows[2] = float("nan"), rows[2][:3]
    with pytest.raises(MotionStyleError) as caught:
        read(tmp_path, document(rows, loop="twice"))
    assert "3 problems" in str(caught.value)


TURNED = Rotation.from_rotvec([0, 1.2, 0]).as_quat(scalar_first=True).tolist()
OPTIONS = {
    "cycles-on-none": (document(loop="none"), {"cycles": 2}, "does not wrap"),
    "cycles-on-turn": (document([row(), row(root=TURNED)]), {"cycles": 2}, "69 degrees"),
    "cycles-0": (document(), {"cycles": 0}, "cycles is 0"),
    "cycles-fraction": (document(), {"cycles": 1.5}, "cycles is 1.5"),
    "rate-0": (document(), {"rate_hz": 0.0}, "rate_hz is 0"),
    "rate-nan": (document(), {"rate_hz": float("nan")}, "rate_hz is nan"),
    "rate-too-low": (document(), {"rate_hz": 1.0}, "too low a rate"),
}


@pytest.mark.parametrize(("content", "options", "words"), OPTIONS.values(), ids=OPTIONS.keys())
def test_refused_options(tmp_path, content, options, words):
    with pytest.raises(MotionStyleError, match=words):
        read(tmp_path, content, **options)


URDF_FAULTS = {
    "not-xml": (URDF.replace("</robot>", ""), "not valid XML"),
    "missing-joint": (URDF.replace('<child link="left_knee"/>', ""), "'left_knee'"),
    "wrong-kind": (URDF.replace('"chest" type="spherical"', '"chest" type="fixed"'), "is fixed"),
    "wrong-axis": (URDF.replace('axis xyz="0 0 1"', 'axis xyz="0 1 0"', 1), "axis 0 0 1"),
    "turned-frame": (URDF.replace('rpy="0 0 0"', 'rpy="0 1 0"', 1), "'chest' has a turned frame"),
    "short-origin": (URDF.replace('xyz="0 1.2 0"', 'xyz="0 1.2"'), "'neck' has 2 numbers"),
    "nan-origin": (URDF.replace('xyz="0 1.2 0"', 'xyz="0 nan 0"'), "'neck': xyz is nan"),
    "unknown-parent": (URDF.replace('<parent link="left_knee"/>', '<parent link="x"/>'), "on 'x'"),
}


@pytest.mark.parametrize(("urdf", "words"), URDF_FAULTS.values(), ids=URDF_FAULTS.keys())
def test_refused_urdf(tmp_path, urdf, words):
    with pytest.raises(MotionStyleError, match=words) as caught:
        read(tmp_path, urdf=urdf)
    assert str(tmp_path / "a.urdf") in str(caught.value)


def test_a_zero_byte_after_the_urdf_is_accepted(tmp_path):
    read(tmp_path)
    (tmp_path / "a.urdf").write_bytes(URDF.encode() + b"\r\n\0")
    assert read_deepmimic(tmp_path / "a.txt", tmp_path / "a.urdf").frames == 5


def test_a_urdf_without_shapes_and_wrists_has_no_end_joints(tmp_path):
    urdf = "<robot>" + "".join(joint_text(*part) for part in PARTS[:12]) + "</robot>"
    assert len(read(tmp_path, urdf=urdf).joints) == 13


BVH = (
    "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 1 Xposition\n}\n"
    "MOTION\nFrames: 2\nFrame Time: 0.0333333\n1\n2\n"
)


def test_read_clip_by_suffix(tmp_path):
    read(tmp_path)
    motion, urdf, bvh = tmp_path / "a.txt", tmp_path / "a.urdf", tmp_path / "a.BVH"
    bvh.write_text(BVH)
    assert read_clip(motion, skeleton_file=urdf, cycles=2).frames == 9
    assert read_clip(motion, skeleton_file=urdf, rate_hz=60.0).frames == 9
    assert read_clip(bvh).rate_hz == 30.0
    overridden = read_clip(bvh, rate_hz=120)
    assert (overridden.rate_hz, overridden.frames) == (120.0, 2)
    (tmp_path / "b.asf").write_text(
        ":units\nangle deg\n:root\norder TX RX\naxis XYZ\n:bonedata\nbegin\nname b\nlength 1\n"
        "direction 0 1 0\naxis 0 0 0 XYZ\nend\n:hierarchy\nbegin\nroot b\nend\n"
    )
    (tmp_path / "b_1.amc").write_text(":DEGREES\n1\nroot 1 0\n")
    assert read_clip(tmp_path / "b_1.amc").rate_hz == 120.0
    assert read_clip(str(tmp_path / "b_1.amc"), rate_hz=60).joints == ("root", "b", "b_end")


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("a.fbx", {}, r"suffix '\.fbx'; supported are \.bvh, \.amc"),
        ("a", {}, "no suffix; supported are"),
        ("a.txt", {}, "needs a skeleton_file"),
        ("a.BVH", {"cycles": 2}, "only DeepMimic clips can be repeated"),
        ("a.BVH", {"skeleton_file": "b.asf"}, "skeleton_file is not used"),
        ("a.BVH", {"rate_hz": -1.0}, "rate_hz is -1"),
        ("a.amc", {}, "no skeleton file beside it"),
    ],
)
def test_read_clip_refuses(tmp_path, name, options, words):
    (tmp_path / "a.BVH").write_text(BVH)
    with pytest.raises(MotionStyleError, match=words):
        read_clip(tmp_path / name, **options)


@pytest.mark.mirror
def test_the_published_clips_stand_on_the_floor():
    folder = os.environ.get("MOTIONSTYLE_EMBEDDED_DIR")
    files = sorted(Path(folder).rglob("humanoid3d_*.txt")) if folder else []
    if not files:
        pytest.skip("MOTIONSTYLE_EMBEDDED_DIR names no folder with DeepMimic clips")
    urdf = next(Path(folder).rglob("humanoid.urdf"))
    for path in files:
        clip = read_deepmimic(path, urdf)
        feet = [at for at, name in enumerate(clip.joints) if "heel" in name or "toe" in name]
        lowest = clip.positions[:, feet, 1].min()
        # Boxes sink a little where a foot rolls: 6 cm at most (the run and the roll).
        assert -0.07 < lowest < 0.03, path
