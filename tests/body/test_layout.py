"""Counts and names of the body's nodes and coordinates, the mirror, the joint ranges."""

from __future__ import annotations

import numpy as np
import pytest

from motionstyle.body import layout
from motionstyle.body.ranges import joint_ranges


def test_eighteen_nodes_and_thirty_five_coordinates():
    assert len(layout.NODES) == len(set(layout.NODES)) == 18
    assert len(layout.COORDINATES) == len(set(layout.COORDINATES)) == 29 + 6
    assert len(layout.COORDINATES[layout.ROOT_COORDINATES]) == 6
    assert len(layout.COORDINATES[layout.JOINT_COORDINATES]) == 29
    assert all(name.startswith("pelvis_") for name in layout.COORDINATES[:6])


@pytest.mark.parametrize("side", ["r", "l"])
def test_seven_coordinates_a_leg(side):
    leg = {f"{node}_{side}" for node in ("thigh", "shank", "foot", "toes")}
    count = {joint.node: len(joint.names) for joint in layout.JOINTS if joint.node in leg}
    assert count == {
        f"thigh_{side}": 3,
        f"shank_{side}": 1,
        f"foot_{side}": 2,
        f"toes_{side}": 1,
    }


def test_degrees_of_freedom_of_the_other_joints():
    count = {joint.node: len(joint.names) for joint in layout.JOINTS}
    assert count["abdomen"] == 3
    assert count["thorax"] == count["head"] == 2
    for side in "rl":
        assert count[f"upper_arm_{side}"] == 3
        assert count[f"forearm_{side}"] == 1
        assert count[f"hand_{side}"] == 0


def test_parents_come_before_their_children():
    assert layout.PARENTS[0] == -1
    assert all(0 <= parent < i for i, parent in enumerate(layout.PARENTS) if i)
    parent = dict(zip(layout.NODES, layout.PARENTS, strict=True))
    assert layout.NODES[parent["shank_l"]] == "thigh_l"
    assert layout.NODES[parent["upper_arm_r"]] == "thorax"
    assert layout.NODES[parent["thigh_r"]] == "pelvis"


def test_index_tables_agree_with_the_names():
    for i, (joint, block) in enumerate(zip(layout.JOINTS, layout.JOINT_SLICES, strict=True)):
        assert layout.COORDINATES[block] == joint.names
        assert layout.NODE_INDEX[joint.node] == i
        assert all(layout.COORDINATE_NODE[k] == i for k in range(block.start, block.stop))
        assert len(joint.axes) == len(joint.names)
    for name, column in layout.COORDINATE_INDEX.items():
        assert layout.COORDINATES[column] == name


def test_exponential_blocks_are_the_root_hips_spine_and_shoulders():
    found = [layout.COORDINATES[block][0] for block in layout.EXPONENTIAL_BLOCKS]
    assert found == [
        *("pelvis_rx", "hip_flexion_r", "hip_flexion_l", "abdomen_flexion"),
        *("shoulder_flexion_r", "shoulder_flexion_l"),
    ]
    assert all(block.stop - block.start == 3 for block in layout.EXPONENTIAL_BLOCKS)


def test_contact_points_belong_to_foot_and_toes():
    owner = dict(zip(layout.CONTACT_POINTS, layout.CONTACT_POINT_NODES, strict=True))
    assert len(owner) == 8
    for side in "rl":
        assert layout.NODES[owner[f"toe_{side}"]] == f"toes_{side}"
        for point in ("heel", "ball_medial", "ball_lateral"):
            assert layout.NODES[owner[f"{point}_{side}"]] == f"foot_{side}"


def test_mirror_exchanges_sides_and_is_its_own_inverse():
    order, sign = layout.mirrored_coordinates()
    assert np.array_equal(order[order], np.arange(35))
    assert np.array_equal(sign[order] * sign, np.ones(35))
    flipped = {layout.COORDINATES[i] for i in np.flatnonzero(sign < 0)}
    assert flipped == {
        *("pelvis_tz", "pelvis_rx", "pelvis_ry", "abdomen_bending"),
        *("abdomen_rotation", "thorax_rotation", "head_rotation"),
    }
    knee = layout.COORDINATE_INDEX["knee_flexion_r"]
    assert layout.COORDINATES[order[knee]] == "knee_flexion_l"


def test_ranges_bound_every_joint_coordinate_alike_on_both_sides():
    bounds = joint_ranges()
    assert np.isinf(bounds[:6]).all()
    joints = bounds[6:]
    assert np.isfinite(joints).all()
    assert (joints[:, 0] <= 0).all()
    assert (joints[:, 1] > 0).all()
    for name, column in layout.COORDINATE_INDEX.items():
        if name.endswith("_r"):
            other = layout.COORDINATE_INDEX[name[:-1] + "l"]
            assert np.array_equal(bounds[column], bounds[other])


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("hip_flexion_l", -30, 120),
        ("hip_adduction_r", -50, 30),
        ("knee_flexion_r", -5, 140),
        ("ankle_dorsiflexion_l", -50, 30),
        ("elbow_flexion_r", 0, 150),
        ("head_rotation", -70, 70),
    ],
)
def test_ranges_are_those_of_the_table(name, low, high):
    bounds = np.degrees(joint_ranges()[layout.COORDINATE_INDEX[name]])
    assert np.allclose(bounds, [low, high], atol=1e-12)


def test_both_spine_joints_together_have_the_range_of_the_trunk():
    bounds = np.degrees(joint_ranges())
    flexion = [layout.COORDINATE_INDEX[f"{n}_flexion"] for n in ("abdomen", "thorax")]
    rotation = [layout.COORDINATE_INDEX[f"{n}_rotation"] for n in ("abdomen", "thorax")]
    assert np.allclose(bounds[flexion].sum(axis=0), [-25, 60])
    assert np.allclose(bounds[rotation].sum(axis=0), [-45, 45])
