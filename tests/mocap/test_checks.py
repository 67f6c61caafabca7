"""`check_clip`: units, up axis, frame rate, flips, frozen stretches, and no false alarms."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionstyle.errors import MotionStyleError
from motionstyle.mocap.formats.clip import SkeletonClip, forward_kinematics
from motionstyle.mocap.formats.readers import read_clip
from motionstyle.mocap.skeletons.checks import UNITS, body_length, check_clip, pelvis_joint

MIRROR = Path(__file__).parents[3] / "shared" / "mocap"

NAMES = (
    "root", "pelvis", "spine", "neck", "head", "head_end",
    "l_hip", "l_knee", "l_foot", "l_foot_end", "r_hip", "r_knee", "r_foot", "r_foot_end",
    "l_arm", "l_hand", "l_thumb", "l_thumb_end",
)  # fmt: skip
PARENTS = np.array([-1, 0, 1, 2, 3, 4, 1, 6, 7, 8, 1, 10, 11, 12, 2, 14, 15, 16])
OFFSETS = np.array([
    [0, 0, 0], [0, 0.9, 0], [0, 0.4, 0], [0, 0.1, 0], [0, 0.1, 0], [0, 0.2, 0],
    [0, 0, 0.1], [0, -0.45, 0], [0, -0.4, 0], [0.1, -0.05, 0],
    [0, 0, -0.1], [0, -0.45, 0], [0, -0.4, 0], [0.1, -0.05, 0],
    [0, 0, 0.2], [0, -0.6, 0], [0, -0.05, 0], [0, -0.03, 0],
])  # fmt: skip
LENGTH = 0.4 + 0.1 + 0.1 + 0.2 + 0.1 + 0.45 + 0.4 + np.hypot(0.1, 0.05)


def walk(frames=240, rate=120.0, height=None, turn=None, names=NAMES):
    """A body that glides along x at 0.3 m/s and swings its joints; `height` lifts the pelvis."""
    time = np.arange(frames) / rate
    local = np.tile(np.eye(3), (frames, len(NAMES), 1, 1))
    for joint in range(2, len(NAMES)):
        angle = 0.2 * np.sin(2 * np.pi * time + joint)
        local[:, joint] = Rotation.from_rotvec(angle[:, None] * [0, 0, 1]).as_matrix()
    places = np.tile(OFFSETS, (frames, 1, 1))
    places[:, 1, 0] = 0.3 * time
    if height is not None:
        places[:, 1, 1] += height
    if turn is not None:
        local[:, 1] = turn.as_matrix()
    positions, rotations = forward_kinematics(PARENTS, places, local)
    return SkeletonClip(names, PARENTS, OFFSETS, positions, rotations, rate, "walk.bvh")


def scaled(clip, factor):
    return replace(clip, positions=clip.positions * factor, rest_offsets=clip.rest_offsets * factor)


def turned(clip, rotation):
    """The same clip in other world axes."""
    matrix = rotation.as_matrix()
    return replace(
        clip,
        positions=clip.positions @ matrix.T,
        rest_offsets=clip.rest_offsets @ matrix.T,
        rotations=matrix @ clip.rotations @ matrix.T,
    )


def flipped(clip, joint, frames, degrees=180.0):
    """Turn a joint about its bone (y) in some frames; those below undo it, so nothing moves."""
    rotations = clip.rotations.copy()
    extra = Rotation.from_rotvec([0, np.radians(degrees), 0]).as_matrix()
    for frame in frames:
        rotations[frame, joint] = rotations[frame, joint] @ extra
    return replace(clip, rotations=rotations)


def refusal(clip, **options):
    with pytest.raises(MotionStyleError) as caught:
        check_clip(clip, **options)
    assert str(caught.value).startswith("walk.bvh: ")
    return str(caught.value)


def test_a_plausible_clip_passes_unchanged():
    clip = walk()
    checked, warnings = check_clip(clip)
    assert checked is clip
    assert warnings == ()


@pytest.mark.parametrize("frames", [1, 2, 3, 5])
def test_short_clips_pass(frames):
    assert check_clip(walk(frames))[1] == ()


def test_body_length_is_that_of_the_bones_in_any_pose():
    assert body_length(walk()) == pytest.approx(LENGTH, abs=1e-12)
    lying = walk(turn=Rotation.from_rotvec([0, 0, 1.5]))
    assert body_length(lying) == pytest.approx(LENGTH, abs=1e-12)


def test_body_length_without_telling_names_is_close():
    clip = walk(names=tuple(f"joint{at}" for at in range(len(NAMES))))
    assert body_length(clip) == pytest.approx(LENGTH, rel=0.25)
    assert check_clip(clip)[1] == ()


def test_pelvis_is_where_legs_and_head_meet():
    assert NAMES[pelvis_joint(walk())] == "pelvis"


@pytest.mark.parametrize("true", UNITS)
@pytest.mark.parametrize("assumed", UNITS)
def test_a_wrong_unit_is_refused_and_the_right_one_named(true, assumed):
    clip = scaled(walk(), UNITS[assumed] / UNITS[true])
    if assumed == true:
        assert check_clip(clip, unit_m=UNITS[assumed])[1] == ()
        return
    message = refusal(clip, unit_m=UNITS[assumed])
    assert "wrong unit" in message
    assert f"plausible as '{true}' ({LENGTH:.2f} m)" in message


def test_a_size_of_no_unit_is_refused():
    assert "no known unit" in refusal(scaled(walk(), 4.0))


@pytest.mark.parametrize(
    ("rotation", "axis"),
    [([np.pi / 2, 0, 0], "+z"), ([-np.pi / 2, 0, 0], "-z"), ([np.pi, 0, 0], "-y"),
     ([0, 0, -np.pi / 2], "+x")],
    ids=["z-up", "z-down", "y-down", "x-up"],
)  # fmt: skip
def test_a_wrong_up_axis_is_refused(rotation, axis):
    clip = turned(walk(), Rotation.from_rotvec(rotation))
    message = refusal(clip)
    assert "wrong up axis" in message
    assert f"along {axis}" in message
    assert check_clip(clip, lying=True)[1] == ()


def test_a_crawl_on_a_standing_rest_pose_is_only_remarked():
    warnings = check_clip(walk(turn=Rotation.from_rotvec([0, 0, -1.5])))[1]
    assert [warning.kind for warning in warnings] == ["lying"]


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("part", ["positions", "rotations"])
def test_numbers_that_are_not_finite(part, value):
    clip = walk()
    numbers = getattr(clip, part).copy()
    numbers[[7, 9], 3] = value
    assert "joint 'neck' is not finite in frames 7, 9" in refusal(replace(clip, **{part: numbers}))


def test_no_frames():
    assert "no frames" in refusal(walk(0))


def test_too_high_a_rate_is_refused_with_a_lower_one():
    clip = walk()
    run = np.arange(clip.frames)[:, None, None] * [4.0 / 120.0, 0, 0]
    clip = replace(clip, positions=clip.positions + run)
    assert check_clip(clip)[1] == ()
    message = refusal(replace(clip, rate_hz=480.0))
    assert "'pelvis'" in message
    assert "above 13 m/s at 480 Hz" in message
    assert "at most 240 Hz" in message


def test_a_fast_hand_is_refused_after_more_than_two_frames():
    clip = walk()
    place = clip.positions.copy()
    place[100:104, 15] += np.array([0.3, 0.6, 0.9, 1.2])[:, None] * [0, 1, 0]
    message = refusal(replace(clip, positions=place))
    assert "'l_hand' stays above 25 m/s" in message
    place = clip.positions.copy()
    place[100, 15, 1] += 0.3
    assert check_clip(replace(clip, positions=place))[1] == ()


def test_a_blend_from_another_pose_at_the_start_is_only_remarked():
    clip = walk()
    place = clip.positions.copy()
    place[:4] -= np.array([2.0, 1.5, 1.0, 0.5])[:, None, None] * [0, 0, 1]
    warnings = check_clip(replace(clip, positions=place))[1]
    assert [(warning.kind, warning.frames) for warning in warnings] == [("jump", (0, 1, 2, 3, 4))]


@pytest.mark.parametrize(("claimed", "true"), [(30.0, 120), (60.0, 120), (120.0, 30), (30.0, 60)])
def test_a_jump_reveals_the_rate(claimed, true):
    frames = 2 * true
    time = np.arange(frames) / true - 1.0
    height = np.maximum(0.25 - 0.5 * 9.81 * time**2, 0.0)
    clip = walk(frames, float(true), height)
    assert check_clip(clip)[1] == ()
    message = refusal(replace(clip, rate_hz=claimed))
    assert "wrong frame rate" in message
    assert f"perhaps {true} Hz" in message


def test_stepping_over_a_block_is_no_jump():
    time = np.arange(480) / 120.0 - 2.0
    height = 0.3 * np.clip(1.5 - np.abs(time), 0.0, 1.0)  # up in 1 s, 1 s on top, down in 1 s
    assert check_clip(walk(480, height=height))[1] == ()


def test_a_single_frame_flip_is_refused_and_repaired():
    clip = walk()
    broken = flipped(clip, NAMES.index("l_knee"), [50])
    assert "frame 50: joint 'l_knee' flips for one frame" in refusal(broken)
    mended, warnings = check_clip(broken, repair=True)
    assert [(one.kind, one.frames) for one in warnings] == [("repaired", (50,))]
    assert "1 flips repaired: l_knee in frame 50" in warnings[0].message
    # Halfway between the neighbours is within 1e-4 of the sine it replaces.
    np.testing.assert_allclose(mended.rotations[50], clip.rotations[50], atol=1e-3)
    others = np.arange(clip.frames) != 50
    np.testing.assert_array_equal(broken.rotations[others], mended.rotations[others])
    np.testing.assert_allclose(mended.positions, clip.positions, atol=1e-3)


def test_a_flip_that_carries_a_limb_along_is_repaired():
    clip = walk()
    knee, foot = NAMES.index("l_knee"), NAMES.index("l_foot")
    local = clip.rotations.copy()
    extra = Rotation.from_rotvec([2.5, 0, 0]).as_matrix()
    local[50, [knee, foot, foot + 1]] = extra @ local[50, [knee, foot, foot + 1]]
    place = clip.positions.copy()
    for at in (foot, foot + 1):
        place[50, at] = place[50, knee] + extra @ (place[50, at] - place[50, knee])
    broken = replace(clip, positions=place, rotations=local)
    assert np.abs(broken.positions - clip.positions).max() > 0.5
    assert "joint 'l_knee' flips" in refusal(broken)
    mended, warnings = check_clip(broken, repair=True)
    assert len(warnings) == 1
    np.testing.assert_allclose(mended.positions, clip.positions, atol=1e-3)


def test_two_flips_are_both_named():
    broken = flipped(flipped(walk(), 7, [50]), 11, [80])
    message = refusal(broken)
    assert "frame 50: joint 'l_knee'" in message
    assert "frame 80: joint 'r_knee'" in message


def test_a_flip_of_a_finger_and_a_lasting_flip_are_only_remarked():
    finger = check_clip(flipped(walk(), NAMES.index("l_thumb"), [50]))[1]
    assert [(one.kind, one.frames) for one in finger] == [("flip", (50,))]
    lasting = check_clip(flipped(walk(), NAMES.index("l_knee"), range(50, 60)))[1]
    assert [(one.kind, one.frames) for one in lasting] == [("jump", (50, 60))]


def test_turns_below_the_limit_are_no_flips():
    assert check_clip(flipped(walk(), NAMES.index("l_knee"), [50], degrees=100.0))[1] == ()


def frozen(first, last, frames=240):
    clip = walk(frames)
    index = np.arange(frames)
    index[first : last + 1] = first
    return replace(clip, positions=clip.positions[index], rotations=clip.rotations[index])


def test_a_frozen_stretch_inside_is_refused_unless_repair():
    clip = frozen(100, 130)
    assert "frames 100 to 130 are one and the same pose" in refusal(clip)
    warnings = check_clip(clip, repair=True)[1]
    assert [(one.kind, one.frames) for one in warnings] == [("frozen", tuple(range(100, 131)))]


@pytest.mark.parametrize(("first", "last"), [(0, 40), (200, 239)], ids=["start", "end"])
def test_frozen_ends_are_only_remarked(first, last):
    warnings = check_clip(frozen(first, last))[1]
    assert [(one.kind, one.frames[0], one.frames[-1]) for one in warnings] == [
        ("frozen", first, last)
    ]


def test_shorter_than_a_quarter_second_is_not_frozen():
    assert check_clip(frozen(100, 129))[1] == ()  # 29 steps of 1/120 s


@pytest.mark.parametrize("repair", [False, True])
def test_a_clip_that_never_moves_is_refused(repair):
    assert "nothing moves" in refusal(frozen(0, 239), repair=repair)


def metres_per_unit(path: str) -> float:
    if path.startswith(("bandai", "aalto", "cmu/bvh-daz", "cmu/bvh-salsa")):
        return UNITS["cm"]
    return UNITS["inch" if path.startswith("pymo") else "cmu"]


@pytest.mark.mirror
def test_no_mirrored_clip_is_refused_but_the_one_with_a_flip():
    if not (MIRROR / "manifest.csv").exists():
        pytest.skip("no mirror folder")
    with (MIRROR / "manifest.csv").open(newline="", encoding="utf-8") as handle:
        rows = [row for row in csv.DictReader(handle) if row["path"].endswith((".bvh", ".amc"))]
    refused = {}
    for row in rows:
        unit = metres_per_unit(row["path"])
        clip = scaled(read_clip(MIRROR / row["path"], rate_hz=float(row["fps"])), unit)
        assert clip.frames == int(row["frames"])
        try:
            check_clip(clip, unit_m=unit)
        except MotionStyleError as error:
            refused[row["path"]] = str(error)
    assert list(refused) == ["cmu/bvh-motionbuilder/05_19.bvh"]
    assert "frame 282: joint 'RightUpLeg' flips" in refused["cmu/bvh-motionbuilder/05_19.bvh"]


@pytest.mark.mirror
def test_the_wrong_rate_in_the_header_of_16_01_is_noticed():
    path = MIRROR / "cmu" / "bvh-asfnames" / "16_01.bvh"
    if not path.exists():
        pytest.skip("no mirror folder")
    clip = scaled(read_clip(path), UNITS["cmu"])
    with pytest.raises(MotionStyleError, match=r"at 30 Hz.*perhaps 120 Hz"):
        check_clip(clip)
    check_clip(replace(clip, rate_hz=120.0))
