"""`read_bvh`: what it accepts, what it refuses, and that two independent readers agree."""

from __future__ import annotations

import time
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionstyle.errors import MotionStyleError
from motionstyle.mocap.formats.bvh import read_bvh

MIRROR = Path(__file__).parents[3] / "shared" / "mocap"

GOOD = """\
HIERARCHY
ROOT Hips
{
  OFFSET 1.0 2.0 3.0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Knee
  {
    OFFSET 0.0 -4.0 0.0
    CHANNELS 3 Yrotation Zrotation Xrotation
    End Site
    {
      OFFSET 0.0 -5.0 1.0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.008333
0 10 0 0 0 0 0 0 0
1 11 2 90 0 0 10 20 30
"""


def read(folder: Path, content: str | bytes, name: str = "clip.bvh"):
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_bvh(path)


def changed(old: str, new: str) -> str:
    assert old in GOOD
    return GOOD.replace(old, new, 1)


def test_values_of_a_small_file(tmp_path):
    clip = read(tmp_path, GOOD)
    assert clip.joints == ("Hips", "Knee", "Knee_end")
    assert clip.parents.tolist() == [-1, 0, 1]
    assert clip.rest_offsets.tolist() == [[1, 2, 3], [0, -4, 0], [0, -5, 1]]
    assert clip.rate_hz == 120.0
    assert clip.source.endswith("clip.bvh")
    # Frame 0: no rotation, and the root's position channels replace its OFFSET.
    np.testing.assert_allclose(clip.positions[0], [[0, 10, 0], [0, 6, 0], [0, 1, 1]], atol=1e-12)
    np.testing.assert_allclose(clip.rotations[0], np.tile(np.eye(3), (3, 1, 1)), atol=1e-12)
    # Frame 1: 90 degrees about z turn the thigh from -y to +x.
    np.testing.assert_allclose(clip.positions[1, 1], [5, 11, 2], atol=1e-12)
    hip = Rotation.from_euler("Z", 90, degrees=True)
    knee = (hip * Rotation.from_euler("YZX", [10, 20, 30], degrees=True)).as_matrix()
    np.testing.assert_allclose(clip.rotations[1, 1], knee, atol=1e-12)
    np.testing.assert_allclose(clip.rotations[1, 2], knee, atol=1e-12)
    np.testing.assert_allclose(clip.positions[1, 2], [5, 11, 2] + knee @ [0, -5, 1], atol=1e-12)


def test_position_channels_of_an_inner_joint_replace_its_offset_by_component(tmp_path):
    text = changed("CHANNELS 3 Yrotation Zrotation Xrotation", "CHANNELS 2 Zposition Xposition")
    text = text.replace("0 10 0 0 0 0 0 0 0", "0 10 0 0 0 0 7 8")
    clip = read(tmp_path, text.replace("1 11 2 90 0 0 10 20 30", "1 11 2 90 0 0 7 8"))
    np.testing.assert_allclose(clip.positions[0, 1], [8, 6, 7], atol=1e-12)
    np.testing.assert_allclose(clip.positions[1, 1], [1 + 4, 11 + 8, 2 + 7], atol=1e-12)


@pytest.mark.parametrize(
    "content",
    [
        pytest.param(GOOD.replace("\n", "\r\n").encode(), id="crlf"),
        pytest.param(GOOD.replace("\n", "\r").encode(), id="cr"),
        pytest.param(b"\xef\xbb\xbf" + GOOD.encode(), id="bom"),
        pytest.param(GOOD.replace(" ", "\t").encode(), id="tabs"),
        pytest.param(GOOD.replace(" ", "   ").encode(), id="several-spaces"),
        pytest.param(GOOD.replace("0.0 -4.0 0.0", "+0.0 -4.0E+00 1e-30").encode(), id="exponent"),
        pytest.param(GOOD.replace("ROOT Hips\n{", "ROOT Hips {").encode(), id="brace-on-line"),
        pytest.param(GOOD.replace("\n", "\n\n").encode(), id="blank-lines"),
        pytest.param(GOOD.rstrip("\n").encode(), id="no-last-newline"),
        pytest.param(GOOD.replace("Xposition", "XPOSITION").encode(), id="channel-case"),
        pytest.param(GOOD.replace("Frames: 2", "Frames:\t2").encode(), id="tab-in-header"),
    ],
)
def test_harmless_variants_read_the_same(tmp_path, content):
    clip, good = read(tmp_path, content), read(tmp_path, GOOD)
    assert clip.joints == good.joints
    np.testing.assert_allclose(clip.positions, good.positions, atol=1e-12)
    np.testing.assert_allclose(clip.rotations, good.rotations, atol=1e-12)


