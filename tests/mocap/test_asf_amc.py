"""`read_asf_amc` and `find_asf`: values, faults, and the same trials as BVH."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionstyle.errors import MotionStyleError
from motionstyle.mocap.formats.asf_amc import find_asf, read_asf_amc
from motionstyle.mocap.formats.bvh import read_bvh

MIRROR = Path(__file__).parents[3] / "shared" / "mocap"

ASF = """\
# made for the tests
:version 1.10
:units
  mass 1.0
  length 0.45
  angle deg
:root
   order TX TY TZ RX RY RZ
   axis XYZ
   position 0 0 0
   orientation 0 0 0
:bonedata
  begin
     id 1
     name thigh
     direction 0.6 -0.8 0
     length 5
     axis 10 20 30 XYZ
    dof rx ry rz
    limits (-160.0 20.0)
           (-70.0 70.0)
           (-60.0 70.0)
  end
  begin
     id 2
     name shin
     direction 0 -1 0
     length 4
     axis 0 0 20 XYZ
    dof rx
    limits (-10.0 170.0)
  end
  begin
     id 3
     name spine
     direction 0 1 0
     length 6
     axis 0 0 0 XYZ
  end
:hierarchy
  begin
    root spine thigh
    thigh shin
  end
"""

AMC = """\
#!OML:ASF x
:FULLY-SPECIFIED
:DEGREES
1
root 1 2 3 0 0 0
thigh 0 0 0
shin 0
2
root 1 2 3 10 20 30
thigh 40 50 60
shin 70
"""


def read(folder: Path, amc: str = AMC, asf: str = ASF, **options):
    (folder / "a.amc").write_bytes(amc.encode())
    (folder / "a.asf").write_bytes(asf.encode())
    return read_asf_amc(folder / "a.amc", folder / "a.asf", **options)


def fixed_xyz(x, y, z):
    """About fixed axes, x first."""
    return Rotation.from_euler("xyz", [x, y, z], degrees=True)


def test_zero_pose_has_identity_rotations_and_bone_starts_as_joints(tmp_path):
    clip = read(tmp_path)
    assert clip.joints == ("root", "spine", "thigh", "shin", "spine_end", "shin_end")
    assert clip.parents.tolist() == [-1, 0, 0, 2, 1, 3]
    assert clip.rate_hz == 120.0
    assert clip.source.endswith("a.amc")
    np.testing.assert_allclose(clip.rotations[0], np.tile(np.eye(3), (6, 1, 1)), atol=1e-12)
    rest = [[0, 0, 0], [0, 0, 0], [0, 0, 0], [3, -4, 0], [0, 6, 0], [3, -8, 0]]
    np.testing.assert_allclose(clip.rest_positions(), rest, atol=1e-12)
    np.testing.assert_allclose(clip.positions[0], np.add(rest, [1, 2, 3]), atol=1e-12)


def test_bones_turn_about_their_own_axes(tmp_path):
    clip = read(tmp_path)
    root, axes, knee = fixed_xyz(10, 20, 30), fixed_xyz(10, 20, 30), fixed_xyz(0, 0, 20)
    thigh = root * axes * fixed_xyz(40, 50, 60) * axes.inv()
    shin = thigh * knee * fixed_xyz(70, 0, 0) * knee.inv()
    for joint, expected in (("root", root), ("thigh", thigh), ("shin", shin), ("spine", root)):
        got = clip.rotations[1, clip.joints.index(joint)]
        np.testing.assert_allclose(got, expected.as_matrix(), atol=1e-12)
    end = np.array([1, 2, 3]) + thigh.apply([3, -4, 0]) + shin.apply([0, -4, 0])
    np.testing.assert_allclose(clip.positions[1, 5], end, atol=1e-12)


def test_axis_order_and_channel_order_are_respected(tmp_path):
    asf = ASF.replace("axis 10 20 30 XYZ", "axis 10 20 30 ZXY").replace("rx ry rz", "rz rx ry")
    clip = read(tmp_path, AMC.replace("root 1 2 3 10 20 30", "root 1 2 3 0 0 0"), asf)
    axes = Rotation.from_euler("zxy", [30, 10, 20], degrees=True)
    turn = Rotation.from_euler("zxy", [40, 50, 60], degrees=True)
    np.testing.assert_allclose(
        clip.rotations[1, 2], (axes * turn * axes.inv()).as_matrix(), atol=1e-12
    )


def test_radians(tmp_path):
    degrees = read(tmp_path)
    amc = AMC.replace(":DEGREES", ":RADIANS").replace("shin 70", f"shin {float(np.radians(70))!r}")
    amc = amc.replace("10 20 30", " ".join(map(repr, np.radians([10, 20, 30]).tolist())))
    amc = amc.replace("40 50 60", " ".join(map(repr, np.radians([40, 50, 60]).tolist())))
    np.testing.assert_allclose(read(tmp_path, amc).positions, degrees.positions, atol=1e-12)
    asf = ASF.replace("angle deg", "angle rad").replace("0 0 20", f"0 0 {float(np.radians(20))!r}")
    asf = asf.replace("10 20 30", " ".join(map(repr, np.radians([10, 20, 30]).tolist())))
    np.testing.assert_allclose(read(tmp_path, asf=asf).positions, degrees.positions, atol=1e-12)


def test_the_length_factor_is_not_applied(tmp_path):
    clip = read(tmp_path, asf=ASF.replace("length 0.45", "length 0.9"))
    np.testing.assert_array_equal(clip.positions, read(tmp_path).positions)


@pytest.mark.parametrize("end", ["\r\n", "\r", "\n\n"])
def test_line_ends(tmp_path, end):
    clip = read(tmp_path, AMC.replace("\n", end), ASF.replace("\n", end))
    np.testing.assert_array_equal(clip.positions, read(tmp_path).positions)


def test_rate_and_first_frame_number_are_free(tmp_path):
    clip = read(tmp_path, AMC.replace("\n1\n", "\n7\n").replace("\n2\n", "\n8\n"), rate_hz=60.0)
    assert (clip.rate_hz, clip.frames) == (60.0, 2)


def swap(text: str, old: str, new: str) -> str:
    assert old in text
    return text.replace(old, new, 1)


AMC_FAULTS = {
    "missing-bone": (swap(AMC, "shin 0\n", ""), ["line 4", "frame 1 lacks 1 of 3", "shin"]),
    "truncated-last-frame": (
        AMC[: AMC.index("thigh 40")],
        ["line 8", "frame 2 lacks 2 of 3 bones: thigh, shin"],
    ),
    "cut-in-a-line": (
        AMC[: AMC.index(" 60")],
        ["line 10", "'thigh' has 2 values, expected 3 (RX RY RZ)", "lacks 1 of 3"],
    ),
    "too-many-values": (swap(AMC, "shin 70", "shin 70 1"), ["line 11", "2 values, expected 1"]),
    "frame-skipped": (swap(AMC, "\n2\n", "\n3\n"), ["line 8", "frame 3 follows frame 1"]),
    "frame-repeated": (swap(AMC, "\n2\n", "\n1\n"), ["line 8", "expected 2"]),
    "unknown-bone": (swap(AMC, "shin 70", "shins 70"), ["line 11", "'shins'", "mean shin"]),
    "still-bone": (AMC + "spine 1 2 3\n", ["line 12", "'spine' has no degrees of freedom"]),
    "bone-twice": (AMC + "shin 70\n", ["line 12", "a second line for bone 'shin'"]),
    "nan": (swap(AMC, "shin 70", "shin nan"), ["line 11", "RX of bone 'shin' is nan"]),
    "decimal-comma": (swap(AMC, "shin 70", "shin 7,5"), ["line 11", "decimal comma"]),
    "no-unit": (swap(AMC, ":DEGREES\n", ""), ["neither :DEGREES nor :RADIANS"]),
    "two-units": (swap(AMC, ":DEGREES", ":DEGREES\n:RADIANS"), ["line 4", "second angle unit"]),
    "values-before-frame": (swap(AMC, "\n1\n", "\n"), ["line 4", "before the first frame"]),
    "no-frames": (AMC[: AMC.index("1\nroot")], ["no frames"]),
    "empty": ("", ["the file is empty"]),
    "binary": ("\0\1\2", ["not AMC text"]),
}

ASF_FAULTS = {
    "empty": ("", ["no :root", "no bones", "no angle unit"]),
    "no-angle-unit": (swap(ASF, "  angle deg\n", ""), ["no angle unit"]),
    "angle-unit": (swap(ASF, "angle deg", "angle gon"), ["line 6", "'gon'"]),
    "direction-length": (swap(ASF, "0.6 -0.8 0", "0.6 -0.9 0"), ["line 16", "'thigh'", "1.08"]),
    "direction-short": (swap(ASF, "0.6 -0.8 0", "0.6 -0.8"), ["line 16", "2 values"]),
    "length-nan": (swap(ASF, "length 5", "length nan"), ["line 17", "length of 'thigh' is nan"]),
    "length-negative": (swap(ASF, "length 5", "length -5"), ["line 17", "-5"]),
    "axis-order": (swap(ASF, "30 XYZ", "30 XYY"), ["line 18", "'XYY'"]),
    "unknown-dof": (swap(ASF, "rx ry rz", "rx ry l"), ["line 19", "'L'"]),
    "duplicate-dof": (swap(ASF, "rx ry rz", "rx rx rz"), ["line 19", "duplicate"]),
    "shifting-bone": (swap(ASF, "rx ry rz", "tx ry rz"), ["line 19", "'thigh' shifts"]),
    "duplicate-bone": (swap(ASF, "name shin", "name thigh"), ["line 26", "duplicate", "'thigh'"]),
    "bone-without-length": (swap(ASF, "     length 4\n", ""), ["'shin' has no length"]),
    "unknown-in-hierarchy": (swap(ASF, "thigh shin", "thigh shen"), ["'shen'", "mean shin"]),
    "orphan": (swap(ASF, "    thigh shin\n", ""), ["bone 'shin' hangs on no chain"]),
    "second-parent": (
        swap(ASF, "thigh shin\n", "thigh shin\n spine shin\n"),
        ["'shin' has a second parent 'spine'"],
    ),
    "no-end": (swap(ASF, "  end\n:hierarchy", ":hierarchy"), ["line 33", "lacks its 'end'"]),
    "turned-root": (swap(ASF, "orientation 0 0 0", "orientation 0 9 0"), ["line 11", "0 9 0"]),
}


@pytest.mark.parametrize(("amc", "expected"), AMC_FAULTS.values(), ids=AMC_FAULTS.keys())
def test_refused_amc(tmp_path, amc, expected):
    with pytest.raises(MotionStyleError) as caught:
        read(tmp_path, amc)
    assert str(tmp_path / "a.amc") in str(caught.value)
    for part in expected:
        assert part in str(caught.value)


@pytest.mark.parametrize(("asf", "expected"), ASF_FAULTS.values(), ids=ASF_FAULTS.keys())
def test_refused_asf(tmp_path, asf, expected):
    with pytest.raises(MotionStyleError) as caught:
        read(tmp_path, asf=asf)
    assert str(tmp_path / "a.asf") in str(caught.value)
    for part in expected:
        assert part in str(caught.value)


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), float("inf")])
def test_refused_rate(tmp_path, rate):
    with pytest.raises(MotionStyleError, match="rate_hz"):
        read(tmp_path, rate_hz=rate)


def test_find_asf(tmp_path):
    amc = tmp_path / "02_01_b.amc"
    with pytest.raises(MotionStyleError, match=r"02_01_b\.asf.*02_01\.asf"):
        find_asf(amc)
    (tmp_path / "02_01.asf").touch()
    assert find_asf(amc) == tmp_path / "02_01.asf"
    (tmp_path / "02_01_b.asf").touch()
    assert find_asf(str(amc)) == tmp_path / "02_01_b.asf"


SAME = {
    "lfemur": "LeftUpLeg", "ltibia": "LeftLeg", "lfoot": "LeftFoot", "ltoes": "LeftToeBase",
    "rfemur": "RightUpLeg", "rtibia": "RightLeg", "rfoot": "RightFoot", "rtoes": "RightToeBase",
    "lowerback": "LowerBack", "upperback": "Spine", "thorax": "Spine1",
}  # fmt: skip
ABOVE = {
    "lowerneck": "Neck", "upperneck": "Neck1", "head": "Head", "lclavicle": "LeftShoulder",
    "lhumerus": "LeftArm", "lradius": "LeftForeArm", "rclavicle": "RightShoulder",
    "rhumerus": "RightArm", "rradius": "RightForeArm",
}  # fmt: skip


@pytest.mark.mirror
@pytest.mark.parametrize("trial", ["02_01", "02_03", "02_04", "03_01", "03_02"])
def test_the_same_trial_as_bvh(trial):
    amc = MIRROR / "cmu" / "asfamc" / f"{trial}.amc"
    if not amc.exists():
        pytest.skip("no mirror folder")
    one = read_asf_amc(amc, find_asf(amc))
    two = read_bvh(MIRROR / "cmu" / "bvh-motionbuilder" / f"{trial}.bvh")
    assert two.frames == one.frames + 1  # the BVH begins with a T-pose

    def at(clip, joint, first=0):
        index = clip.joints.index(joint)
        return clip.positions[first:, index], clip.rotations[first:, index]

    # AMC and BVH round to 6 significant digits, offsets to 1e-5: over a chain of six bones of
    # up to 8 units that leaves a few 1e-5 units (measured: 9e-5 at most), 1 unit being 5.6 cm.
    for asf_name, bvh_name in SAME.items():
        (place, turn), (other, other_turn) = at(one, asf_name), at(two, bvh_name, 1)
        np.testing.assert_allclose(place, other, atol=2e-4, err_msg=asf_name)
        np.testing.assert_allclose(turn, other_turn, atol=2e-5, err_msg=asf_name)
    # The BVH conversion leaves out the thorax: neck and shoulders sit at its start, 12 cm low.
    turn = at(one, "thorax")[1]
    lost = turn @ one.rest_offsets[one.joints.index("lowerneck")]
    assert np.linalg.norm(lost[0]) > 2.0
    for asf_name, bvh_name in ABOVE.items():
        (place, turn), (other, other_turn) = at(one, asf_name), at(two, bvh_name, 1)
        np.testing.assert_allclose(place - lost, other, atol=2e-4, err_msg=asf_name)
        np.testing.assert_allclose(turn, other_turn, atol=2e-5, err_msg=asf_name)
