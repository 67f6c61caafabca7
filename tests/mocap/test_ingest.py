"""From a clip file to a motion: known bodies in known poses, and refusals."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_body_fit import SKELETONS, clip_of, known_gait
from test_contacts import SETTINGS, assert_stances, known_run
from test_skeleton_map import lose_offset

from motionstyle.body.body import BodyGeometry, build_body
from motionstyle.body.kinematics import contact_points
from motionstyle.body.layout import (
    CONTACT_POINTS,
    COORDINATE_INDEX,
    COORDINATE_NODE,
    COORDINATES,
    EXPONENTIAL_BLOCKS,
    NODE_INDEX,
    NODES,
)
from motionstyle.body.rotations import exponential, logarithm
from motionstyle.errors import MotionStyleError
from motionstyle.evaluation import gait
from motionstyle.mocap.datasets.sheet import METRES, ClipRow
from motionstyle.mocap.skeletons.ingest import ingest_clip
from motionstyle.mocap.skeletons.skeleton_map import read_skeleton_map
from motionstyle.motion.bvh_export import euler_zxy
from motionstyle.motion.mirror import mirror_motion

RATE = 100.0
UNFILTERED = replace(SETTINGS, cutoff_hz={"default": 50.0})  # not below 0.45 of the rate
TOES = [COORDINATE_INDEX[f"toes_extension_{side}"] for side in "rl"]
FEET = [i for i, n in enumerate(COORDINATES) if n.startswith(("ankle", "foot"))]
LEGS = [i for i, n in enumerate(COORDINATES) if n.startswith(("hip", "knee"))]
UPPER = [i for i in range(3, 35) if i not in {*TOES, *FEET, *LEGS}]


def write_bvh(path, clip, factor=1.0, turn=None):
    """Write a skeleton clip as BVH with lengths times `factor`, in other world axes."""
    turn = np.eye(3) if turn is None else turn
    children = [[c for c, p in enumerate(clip.parents) if p == j] for j in range(len(clip.joints))]
    offsets = factor * clip.rest_offsets @ turn.T
    order, lines = [], ["HIERARCHY"]

    def numbers(values):
        return " ".join(f"{v:.9f}" for v in values)

    def block(joint, depth):
        pad, name = "  " * depth, clip.joints[joint]
        lines.append(f"{pad}{'JOINT' if depth else 'ROOT'} {name}\n{pad}{{")
        order.append(joint)
        channels = "Zrotation Xrotation Yrotation"
        places = "" if depth else "Xposition Yposition Zposition "
        lines.append(f"{pad}  OFFSET {numbers(offsets[joint])}")
        lines.append(f"{pad}  CHANNELS {3 if depth else 6} {places}{channels}")
        for child in children[joint]:
            if clip.joints[child] != f"{name}_end":
                block(child, depth + 1)
            else:
                place = numbers(offsets[child])
                lines.append(f"{pad}  End Site\n{pad}  {{\n{pad}    OFFSET {place}\n{pad}  }}")
        if not children[joint]:
            lines.append(f"{pad}  End Site\n{pad}  {{\n{pad}    OFFSET 0 0.01 0\n{pad}  }}")
        lines.append(f"{pad}}}")

    block(0, 0)
    world = turn @ clip.rotations @ turn.T
    columns = [factor * clip.positions[:, 0] @ turn.T]
    for joint in order:
        local = world[:, joint]
        if clip.parents[joint] >= 0:
            local = np.swapaxes(world[:, clip.parents[joint]], 1, 2) @ local
        columns.append(np.degrees(euler_zxy(local)))
    lines += ["MOTION", f"Frames: {clip.frames}", f"Frame Time: {1 / clip.rate_hz:.9f}"]
    lines += [numbers(frame) for frame in np.hstack(columns)]
    path.write_text("\n".join(lines) + "\n")
    return path


def sheet_row(**changes):
    row = ClipRow(
        id="known", dataset=None, path="known.bvh", up_axis="y", unit="m", rate_hz=None,
        subject="nobody", action="walk", style="normal", mass_kg=73.0, sex="male",
        first_frame=None, last_frame=None, cycles=1, skeleton="cmu_asf", forces=None, static=None,
        level="kinematic", surface="level", mirror=False, experiments=("gait",), note=None, row=2,
        folder=Path(),
    )  # fmt: skip
    return replace(row, **changes)


def ingest(path, row, settings=SETTINGS, **options):
    return ingest_clip(
        row, path, SKELETONS, settings, default_mass_kg=70.0, default_sex="male", **options
    )


@pytest.fixture
def ingested(tmp_path):
    """Return a function: coordinates of a body through a BVH file to an ingested motion."""

    def through_a_file(
        body, coordinates, settings=SETTINGS, *, rate=RATE, world=None, twist=0.0, factor=1.0,
        turn=None, lose=None, **changes,
    ):  # fmt: skip
        row = sheet_row(**changes)
        skeleton = read_skeleton_map(SKELETONS, row.skeleton)
        clip = clip_of(skeleton, body, coordinates, rate, twist_deg=twist)
        if lose is not None:
            clip = lose(clip)
        if world is not None:
            rotation, shift = world
            clip = replace(
                clip,
                positions=clip.positions @ rotation.T + shift,
                rotations=rotation @ clip.rotations,
            )
        path = write_bvh(tmp_path / "known.bvh", clip, factor, turn)
        return ingest(path, row, settings)

    return through_a_file


@pytest.fixture(scope="module")
def walk(plain_body):
    return known_gait(plain_body)


def rms_deg(found, truth, columns):
    return np.degrees(np.sqrt(((found - truth)[:, columns] ** 2).mean(axis=0)).max())


def assert_recovered(out, truth, *, upper=0.2, legs=1.2, feet=1.5, place_mm=1.0):
    """The motion is the truth but for what filter and grounding do.

    6 Hz take the edge off landing and push-off: 1° in the legs; a heel counts as bearing until
    it is 3 cm up, and is held down so long: 1.5° in the feet. Nothing else moves as fast.
    """
    q = out.motion.coordinates
    assert 1000 * np.sqrt(((q - truth)[:, :3] ** 2).mean(axis=0)).max() < place_mm
    assert rms_deg(q, truth, UPPER) < upper
    assert rms_deg(q, truth, LEGS) < legs
    assert rms_deg(q, truth, FEET) < feet


def test_a_known_walk_comes_back(ingested, walk):
    out = ingested(walk.body, walk.coordinates)
    motion = out.motion
    assert_recovered(out, walk.coordinates)
    toes = motion.coordinates[:, TOES] - walk.coordinates[:, TOES]
    assert np.degrees(np.abs(toes).max()) < 25
    assert np.degrees(np.std(toes, axis=0)).max() < 4
    np.testing.assert_allclose(motion.body.joint_offsets, walk.body.joint_offsets, atol=1e-3)
    np.testing.assert_allclose(
        motion.body.geometry.contact_points, walk.body.geometry.contact_points, atol=1e-3
    )
    assert motion.body.mass == pytest.approx(73.0)
    assert motion.body.mass_source == "sheet"
    assert motion.observed.all()
    assert motion.rate_hz == RATE
    assert motion.rebranched == ()
    assert out.report["floor_tilt_deg"] == 0.0
    assert out.report["marker_rms_cm"] < 0.3
    assert max(out.marker_rms_cm.values()) < 1.0
    assert out.report["repaired_frames"] == 0
    assert out.report["warnings"] == ""
    assert motion.provenance["source_frames"] == f"0-{motion.frames - 1}"


def test_without_filter_only_the_grounding_shows(ingested, walk):
    out = ingested(walk.body, walk.coordinates, UNFILTERED)
    assert_recovered(out, walk.coordinates, upper=0.02, legs=0.6, feet=1.3, place_mm=0.3)


def test_contacts_slip_and_penetration_of_a_known_walk(ingested, walk):
    motion = ingested(walk.body, walk.coordinates).motion
    assert_stances(walk, motion.contacts, frames=2)
    assert gait.foot_slip_mm(motion) < 3.0
    assert gait.penetration_mm(motion) < 3.0
    np.testing.assert_array_equal(motion.contact_normals[..., 1], 1.0)
    assert gait.mean_speed(motion) == pytest.approx(1.2, rel=0.02)
    assert np.median(gait.step_lengths(motion)) == pytest.approx(walk.step_m, abs=0.01)


def test_a_known_run_keeps_its_stances(ingested, plain_body):
    run = known_run(plain_body)
    out = ingested(plain_body, run.coordinates, action="run")
    motion = out.motion
    assert_stances(run, motion.contacts, frames=6)
    assert gait.foot_slip_mm(motion) < 10.0
    assert gait.penetration_mm(motion) < 6.0
    assert_recovered(out, run.coordinates, feet=2.0)
    assert (
        len(gait.foot_stances(ingested(plain_body, run.coordinates).motion))
        < len(gait.foot_stances(motion))
        or gait.double_support(motion) == 0.0
    )


@pytest.mark.parametrize("twist", [30.0, -80.0])
def test_an_arbitrary_twist_of_the_zero_pose_changes_nothing(ingested, walk, twist):
    plain = ingested(walk.body, walk.coordinates)
    twisted = ingested(walk.body, walk.coordinates, twist=twist)
    np.testing.assert_allclose(
        twisted.motion.coordinates, plain.motion.coordinates, atol=np.radians(0.2)
    )


def test_a_meaningless_zero_pose_with_axes_changes_nothing(ingested, walk):
    out = ingested(walk.body, walk.coordinates, skeleton="bandai")
    assert_recovered(out, walk.coordinates)
    np.testing.assert_allclose(out.motion.body.joint_offsets, walk.body.joint_offsets, atol=1e-3)


def test_lost_offsets_are_restored(ingested, walk):
    def lose(clip):
        """The offsets of neck and collars are gone, as in the converted files."""
        spine = clip.rest_offsets[clip.joints.index("Spine1")]
        for joint in ("Neck", "LeftShoulder", "RightShoulder"):
            clip = lose_offset(clip, joint, spine)
        return clip

    out = ingested(walk.body, walk.coordinates, skeleton="cmu_motionbuilder", lose=lose)
    assert_recovered(out, walk.coordinates)
    np.testing.assert_allclose(out.motion.body.joint_offsets, walk.body.joint_offsets, atol=1e-3)


@pytest.mark.parametrize("heading", [35.0, -140.0, 90.0])
def test_the_pelvis_faces_x_over_the_origin_in_the_first_frame(ingested, walk, heading):
    turn = exponential(np.array([0.0, np.radians(heading), 0.0]))
    out = ingested(walk.body, walk.coordinates, world=(turn, np.array([4.0, 0.0, -7.0])))
    right = out.motion.pose().rotations[0, NODE_INDEX["pelvis"]][:, 2]
    # within what the filter moves the first frame
    assert abs(np.degrees(np.arctan2(right[0], right[2]))) < 0.3
    assert np.abs(out.motion.coordinates[0, [0, 2]]).max() < 0.002
    assert_recovered(out, walk.coordinates)


@pytest.mark.parametrize("height", [0.4, -0.3])
def test_a_floor_at_another_height_is_found(ingested, walk, height):
    out = ingested(walk.body, walk.coordinates, world=(np.eye(3), np.array([0.0, height, 0.0])))
    # how far below the ball joint the sole is cannot be known then: its usual 2.6 cm here 2.5
    assert_recovered(out, walk.coordinates, place_mm=5.0)
    assert out.motion.body.geometry.contact_points[:, 1] == pytest.approx(
        walk.body.geometry.contact_points[:, 1], abs=0.003
    )
    assert_stances(walk, out.motion.contacts, frames=2)


@pytest.mark.parametrize("tilt", [1.2, -3.0, 5.0])
def test_a_planted_tilt_is_turned_level(ingested, walk, tilt):
    turn = exponential(np.array([0.0, 0.0, np.radians(tilt)]))
    out = ingested(walk.body, walk.coordinates, world=(turn, np.zeros(3)))
    assert out.report["floor_tilt_deg"] == pytest.approx(abs(tilt), abs=0.1)
    assert out.report["floor_stances"] >= 4
    assert_recovered(out, walk.coordinates, upper=0.3, place_mm=6.0)
    assert_stances(walk, out.motion.contacts, frames=2)


def test_a_smaller_tilt_than_configured_is_left_alone(ingested, walk):
    turn = exponential(np.array([0.0, 0.0, np.radians(1.0)]))
    deaf = replace(SETTINGS, smallest_tilt_deg=1.5)
    out = ingested(walk.body, walk.coordinates, deaf, world=(turn, np.zeros(3)))
    assert out.report["floor_tilt_deg"] == pytest.approx(1.0, abs=0.1)
    climbed = out.motion.coordinates[-1, 1] - walk.coordinates[-1, 1]
    assert climbed == pytest.approx(np.tan(np.radians(1.0)) * 1.2 * 2.8, abs=0.015)


def test_a_tilt_over_the_limit_is_refused_with_advice(ingested, walk):
    turn = exponential(np.array([0.0, 0.0, np.radians(9.0)]))
    with pytest.raises(MotionStyleError) as caught:
        ingested(walk.body, walk.coordinates, world=(turn, np.zeros(3)))
    message = str(caught.value)
    assert "known.bvh: the feet stand on a slope of 9.0°, more than the 6°" in message
    assert "set surface to ramp, stairs or uneven in the sheet, or check up_axis" in message
    ramp = ingested(walk.body, walk.coordinates, world=(turn, np.zeros(3)), surface="ramp")
    assert ramp.report["floor_tilt_deg"] == 0.0


def test_z_up_equals_y_up(ingested, walk):
    plain = ingested(walk.body, walk.coordinates)
    upended = exponential(np.array([np.pi / 2, 0.0, 0.0]))
    out = ingested(walk.body, walk.coordinates, turn=upended, up_axis="z")
    np.testing.assert_allclose(out.motion.coordinates, plain.motion.coordinates, atol=1e-5)
    np.testing.assert_array_equal(out.motion.contacts, plain.motion.contacts)
    with pytest.raises(MotionStyleError, match="wrong up axis"):
        ingested(walk.body, walk.coordinates, turn=upended)


@pytest.mark.parametrize("unit", ["cm", "mm", "inch", "cmu", "0.3"])
def test_units_equal_metres(ingested, walk, unit):
    short = walk.coordinates[:150]
    plain = ingested(walk.body, short)
    out = ingested(walk.body, short, factor=1 / (METRES.get(unit) or float(unit)), unit=unit)
    np.testing.assert_allclose(out.motion.coordinates, plain.motion.coordinates, atol=1e-5)
    np.testing.assert_array_equal(out.motion.contacts, plain.motion.contacts)


def test_the_mirrored_clip_gives_the_mirrored_motion(ingested, plain_geometry):
    offsets = np.array(plain_geometry.joint_offsets)
    offsets[NODE_INDEX["forearm_l"], 1] *= 0.9  # a person who is not symmetric
    points = plain_geometry.contact_points, plain_geometry.end_points
    body = build_body(BodyGeometry(offsets, *points), 73.0)
    walk = known_gait(body)
    motion = ingested(body, walk.coordinates).motion
    other = mirror_motion(motion.__class__(
        id="m", kind="captured", rate_hz=RATE, coordinates=walk.coordinates, body=body,
        contacts=walk.contacts, contact_normals=motion.contact_normals, observed=motion.observed,
    ))  # fmt: skip
    mirrored = ingested(other.body, other.coordinates).motion
    expected = mirror_motion(motion)
    # the markers beside the trunk's joints lie on its right only
    np.testing.assert_allclose(mirrored.coordinates, expected.coordinates, atol=np.radians(0.1))
    np.testing.assert_array_equal(mirrored.contacts, expected.contacts)
    np.testing.assert_allclose(mirrored.body.joint_offsets, expected.body.joint_offsets, atol=1e-6)
    assert np.abs(mirrored.coordinates - motion.coordinates).max() > 0.1


@pytest.mark.parametrize("name", ["aalto", "pymo"])
def test_what_the_source_does_not_show_is_flagged_and_left_at_zero(ingested, plain_body, name):
    skeleton = read_skeleton_map(SKELETONS, name)
    walk = known_gait(plain_body, thorax="thorax" in skeleton.joints)
    out = ingested(plain_body, walk.coordinates, skeleton=name)
    motion = out.motion
    unseen = {c for c, at in zip(COORDINATES, COORDINATE_NODE, strict=True)
              if NODES[at] not in skeleton.joints}  # fmt: skip
    assert unseen == {c for c, seen in zip(COORDINATES, motion.observed, strict=True) if not seen}
    assert unseen == (
        {"thorax_flexion", "thorax_rotation"}
        if name == "pymo"
        else {"toes_extension_r", "toes_extension_l"}
    )
    for coordinate in unseen:
        values = motion.coordinates[:, COORDINATE_INDEX[coordinate]]
        if coordinate.startswith("thorax"):
            assert not values.any()
        else:
            # toes extend only to clear the floor, so they lie straight while the foot is flat
            side = coordinate[-1]
            tip = contact_points(motion.body, motion.pose())[:, CONTACT_POINTS.index(f"toe_{side}")]
            assert values.max() > 0.15
            assert values.min() > np.radians(-3)
            bent = np.degrees(values) > 10
            assert 0.05 < bent.mean() < 0.6
            assert tip[bent, 1].max() < 0.02
    assert_recovered(out, walk.coordinates, place_mm=2.0)


def test_exponential_maps_are_continuous_and_a_spin_reports_its_branches(ingested, plain_body):
    frames = 300
    q = np.zeros((frames, len(COORDINATES)))
    q[:, 1] = 0.80
    t = np.arange(frames) / RATE
    angle = np.radians(720) * t / t[-1]
    q[:, 4] = angle
    for side, shift in (("r", 0.0), ("l", np.pi)):
        q[:, COORDINATE_INDEX[f"knee_flexion_{side}"]] = 0.7 + 0.3 * np.sin(9 * t + shift)
        q[:, COORDINATE_INDEX[f"hip_flexion_{side}"]] = 0.35 + 0.2 * np.sin(9 * t + shift)
        q[:, COORDINATE_INDEX[f"elbow_flexion_{side}"]] = 0.6
    out = ingested(plain_body, q, action="dance")
    motion = out.motion
    assert out.report["rebranched_frames"] == len(motion.rebranched) == 2
    for block in EXPONENTIAL_BLOCKS:
        steps = np.linalg.norm(np.diff(motion.coordinates[:, block], axis=0), axis=1)
        jumps = {int(i) + 1 for i in np.flatnonzero(steps > 0.5)}
        assert jumps == (set(motion.rebranched) if block.start == 3 else set())
    found = exponential(motion.coordinates[:, 3:6])
    truth = exponential(np.outer(angle, [0.0, 1.0, 0.0]))
    off = np.linalg.norm(logarithm(np.swapaxes(truth, 1, 2) @ found), axis=1)
    assert np.degrees(np.median(off)) < 0.5
    half = ingested(plain_body, q[:100], action="dance").motion
    assert half.rebranched == ()
    assert np.degrees(np.linalg.norm(half.coordinates[-1, 3:6])) == pytest.approx(238, abs=2)


def test_a_window_keeps_its_frames(ingested, walk):
    out = ingested(walk.body, walk.coordinates, first_frame=40, last_frame=239)
    assert out.motion.frames == 200
    assert out.motion.provenance["source_frames"] == "40-239"
    assert out.motion.coordinates[0, 0] == pytest.approx(0.0, abs=0.002)
    knees = [COORDINATE_INDEX[f"knee_flexion_{side}"] for side in "rl"]
    assert rms_deg(out.motion.coordinates, walk.coordinates[40:240], knees) < 1.5


def test_a_window_beyond_the_clip_is_refused(ingested, walk):
    with pytest.raises(
        MotionStyleError, match=r"known: last_frame is 281, but .*known.bvh has frames 0 to 280"
    ):
        ingested(walk.body, walk.coordinates, last_frame=281)


@pytest.mark.parametrize(("first", "last", "count"), [(10, 16, 7), (278, None, 3), (400, None, 0)])
def test_too_few_frames_are_refused(ingested, walk, first, last, count):
    with pytest.raises(MotionStyleError, match=rf"are {count} frames; .* at least 8"):
        ingested(walk.body, walk.coordinates, first_frame=first, last_frame=last)
    if count == 7:
        assert (
            ingested(walk.body, walk.coordinates, first_frame=10, last_frame=17).motion.frames == 8
        )


def test_another_skeleton_is_refused_with_all_that_differs(ingested, walk):
    def spoil(clip):
        new = {"rfemur": "rfemr", "lhumerus": "lhumorus"}
        return replace(clip, joints=tuple(new.get(j, j) for j in clip.joints))

    with pytest.raises(MotionStyleError) as caught:
        ingested(walk.body, walk.coordinates, lose=spoil)
    for part in (
        "lacks joint 'rfemur' (did you mean rfemr", "lacks joint 'lhumerus' (did you mean ",
        "has joint 'rfemr'", "has joint 'lhumorus'", "not the skeleton 'cmu_asf'",
    ):  # fmt: skip
        assert part in str(caught.value)


def test_what_the_row_leaves_open_takes_the_defaults(ingested, walk):
    motion = ingested(walk.body, walk.coordinates[:60], mass_kg=None, sex=None).motion
    assert motion.body.mass == pytest.approx(70.0)
    assert (motion.body.mass_source, motion.body.sex) == ("default", "male")


@pytest.mark.parametrize(("frames", "cycles", "shown"), [(115, 3, "0-38"), (40, 1, "0-39")])
def test_a_clip_that_is_run_through_again_shows_the_frames_of_one_cycle(frames, cycles, shown):
    from types import SimpleNamespace

    from motionstyle.mocap.skeletons.ingest import _source_frames

    row = SimpleNamespace(first_frame=None, cycles=cycles)
    assert _source_frames(row, SimpleNamespace(frames=frames)) == shown