@pytest.mark.parametrize(
    "name", ["Genou_é", "mixamorig:Knee", "a b", "Knee#1", "\xa0x", "膝", "left-knee.001", "End"]
)
@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
def test_odd_joint_names(tmp_path, name, encoding):
    try:
        content = GOOD.replace("JOINT Knee", f"JOINT {name}").encode(encoding)
    except UnicodeEncodeError:
        pytest.skip("a name Latin-1 cannot write")
    assert read(tmp_path, content).joints[1] == name


def test_end_site_names_never_collide(tmp_path):
    second = "End Site\n{\nOFFSET 0 1 0\n}\nJOINT Knee_end\n{\nOFFSET 0 0 0\nCHANNELS 0\n}\n"
    clip = read(tmp_path, changed("    End Site", second + "    End Site"))
    assert clip.joints == ("Hips", "Knee", "Knee_end2", "Knee_end", "Knee_end3")
    assert clip.parents.tolist() == [-1, 0, 1, 1, 1]


REFUSED = {
    "fewer-rows": (changed("Frames: 2", "Frames: 3"), ["declares 3 rows", "has 2"]),
    "more-rows": (changed("Frames: 2", "Frames: 1"), ["declares 1 rows", "has 2"]),
    "row-cut-short": (changed("10 20 30", "10 20"), ["line 20", "frame 1", "8 values", "9"]),
    "row-too-long": (changed("20 30", "20 30 40"), ["line 20", "frame 1", "10 values", "9"]),
    "all-rows-short": (
        changed(" 0 0 0\n", " 0 0\n").replace("20 30", "20"),
        ["each of the 2 rows has 8", "9 channels"],
    ),
    "nan": (changed("90", "nan"), ["line 20", "column 4 (Hips Zrotation)", "nan"]),
    "inf": (changed("90", "-inf"), ["line 20", "column 4", "-inf"]),
    "overflow": (changed("90", "1e999"), ["line 20", "1e999"]),
    "decimal-comma": (changed("90", "4,5"), ["line 20", "column 4", "decimal comma", "'4.5'"]),
    "word-in-row": (changed("90", "abc"), ["line 20", "'abc'", "expected a number"]),
    "underscore": (changed("90", "9_0"), ["line 20", "'9_0'"]),
    "frame-time-0": (changed("0.008333", "0"), ["line 18", "Frame Time", "is 0"]),
    "frame-time-negative": (changed("0.008333", "-0.01"), ["line 18", "-0.01"]),
    "frame-time-nan": (changed("0.008333", "nan"), ["line 18", "nan"]),
    "frame-time-is-rate": (changed("0.008333", "120"), ["line 18", "is 120", "seconds"]),
    "frame-time-blank": (changed("0.008333", ""), ["line 18", "is missing"]),
    "frame-time-missing": (changed("Frame Time: 0.008333\n", ""), ["no 'Frame Time:'"]),
    "frames-missing": (changed("Frames: 2\n", ""), ["no 'Frames:'"]),
    "frames-0": (changed("Frames: 2", "Frames: 0"), ["line 17", "'0'", "above 0"]),
    "frames-negative": (changed("Frames: 2", "Frames: -2"), ["line 17", "'-2'"]),
    "frames-fraction": (changed("Frames: 2", "Frames: 2.5"), ["line 17", "'2.5'"]),
    "frames-twice": (changed("Frames: 2", "Frames: 2\nFrames: 2"), ["line 18", "a second"]),
    "no-rows": (GOOD[: GOOD.index("0 10 0")], ["declares 2 rows", "has 0"]),
    "empty": ("", ["the file is empty"]),
    "blank": (" \n\n", ["the file is empty"]),
    "hierarchy-only": (GOOD[: GOOD.index("MOTION")], ["no MOTION"]),
    "motion-only": (GOOD[GOOD.index("MOTION") :], ["no ROOT"]),
    "missing-brace": (changed("  }\n}\nMOTION", "  }\nMOTION"), ["line 2", "'Hips'", "closing"]),
    "missing-end-brace": (
        changed("-5.0 1.0\n    }\n", "-5.0 1.0\n  JOINT Foot\n  {\n"),
        ["the End Site of 'Knee' lacks its closing '}'"],
    ),
    "missing-open-brace": (changed("Hips\n{", "Hips\n"), ["line 4", "opening '{'"]),
    "extra-brace": (changed("}\nMOTION", "}\n}\nMOTION"), ["line 16", "one '}' too many"]),
    "extra-open-brace": (changed("{", "{\n{"), ["line 4", "'{' without"]),
    "duplicate-joint": (
        changed("JOINT Knee", "JOINT Hips"),
        ["line 6", "duplicate joint name 'Hips'", "line 2"],
    ),
    "unknown-channel": (changed("Xposition", "Xscale"), ["line 5", "'Xscale'", "'Hips'"]),
    "duplicate-channel": (
        changed("3 Yrotation Zrotation", "3 Yrotation Yrotation"),
        ["line 9", "duplicate channel 'Yrotation'", "'Knee'"],
    ),
    "channel-count": (changed("CHANNELS 3", "CHANNELS 4"), ["line 9", "announces 4", "lists 3"]),
    "channels-on-end": (changed("-5.0 1.0", "-5.0 1.0\nCHANNELS 0"), ["End Site of 'Knee'"]),
    "channels-missing": (
        changed("    CHANNELS 3 Yrotation Zrotation Xrotation\n", ""),
        ["joint 'Knee' has no CHANNELS"],
    ),
    "offset-missing": (changed("    OFFSET 0.0 -4.0 0.0\n", ""), ["line 6", "'Knee'", "no OFFSET"]),
    "offset-short": (changed("0.0 -4.0 0.0", "0.0 -4.0"), ["line 8", "2 values", "expected 3"]),
    "offset-comma": (changed("0.0 -4.0 0.0", "0,0 -4.0 0"), ["line 8", "OFFSET X", "comma"]),
    "offset-nan": (changed("0.0 -4.0 0.0", "0 nan 0"), ["line 8", "OFFSET Y", "nan"]),
    "second-root": (
        changed("MOTION", "ROOT B\n{\nOFFSET 0 0 0\nCHANNELS 0\n}\nMOTION"),
        ["line 16", "second ROOT 'B'"],
    ),
    "joint-outside": (changed("ROOT Hips", "JOINT Hips"), ["line 2", "outside of any ROOT"]),
    "nameless": (changed("JOINT Knee", "JOINT"), ["line 6", "JOINT without a name"]),
    "stray-word": (changed("HIERARCHY", "HIERARCHY\nMASS 3"), ["line 2", "'MASS 3'"]),
    "binary": (bytes(range(256)) * 4, ["not BVH text", "byte 0"]),
    "utf-16": (GOOD.encode("utf-16"), ["not BVH text", "UTF-16"]),
    "other-text": ("<html>\n<p>404\n", ["no ROOT", "no MOTION"]),
}


