"""Skeleton maps: the shipped ones, every mistake in one error, clips of another skeleton."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml
from test_body_fit import SKELETONS, clip_of, known_gait

from motionstyle.body.layout import NODE_INDEX, NODES
from motionstyle.body.rotations import exponential
from motionstyle.errors import MotionStyleError
from motionstyle.mocap.formats.clip import SkeletonClip, forward_kinematics
from motionstyle.mocap.skeletons.skeleton_map import (
    REQUIRED_NODES,
    check_joints,
    read_skeleton_map,
    restore_offsets,
)

SHIPPED = sorted(path.stem for path in SKELETONS.glob("*.yaml"))


def write_map(folder: Path, base: str = "bandai", **changes) -> Path:
    """Copy a shipped map with some sections changed; a section set to None is left out."""
    data = yaml.safe_load((SKELETONS / f"{base}.yaml").read_text())
    for section, change in changes.items():
        if isinstance(change, dict) and isinstance(data.get(section), dict):
            merged = {**data[section], **change}
            data[section] = {k: v for k, v in merged.items() if v is not None}
        else:
            data[section] = change
    data = {k: v for k, v in data.items() if v is not None}
    path = folder / "mine.yaml"
    path.write_text(yaml.safe_dump(data))
    return path


def refusal(folder: Path) -> str:
    with pytest.raises(MotionStyleError) as caught:
        read_skeleton_map(folder, "mine")
    assert str(caught.value).startswith(str(folder / "mine.yaml"))
    return str(caught.value)


@pytest.mark.parametrize("name", SHIPPED)
def test_every_shipped_map_is_read(name):
    skeleton = read_skeleton_map(SKELETONS, name)
    assert skeleton.name == name
    assert set(REQUIRED_NODES) <= set(skeleton.joints) <= set(NODES)
    assert [n for n in NODES if skeleton.observes(n)] == [n for n in NODES if n in skeleton.joints]
    sources = list(skeleton.joints.values())
    assert len(set(sources)) == len(sources)
    for side in "rl":
        assert f"toes_{side}" in skeleton.joints or f"foot_front_{side}" in skeleton.ends


def test_axes_are_the_local_axes_that_point_forward_up_and_right(tmp_path):
    write_map(tmp_path, axes={"pelvis": "-z +x -y"})
    axes = read_skeleton_map(tmp_path, "mine").axes["pelvis"]
    np.testing.assert_array_equal(axes[:, 0], [0, 0, -1])
    np.testing.assert_array_equal(axes[:, 1], [1, 0, 0])
    np.testing.assert_array_equal(axes[:, 2], [0, -1, 0])


def test_an_unknown_skeleton_names_its_near_matches():
    with pytest.raises(MotionStyleError) as caught:
        read_skeleton_map(SKELETONS, "cmu_motionbilder")
    message = str(caught.value)
    assert "skeleton 'cmu_motionbilder' has no file" in message
    assert "did you mean cmu_motionbuilder" in message
    assert all(name in message for name in SHIPPED)


def test_all_mistakes_of_a_map_come_in_one_error(tmp_path):
    write_map(
        tmp_path,
        joints={"thigh_r": None, "tigh_r": "UpperLeg_R", "head": None},
        ends={"hed_top": "Head_end"},
        axes={"abdomen": "+y +x -w", "thorax": "+y +x +z", "tigh_r": "-z +x -y"},
        ignroed=["x"],
        zero_pose="lying",
    )
    message = refusal(tmp_path)
    for part in (
        "joints: unknown node 'tigh_r' (did you mean thigh_r",
        "joints: node 'thigh_r' is missing",
        "joints: node 'head' is missing",
        "ends: unknown end 'hed_top' (did you mean head_top",
        "unknown key 'ignroed' (did you mean ignored",
        "axes of abdomen are '+y +x -w'",
        "axes of thorax ('+y +x +z') are not a right-handed frame",
        "axes: unknown node 'tigh_r' (did you mean thigh_r",
        "zero_pose is 'lying'",
    ):
        assert part in message, part


def test_a_zero_pose_of_axes_needs_the_axes_of_every_joint(tmp_path):
    write_map(tmp_path, axes={"hand_l": None, "toes_r": None})
    message = refusal(tmp_path)
    assert "axes: node 'hand_l' is missing" in message
    assert "axes: node 'toes_r' is missing" in message


def test_a_frame_of_a_node_that_is_not_mapped_is_a_mistake(tmp_path):
    write_map(tmp_path, "pymo", frames={"thorax": "Spine1"})
    assert "frames: node 'thorax' is not among the joints" in refusal(tmp_path)


def test_a_foot_needs_toes_or_a_front_end(tmp_path):
    write_map(tmp_path, "aalto", ends={"foot_front_l": None})
    message = refusal(tmp_path)
    assert "'foot_front_l'" in message
    assert "'foot_front_r'" not in message


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("joints: [a, b", "not a YAML file (line 2)"),
        ("- joints", "expected the sections"),
        ("", "expected the sections"),
        ("joints: [pelvis]", "joints must be a mapping"),
        ("ignored: '?hand'", "ignored must be a list"),
    ],
)
def test_a_file_that_is_no_map_is_refused(tmp_path, text, reason):
    (tmp_path / "mine.yaml").write_text(text + "\n")
    assert reason in refusal(tmp_path)


@pytest.fixture(scope="module")
def asf_clip(plain_body):
    walk = known_gait(plain_body, seconds=0.2)
    skeleton = read_skeleton_map(SKELETONS, "cmu_asf")
    return clip_of(skeleton, plain_body, walk.coordinates, 100.0, extra=("lhand", "rthumb_end"))


def renamed(clip, **names):
    joints = tuple(names.get(joint, joint) for joint in clip.joints)
    return SkeletonClip(
        joints, clip.parents, clip.rest_offsets, clip.positions, clip.rotations,
        clip.rate_hz, clip.source,
    )  # fmt: skip


def test_the_clip_of_a_map_passes_ignored_joints_included(asf_clip):
    assert {"lhand", "rthumb_end"} <= set(asf_clip.joints)
    check_joints(asf_clip, read_skeleton_map(SKELETONS, "cmu_asf"))


def test_missing_and_extra_joints_come_in_one_error_with_near_matches(asf_clip):
    skeleton = read_skeleton_map(SKELETONS, "cmu_asf")
    clip = renamed(asf_clip, rfemur="rfemr", ltoes_end="ltoe_end", lhand="tail")
    with pytest.raises(MotionStyleError) as caught:
        check_joints(clip, skeleton)
    message = str(caught.value)
    assert message.startswith("known.bvh: not the skeleton 'cmu_asf'")
    for part in (
        "lacks joint 'rfemur' (did you mean rfemr",
        "lacks joint 'ltoes_end' (did you mean ltoe_end",
        "has joint 'rfemr' that the map does not name (did you mean rfemur",
        "has joint 'ltoe_end' that the map does not name (did you mean ltoes_end",
        "has joint 'tail' that the map does not name",
        "config/skeletons/cmu_asf.yaml",
    ):
        assert part in message, part
    assert message.count("lacks joint") == 2
    assert message.count("has joint") == 3


def test_every_skeleton_refuses_the_clips_of_every_other(plain_body):
    q = known_gait(plain_body, seconds=0.2).coordinates
    maps = {name: read_skeleton_map(SKELETONS, name) for name in SHIPPED}
    for name, skeleton in maps.items():
        clip = clip_of(skeleton, plain_body, q, 100.0)
        check_joints(clip, skeleton)
        for other in SHIPPED:
            if other != name:
                with pytest.raises(MotionStyleError, match=f"not the skeleton '{other}'"):
                    check_joints(clip, maps[other])


def test_the_joint_an_offset_is_taken_from_must_be_there(tmp_path, plain_body):
    write_map(tmp_path, "cmu_asf", offsets_like={"lowerneck": "upperneck"}, ignored=["?fingers"])
    skeleton = read_skeleton_map(tmp_path, "mine")
    q = known_gait(plain_body, seconds=0.2).coordinates
    complete = clip_of(skeleton, plain_body, q, 100.0, extra=("upperneck",))
    check_joints(complete, skeleton)
    with pytest.raises(MotionStyleError, match="lacks joint 'upperneck'"):
        check_joints(clip_of(skeleton, plain_body, q, 100.0), skeleton)


def test_lost_offsets_are_restored_and_all_that_hangs_on_them_moves():
    parents = np.array([-1, 0, 1, 2, 1])
    offsets = np.array([[0, 0, 0], [0, 1.0, 0], [0.2, 0.5, 0], [0, 0.3, 0], [0, 0, 0.7]])
    angles = np.linspace(0, 1.0, 12)[:, None] * np.array([0.3, -0.5, 0.8, 0.2, 0.4])
    local = exponential(angles[..., None] * np.array([0.6, 0.0, 0.8]))
    places = np.tile(offsets, (12, 1, 1))
    places[:, 0] = np.linspace(0, 2, 12)[:, None] * [1, 0.1, 0]
    positions, rotations = forward_kinematics(parents, places, local)
    names = ("root", "spine", "neck", "head", "shoulder")
    whole = SkeletonClip(names, parents, offsets, positions, rotations, 30.0, "lost.bvh")
    lost = np.array(offsets)
    lost[2] = 0.0
    places[:, 2] = 0.0
    positions, rotations = forward_kinematics(parents, places, local)
    broken = SkeletonClip(names, parents, lost, positions, rotations, 30.0, "lost.bvh")
    model = np.array(offsets)
    assert np.abs(broken.positions[:, 3] - whole.positions[:, 3]).max() > 0.3
    # the joint below the neck has another bone, so the neck is given the shoulder's and the spine's
    mended = restore_offsets(broken, {"neck": "spine"})
    model[2] = offsets[1]
    np.testing.assert_allclose(mended.rest_offsets, model, atol=1e-12)
    expected, _ = forward_kinematics(
        parents, np.where((np.arange(5) == 2)[:, None], model[2], places), local
    )
    np.testing.assert_allclose(mended.positions, expected, atol=1e-12)
    np.testing.assert_allclose(mended.rotations, broken.rotations, atol=1e-12)
    assert restore_offsets(broken, {}) is broken


def test_a_restored_neck_carries_the_head(plain_body):
    skeleton = read_skeleton_map(SKELETONS, "cmu_motionbuilder")
    walk = known_gait(plain_body, seconds=0.3)
    pose = clip_of(skeleton, plain_body, walk.coordinates, 100.0)
    index = {name: i for i, name in enumerate(pose.joints)}
    lost = lose_offset(pose, "Neck", pose.rest_offsets[index["Spine1"]])
    assert np.abs(lost.positions - pose.positions).max() > 0.05
    mended = restore_offsets(lost, {"Neck": "Spine1"})
    np.testing.assert_allclose(mended.positions, pose.positions, atol=1e-12)
    head = plain_body.joint_offsets[NODE_INDEX["head"]]
    trunk = mended.positions[:, index["Neck"]] - mended.positions[:, index["Spine"]]
    np.testing.assert_allclose(np.linalg.norm(trunk, axis=1), np.linalg.norm(head), atol=1e-12)


def lose_offset(clip, joint, offset):
    """Take `offset` (3,) away from a joint's offset, as a conversion that loses a bone does."""
    at = clip.joints.index(joint)
    below = {at}
    for child, parent in enumerate(clip.parents):
        if int(parent) in below:
            below.add(child)
    positions, offsets = np.array(clip.positions), np.array(clip.rest_offsets)
    moved = clip.rotations[:, clip.parents[at]] @ offset
    positions[:, sorted(below)] -= moved[:, None]
    offsets[at] -= offset
    return SkeletonClip(
        clip.joints, clip.parents, offsets, positions, clip.rotations, clip.rate_hz, clip.source
    )
