"""Bands, the gait table and the clip table on the synthetic walk."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from motionstyle.body.layout import CONTACT_POINTS, COORDINATE_INDEX
from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.clips import CLIP_COLUMNS, clip_row, failed_clip_row
from motionstyle.evaluation.gait import joint_cycles
from motionstyle.evaluation.normative import (
    BAND_COLUMNS,
    GAIT_COLUMNS,
    band_table,
    gait_row,
    is_level_walk,
    read_normative,
)
from motionstyle.tables import format_cell
from synthetic_walk import make_walk

CONFIG = Path(__file__).parents[2] / "config" / "normative_gait.yaml"


@pytest.fixture(scope="module")
def walk():
    return make_walk()


@pytest.fixture(scope="module")
def normative():
    return read_normative(CONFIG)


def test_the_bands_are_the_published_ones(normative):
    knee = normative.angles["knee_flexion"][75]
    assert (knee.low, knee.midpoint, knee.high) == (55, 64, 72)
    ankle = normative.angles["ankle_dorsiflexion"][50]
    assert (ankle.low, ankle.midpoint, ankle.high) == (9, 14, 19)
    assert sorted(normative.angles["hip_flexion"]) == [0, 25, 50, 75]
    assert normative.acceptance["stance_pct"] == (57, 65)
    assert "Reznick" in normative.source


def test_one_row_per_joint_and_instant_with_the_mean_of_both_legs(walk, normative):
    rows = band_table([walk], normative, "test")
    assert len(rows) == 12
    assert all(tuple(row) == BAND_COLUMNS for row in rows)
    by_key = {(row["joint"], row["cycle_pct"]): row for row in rows}
    row = by_key["knee", 25]
    assert row["mean_deg"] == pytest.approx(joint_cycles(walk, "knee_flexion")[:, 25].mean(), 1e-5)
    assert (row["low_deg"], row["midpoint_deg"], row["high_deg"]) == (1, 11, 21)
    assert row["cycles"] == 6
    for row in rows:
        expected = row["low_deg"] <= row["mean_deg"] <= row["high_deg"]
        assert row["inside_band"] == ("yes" if expected else "no")


def test_an_angle_at_its_midpoint_is_inside_and_one_beyond_its_limit_is_not(walk, normative):
    column = COORDINATE_INDEX["ankle_dorsiflexion_r"], COORDINATE_INDEX["ankle_dorsiflexion_l"]

    def ankle_at(degrees: float) -> str:
        q = walk.coordinates.copy()
        q[:, column] = np.radians(degrees)
        rows = band_table([replace(walk, coordinates=q)], normative, "test")
        keys = {(r["joint"], r["cycle_pct"]): r["inside_band"] for r in rows}
        return keys["ankle", 25]

    assert [ankle_at(a) for a in (8, 13.1, 2.9)] == ["yes", "no", "no"]


def test_a_motion_without_cycles_has_rows_without_means(walk, normative):
    rows = band_table([walk.window(0, 60)], normative, "test")
    assert len(rows) == 12
    assert all(np.isnan(r["mean_deg"]) for r in rows)
    assert {(r["inside_band"], r["cycles"]) for r in rows} == {("", 0)}


def test_the_gait_row_of_the_synthetic_walk(walk, normative):
    row = gait_row(walk, normative, "test")
    assert tuple(row) == GAIT_COLUMNS
    expected = {
        "speed_mps": 1.4,
        "step_length_m": 0.7,
        "cadence_spm": 120,
        "step_width_cm": 10,
        "stance_pct": 60,
        "double_support_pct": 20,
    }
    for name, value in expected.items():
        assert row[name] == pytest.approx(value, rel=1e-5), name
    assert row["speed_error_pct"] == pytest.approx(0, abs=1e-3)
    assert (row["mood"], row["within_bands"], row["cycles"]) == ("neutral", "yes", 6)


def test_a_short_stance_is_outside_the_bands_and_a_still_body_unknown(walk, normative):
    contacts = walk.contacts.copy()
    frames = np.arange(walk.frames)
    for side, strike in (("r", 30), ("l", 80)):
        own = [k for k, n in enumerate(CONTACT_POINTS) if n.endswith(side)]
        contacts[np.ix_((frames - strike) % 100 >= 50, own)] = False
    row = gait_row(replace(walk, contacts=contacts), normative, "test")
    assert row["stance_pct"] == pytest.approx(50)
    assert row["within_bands"] == "no"
    still = gait_row(walk.window(0, 25), normative, "test")
    assert np.isnan(still["stance_pct"])
    assert still["within_bands"] == ""


def test_only_captured_neutral_level_walks_count_as_level_walks(walk, normative):
    assert is_level_walk(walk, normative)
    for change in ({"action": "run"}, {"style": "sad"}, {"surface": "ramp"}):
        assert not is_level_walk(make_walk(60, **change), normative), change
    assert not is_level_walk(replace(walk, kind="planted"), normative)


def test_a_clip_row_holds_numbers_of_motion_and_report(walk):
    report = {
        "marker_rms_cm": 0.5,
        "floor_tilt_deg": 1.25,
        "rebranched_frames": 0,
        "repaired_frames": 2,
        "warnings": "repaired: x",
        "floor_stances": 4,
    }
    row = clip_row(walk, report, "default")
    assert tuple(row) == CLIP_COLUMNS
    assert (row["id"], row["dataset"], row["config"]) == ("walk", "synthetic", "default")
    assert (row["frames"], row["contacts"], row["status"], row["reason"]) == (420, 9, "ok", "")
    assert row["step_length_m"] == pytest.approx(0.7, rel=1e-5)
    assert row["foot_slip_mm"] == pytest.approx(0, abs=1e-6)
    assert row["leg_length_m"] == pytest.approx(0.85)
    assert (row["floor_tilt_deg"], row["repaired_frames"]) == (1.25, 2)


def test_an_unknown_number_is_an_empty_cell(walk):
    row = clip_row(walk.window(0, 25), {}, "default")
    assert [format_cell(row[n]) for n in ("cadence_spm", "marker_rms_cm")] == ["", ""]
    assert format_cell(row["speed_mps"]) == "1.4"


def test_a_failed_clip_is_a_row_with_a_reason():
    sidecar = {"id": "x", "kind": "captured", "provenance": {"dataset": "cmu"}}
    row = failed_clip_row(sidecar, "no such joint", "full")
    assert tuple(row) == CLIP_COLUMNS
    assert {k: v for k, v in row.items() if v != ""} == {
        "id": "x",
        "dataset": "cmu",
        "config": "full",
        "kind": "captured",
        "succeeded": "no",
        "status": "failed",
        "reason": "no such joint",
    }


def test_a_band_out_of_order_is_refused(tmp_path):
    data = yaml.safe_load(CONFIG.read_text(encoding="utf-8"))
    data["angles"]["knee_flexion"][25] = [21, 11, 1]
    path = tmp_path / "bad.yaml"
    path.write_text(yaml.safe_dump(data), encoding="utf-8")
    with pytest.raises(MotionStyleError, match="knee_flexion at 25 %"):
        read_normative(path)
    del data["angles"]["knee_flexion"]
    path.write_text(yaml.safe_dump(data), encoding="utf-8")
    with pytest.raises(MotionStyleError, match="knee_flexion"):
        read_normative(path)