@pytest.mark.parametrize(("content", "expected"), REFUSED.values(), ids=REFUSED.keys())
def test_refused(tmp_path, content, expected):
    with pytest.raises(MotionStyleError) as caught:
        read(tmp_path, content, "bad.bvh")
    message = str(caught.value)
    assert str(tmp_path / "bad.bvh") in message
    for part in expected:
        assert part in message


def test_every_problem_is_listed_once_in_file_order(tmp_path):
    text = changed("0.0 -4.0 0.0", "0.0 nan 0.0").replace("Frames: 2", "Frames: 5")
    text = text.replace("0.008333", "0").replace("90 0", "9,5 inf")
    with pytest.raises(MotionStyleError) as caught:
        read(tmp_path, text)
    lines = str(caught.value).splitlines()
    assert lines[0].endswith("5 problems:")
    starts = [line.split(":")[0].strip() for line in lines[1:]]
    assert starts[:4] == ["line 8", "line 18", "line 20", "line 20"]
    assert "declares 5 rows" in lines[5]
    assert len(lines) == 6


def test_a_flood_of_problems_is_counted(tmp_path):
    text = changed("Frames: 2", "Frames: 102") + "1 11 2 x 0 0 10 20 30\n" * 100
    with pytest.raises(MotionStyleError, match="100 problems") as caught:
        read(tmp_path, text)
    assert str(caught.value).endswith("and 60 more")


