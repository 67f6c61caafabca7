"""Marker sets: the shipped ones, faults in them, and clips that do not fit them or any person.

`synthetic_markers` and `SET` serve the tests of ingestion too.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from motionstyle.body.body import Body
from motionstyle.body.kinematics import forward_kinematics, points_in_world
from motionstyle.body.layout import CONTACT_POINTS, NODE_INDEX
from motionstyle.errors import MotionStyleError
from motionstyle.mocap.c3d import read_c3d
from motionstyle.mocap.marker_checks import check_clip_of_person, check_sides, check_size
from motionstyle.mocap.marker_clip import MarkerClip, scaled, upright
from motionstyle.mocap.markerset import LANDMARKS, assign_labels, read_marker_set
from motionstyle.mocap.trc import read_trc

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
CLUSTERS = {
    "thigh": [(0.07, -0.12, 0.02), (0.05, -0.20, 0.06), (-0.02, -0.28, 0.07)],
    "shank": [(0.04, -0.10, 0.03), (0.05, -0.20, 0.04), (-0.03, -0.25, 0.05)],
}


def places(body: Body) -> dict[str, tuple[str, np.ndarray]]:
    """Where each landmark and cluster marker sits: node and place on it, m.

    The pelvis' markers lie so that the hip regression gives the body's own hips, the others so
    that joint centres lie midway, as on an ideal subject.
    """
    offsets = body.joint_offsets
    contact = dict(zip(CONTACT_POINTS, body.geometry.contact_points, strict=True))
    width = (offsets[NODE_INDEX["thigh_r"], 2] - 0.0073) / 0.33
    depth, neck = 0.16, offsets[NODE_INDEX["head"]]
    front = np.array([0.24 * depth + 0.0099, 0.30 * width + 0.0109, 0.0])
    found = {
        "c7": ("thorax", np.subtract(neck, [0.05, 0, 0])),
        "clavicle": ("thorax", np.add(neck, [0.06, -0.06, 0])),
        "sternum": ("thorax", np.add(neck, [0.10, -0.20, 0])),
        "t10": ("thorax", np.add(neck, [-0.09, -0.25, 0])),
        "head_top": ("head", np.array([0.0, 0.24, 0.0])),
    }
    for side, sign in (("r", 1.0), ("l", -1.0)):

        def at(node, x, y, z, centre=(0, 0, 0), side=side, sign=sign):
            return (f"{node}_{side}", np.add(centre, [x, y, sign * z]))

        def joint(node, side=side):
            return offsets[NODE_INDEX[f"{node}_{side}"]]

        shoulder = joint("upper_arm")
        span = 2 * abs(shoulder[2])
        ball = joint("toes")
        found |= {
            f"asis_{side}": ("pelvis", np.add(front, [0, 0, sign * width / 2])),
            f"psis_{side}": ("pelvis", np.add(front, [-depth, 0, sign * 0.05])),
            f"knee_lateral_{side}": at("thigh", 0, 0, 0.05, joint("shank")),
            f"knee_medial_{side}": at("thigh", 0, 0, -0.05, joint("shank")),
            f"ankle_lateral_{side}": at("shank", 0, 0, 0.036, joint("foot")),
            f"ankle_medial_{side}": at("shank", 0, 0, -0.036, joint("foot")),
            f"heel_{side}": at("foot", -0.01, 0.03, 0, contact[f"heel_{side}"]),
            f"mtp_lateral_{side}": at("foot", 0, 0, 0.045, ball),
            f"mtp_medial_{side}": at("foot", 0, 0, -0.045, ball),
            f"toe_tip_{side}": at("toes", contact[f"toe_{side}"][0], 0, 0),
            f"acromion_{side}": ("thorax", np.add(shoulder, [0, 0.17 * span, 0])),
            f"elbow_lateral_{side}": at("upper_arm", 0, 0, 0.04, joint("forearm")),
            f"elbow_medial_{side}": at("upper_arm", 0, 0, -0.04, joint("forearm")),
            f"wrist_radius_{side}": at("forearm", 0.025, 0, 0, joint("hand")),
            f"wrist_ulna_{side}": at("forearm", -0.025, 0, 0, joint("hand")),
            f"head_front_{side}": ("head", np.array([0.09, 0.15, sign * 0.07])),
            f"head_back_{side}": ("head", np.array([-0.09, 0.15, sign * 0.07])),
        }
        for node, spots in CLUSTERS.items():
            for k, (x, y, z) in enumerate(spots):
                found[f"{node}{k}_{side}"] = at(node, x, y, z)
    return found


def synthetic_markers(
    body: Body, coordinates: np.ndarray, rate_hz: float, *, without: tuple[str, ...] = ()
) -> MarkerClip:
    """The markers of `places` on a body in known poses, but those whose names begin so."""
    found = {k: v for k, v in places(body).items() if not k.startswith(without or ("?",))}
    nodes = np.array([NODE_INDEX[node] for node, _ in found.values()])
    local = np.array([place for _, place in found.values()])
    world = points_in_world(forward_kinematics(body, coordinates), nodes, local)
    return MarkerClip(tuple(f"M_{name}" for name in found), world, rate_hz, "made.trc")


SET = {
    "landmarks": {name: f"M_{name}" for name in LANDMARKS if name not in {"sacrum"}},
    "tracking": {
        f"{node}_{side}": [f"M_{node}{k}_{side}" for k in range(3)]
        for node in CLUSTERS
        for side in "rl"
    },
    "treadmill": ["belt*"],
    "forces": [
        {
            "files": "*",
            "plates": {
                name: {
                    "foot": name,
                    "force": f"{prefix}ground_force_v",
                    "point": f"{prefix}ground_force_p",
                    "moment": f"{prefix}ground_torque_",
                }
                for name, prefix in (("left", ""), ("right", "1_"))
            },
        }
    ],
}
for _name in ("toe_r", "toe_l", "finger_r", "finger_l"):
    del SET["landmarks"][_name]


def write_set(folder: Path, **changes: object) -> Path:
    """Write `SET` with changed sections as lab.yaml."""
    text = yaml.safe_dump({**SET, **changes})
    (folder / "lab.yaml").write_text(text, encoding="utf-8")
    return folder


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
