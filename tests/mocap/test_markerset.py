"""Marker sets: the shipped ones, faults in them, and clips that do not fit them or any person."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from marker_person import SET, synthetic_markers, write_set
from motionstyle.errors import MotionStyleError
from motionstyle.mocap.formats.c3d import read_c3d
from motionstyle.mocap.formats.marker_clip import scaled, upright
from motionstyle.mocap.formats.trc import read_trc
from motionstyle.mocap.markers.checks import check_clip_of_person, check_sides, check_size
from motionstyle.mocap.markers.markerset import LANDMARKS, assign_labels, read_marker_set

MIRROR = Path(__file__).parents[3] / "shared" / "mocap"
SETS = Path(__file__).parents[2] / "config" / "markersets"
FILES = {
    "rajagopal": ("opensim/rajagopal", "*.trc"),
    "gait2354": ("opensim/gait2354", "*.trc"),
    "addb": ("nimble/addb-gait7-stairs", "*.trc"),
    "opencap": ("nimble", "opencap-*/*.trc"),
    "camargo": ("nimble/camargo", "*.trc"),
    "pycgm": ("pycgm", "*.c3d"),
    "bmc": ("bmc", "*.c3d"),
    "cmu41": ("cmu/c3d", "*.c3d"),
}


@pytest.fixture
def lab(tmp_path):
    return read_marker_set(write_set(tmp_path), "lab")


@pytest.fixture
def clip(plain_body, standing):
    return synthetic_markers(plain_body, np.tile(standing, (10, 1)), 100.0)


@pytest.mark.parametrize("name", sorted(p.stem for p in SETS.glob("*.yaml")))
def test_the_shipped_sets_are_sound(name):
    markers = read_marker_set(SETS, name)
    assert name in FILES
    assert {"asis_r", "asis_l", "heel_r", "heel_l"} <= set(markers.landmarks)
    for landmark in markers.landmarks:  # what is on the right is on the left
        if landmark[-2:] in {"_r", "_l"}:
            assert landmark[:-1] + ("l" if landmark[-1] == "r" else "r") in markers.landmarks


@pytest.mark.mirror
@pytest.mark.skipif(not MIRROR.is_dir(), reason="no mirror folder")
@pytest.mark.parametrize("name", sorted(FILES))
def test_the_mirrors_files_fit_their_sets_and_are_of_persons(name):
    folder, pattern = FILES[name]
    markers = read_marker_set(SETS, name)
    files = sorted((MIRROR / folder).glob(pattern))
    assert files
    for file in files:
        found = (read_trc if file.suffix == ".trc" else read_c3d)(file)
        found = upright(found, markers.up_axis)
        check_clip_of_person(found, assign_labels(found, markers))


def test_an_unknown_set_has_near_matches():
    with pytest.raises(MotionStyleError, match="did you mean rajagopal"):
        read_marker_set(SETS, "rajagopol")


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"landmark": {}}, ["unknown key 'landmark'", "did you mean landmarks"]),
        ({"landmarks": {"heel_right": "A"}}, ["unknown landmark 'heel_right'"]),
        ({"landmarks": {"asys_r": "A"}}, ["unknown landmark 'asys_r'", "did you mean asis_r"]),
        ({"tracking": {"tigh_r": ["A"]}}, ["unknown node 'tigh_r'", "did you mean thigh_r"]),
        ({"tracking": {"thigh_r": ["M_c7"]}}, ["label 'M_c7' stands there 2 times"]),
        ({"up_axis": "x"}, ["up_axis is 'x'"]),
        ({"landmarks": ["heel_r"]}, ["landmarks must be a mapping"]),
        ({"forces": {"files": "*"}}, ["forces must be a list"]),
        ({"forces": [{"plates": {"1": "rigt"}}]}, ["foot 'rigt'", "did you mean right"]),
        ({"forces": [{"plates": {"1": "left"}, "unit": "ft"}]}, ["unit 'ft'"]),
    ],
)
def test_faults_of_a_set_are_named(tmp_path, changes, expected):
    with pytest.raises(MotionStyleError) as caught:
        read_marker_set(write_set(tmp_path, **changes), "lab")
    assert all(part in str(caught.value) for part in ["lab.yaml", *expected]), str(caught.value)


def test_a_whole_clip_is_assigned(lab, clip):
    assigned = assign_labels(clip, lab)
    assert assigned.landmarks["asis_r"] == "M_asis_r"
    assert assigned.nodes["M_thigh0_l"] == "thigh_l"
    assert set(assigned.nodes) == set(clip.labels)
    check_clip_of_person(clip, assigned)


def test_the_first_label_there_is_stands_for_a_landmark(tmp_path, clip):
    landmarks = {**SET["landmarks"], "c7": ["Neck", "M_c7"]}
    markers = read_marker_set(write_set(tmp_path, landmarks=landmarks), "lab")
    assert assign_labels(clip, markers).landmarks["c7"] == "M_c7"


def test_unknown_markers_are_named_with_near_matches(lab, clip):
    labels = tuple(n.replace("M_c7", "M_c77").replace("M_t10", "Q") for n in clip.labels)
    with pytest.raises(MotionStyleError) as caught:
        assign_labels(replace(clip, labels=labels), lab)
    message = str(caught.value)
    assert "unknown marker 'M_c77' (did you mean M_c7" in message
    assert "unknown marker 'Q'" in message
    assert "'lab'" in message


def test_patterns_of_ignored_markers_are_passed_over(tmp_path, clip):
    markers = read_marker_set(write_set(tmp_path, ignored=["*HJC*"]), "lab")
    labels = tuple(n.replace("M_t10", "R_HJC_reg") for n in clip.labels)
    assert "R_HJC_reg" not in assign_labels(replace(clip, labels=labels), markers).nodes


def test_missing_and_never_seen_markers_are_named_together(lab, plain_body, standing):
    clip = synthetic_markers(
        plain_body, np.tile(standing, (10, 1)), 100.0, without=("asis_r", "heel_l")
    )
    positions = np.array(clip.positions)
    positions[:, clip.labels.index("M_heel_r")] = np.nan
    with pytest.raises(MotionStyleError) as caught:
        assign_labels(replace(clip, positions=positions), lab)
    message = str(caught.value)
    assert "needed marker 'M_asis_r' (asis_r) is missing" in message
    assert "needed marker 'M_heel_l' (heel_l) is missing" in message
    assert "needed marker 'M_heel_r' (heel_r) is never seen in 10 frames" in message


def swapped(clip, *names):
    order = list(clip.labels)
    for name in names:
        one, two = order.index(f"M_{name}_r"), order.index(f"M_{name}_l")
        order[one], order[two] = order[two], order[one]
    return replace(clip, labels=tuple(order))


def test_swapped_sides_are_refused(lab, clip):
    both = [n[:-2] for n in (x.removeprefix("M_") for x in clip.labels) if n.endswith("_r")]
    for names in (both, ["asis"], ["heel"], ["knee_lateral", "acromion"]):
        wrong = swapped(clip, *names)
        with pytest.raises(MotionStyleError, match="right and left are swapped") as caught:
            check_sides(wrong, assign_labels(wrong, lab))
        for name in names:
            if name in LANDMARKS or f"{name}_r" in LANDMARKS:
                assert f"'M_{name}_r' lies" in str(caught.value)


def exchanged(clip, one, two):
    """Exchange two kinds of markers on both sides."""
    order = list(clip.labels)
    for side in "rl":
        a, b = order.index(f"M_{one}_{side}"), order.index(f"M_{two}_{side}")
        order[a], order[b] = order[b], order[a]
    return replace(clip, labels=tuple(order))


def test_a_pelvis_back_to_front_is_told_from_swapped_sides(lab, clip):
    wrong = exchanged(clip, "asis", "psis")
    with pytest.raises(
        MotionStyleError, match="both feet point to the back of the pelvis"
    ) as found:
        check_clip_of_person(wrong, assign_labels(wrong, lab))
    assert "'M_asis_r' and 'M_asis_l'" in str(found.value)
    assert "'M_psis_r' and 'M_psis_l'" in str(found.value)


@pytest.mark.parametrize(
    ("factor", "unit", "expected"), [(1e3, "m", "is the unit mm"), (0.01, "cm", "is the unit m?")]
)
def test_wrong_units_are_refused_with_the_unit_that_fits(lab, clip, factor, unit, expected):
    wrong = replace(scaled(clip, factor), unit=unit)
    with pytest.raises(MotionStyleError, match="ASIS markers are") as caught:
        check_size(wrong, assign_labels(wrong, lab))
    assert expected in str(caught.value)


def test_a_wrong_vertical_is_refused(lab, clip):
    lying = replace(clip, positions=clip.positions[..., [0, 2, 1]] * [1, 1, -1])
    with pytest.raises(MotionStyleError, match=r"pelvis is not above the heels.*up_axis"):
        check_clip_of_person(lying, assign_labels(lying, lab))


def test_a_force_file_nobody_describes_is_refused():
    with pytest.raises(MotionStyleError, match=r"describes no force plates.*patterns: grf\*"):
        read_marker_set(SETS, "addb").plates("walk.mot")