@pytest.mark.parametrize("kind", ["absent", "folder"])
def test_unreadable(tmp_path, kind):
    path = tmp_path / "x.bvh"
    if kind == "folder":
        path.mkdir()
    with pytest.raises(MotionStyleError, match="cannot read this BVH file"):
        read_bvh(path)


ORDER = st.permutations(["X", "Y", "Z"])
ANGLE = st.floats(-720, 720).map(lambda value: round(value, 6))


@settings(max_examples=40, deadline=None)
@given(
    order=ORDER, places=ORDER, angles=st.lists(ANGLE, min_size=3, max_size=3), first=st.booleans()
)
def test_any_channel_order_against_scipy(tmp_path_factory, order, places, angles, first):
    rotation = [f"{axis}rotation" for axis in order]
    position = [f"{axis}position" for axis in places]
    where = {"X": 1.5, "Y": -2.5, "Z": 3.5}
    numbers = [*angles, *(where[axis] for axis in places)]
    channels = [*rotation, *position]
    if not first:
        numbers, channels = numbers[3:] + numbers[:3], position + rotation
    text = GOOD.replace("3 Yrotation Zrotation Xrotation", "6 " + " ".join(channels))
    text = text.replace("Frames: 2", "Frames: 1").split("0 10 0")[0]
    text += "0 0 0 0 0 0 " + " ".join(map(str, numbers)) + "\n"
    clip = read(tmp_path_factory.mktemp("order"), text)
    expected = Rotation.from_euler("".join(order), angles, degrees=True).as_matrix()
    np.testing.assert_allclose(clip.rotations[0, 1], expected, atol=1e-12)
    np.testing.assert_allclose(clip.positions[0, 1], [1.5, -2.5, 3.5], atol=1e-12)


def test_a_long_clip_reads_fast(tmp_path):
    joints, frames = 33, 2400
    blocks = "".join(
        f"JOINT j{at}\n{{\nOFFSET 0 1 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n"
        for at in range(joints - 1)
    )
    rows = np.random.default_rng(0).normal(0, 40, (frames, 3 * joints + 3))
    body = "\n".join(" ".join(f"{value:.5f}" for value in row) for row in rows)
    text = (
        "HIERARCHY\nROOT r\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation "
        f"Xrotation Yrotation\n{blocks}{'}' * joints}\nMOTION\nFrames: {frames}\n"
        f"Frame Time: 0.01\n{body}\n"
    )
    path = tmp_path / "long.bvh"
    path.write_text(text)
    durations = []
    for _ in range(3):
        start = time.perf_counter()
        clip = read_bvh(path)
        durations.append(time.perf_counter() - start)
    assert clip.positions.shape == (frames, joints, 3)
    assert min(durations) < 1.0  # 0.15 s where it was written; a loop over values takes 2 s


@pytest.mark.mirror
def test_every_mirrored_file_agrees_with_an_independent_reader():
    pybvh = pytest.importorskip("pybvh")
    files = sorted(MIRROR.rglob("*.bvh"))
    if not files:
        pytest.skip("no mirror folder")
    agreed = 0
    for path in files:
        clip = read_bvh(path)
        assert np.isfinite(clip.positions).all()
        if "bandai" in path.parts:
            continue  # position channels on every joint, which the other reader refuses
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            other = pybvh.read_bvh_file(path, world_up="+y").node_positions()
        # Both chain the same numbers in double precision; positions are below 1000 units.
        np.testing.assert_allclose(clip.positions, other, atol=1e-10, err_msg=str(path))
        agreed += 1
    assert agreed > 0
