"""Distances are pooled by place: sides and laboratories together, kinds apart."""

from pathlib import Path

from motionstyle.evaluation.marker_fit import measured_places, pooled_distances, virtual_place
from motionstyle.mocap.markers.markerset import read_marker_set

SETS = Path(__file__).parents[2] / "config" / "markersets"


def test_virtual_markers_are_named_by_node_and_direction():
    assert virtual_place("upper_arm_l x") == "upper arm, 10 cm ahead"
    assert virtual_place("pelvis centre") == "pelvis, centre"
    assert virtual_place("wrist_r") == "wrist"


def test_laboratories_meet_at_their_landmarks():
    rajagopal, pycgm = (measured_places(read_marker_set(SETS, n)) for n in ("rajagopal", "pycgm"))
    assert rajagopal["R.ASIS"] == rajagopal["LASI"] == pycgm["LASI"] == "asis"
    assert rajagopal["R.TH1"] == "thigh, further"


def test_sides_and_clips_are_pooled_and_failures_passed_over():
    markers = read_marker_set(SETS, "rajagopal")
    found = pooled_distances(
        [
            (
                {"status": "ok", "marker_rms_cm": {"R.ASIS": 1, "L.ASIS": 2, "abdomen x": 9}},
                markers,
            ),
            ({"status": "ok", "marker_rms_cm": {"foot_r centre": 3, "foot_l centre": 4}}, None),
            ({"status": "failed", "reason": "broken"}, None),
        ]
    )
    assert found["measured"] == {"asis": [1.0, 2.0]}
    assert found["virtual"] == {"foot, centre": [3.0, 4.0]}
