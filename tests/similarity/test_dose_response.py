"""Dose and response on made-up doses: what the models see moves the score, nothing else does."""

from dataclasses import replace

import numpy as np
import pytest

from motionstyle.body.layout import COORDINATE_INDEX
from motionstyle.similarity.bank import build_bank
from motionstyle.similarity.dose import dose_rows


def planted(walk, name, series, dose, lean_deg=0.0):
    q = walk.coordinates.copy()
    q[:, COORDINATE_INDEX["abdomen_flexion"]] += np.radians(lean_deg)
    known = {
        "dataset": "embedded",
        "style": name.rsplit("-", 1)[0],
        "planted": True,
        "truth": {"series": series, "dose": dose},
    }
    return replace(
        walk, id=name, kind="planted", coordinates=q, provenance={**walk.provenance, **known}
    )


@pytest.fixture(scope="module")
def dosed(walks, rules):
    """Two takes of an unchanged walk, of four leans far beyond the training's, and styled takes."""
    made = []
    for take, base in ((1, walks[6]), (2, walks[7])):
        made.append(planted(base, f"dose0-take{take}", "dose0", 0.0))
        made += [
            planted(base, f"lean-{d}-take{take}", "walk-posture", float(d), 2.0 * d)
            for d in (10, 20, 30, 40)
        ]
    made += [
        planted(w, f"style{k // 2}-take{k % 2 + 1}", "styles", None) for k, w in enumerate(walks)
    ]
    return build_bank(made, rules, ["walk"])[0]


def test_leakage_grows_and_the_score_falls_with_a_planted_lean(dosed, settings):
    rows, points = dose_rows(dosed, settings, "test")
    found = {(r["set"], r["score"]): r["rank_correlation"] for r in rows}
    assert found["whole_body", "leakage"] >= 0.8
    assert found["whole_body", "one_class_svm"] <= -0.8
    assert {p["dose"] for p in points} == {0.0, 10.0, 20.0, 30.0, 40.0}


def test_legs_are_controls_where_only_the_trunk_changes(dosed, settings):
    rows, points = dose_rows(dosed, settings, "test")
    assert {r["score"] for r in rows if r["set"] == "left_leg"} == {
        "leakage_control",
        "one_class_svm_control",
    }
    for take in ("take1", "take2"):
        values = {
            p["relative_leakage"]
            for p in points
            if p["set"] == "left_leg" and f"dose0-{take}" in p["pair"] and p["dose"] > 0
        }
        assert np.ptp(list(values)) < 1e-12


def test_doses_without_an_unchanged_motion_are_rows_with_the_reason(dosed, settings):
    kept = tuple(replace(c, series="other") if c.series == "dose0" else c for c in dosed.clips)
    rows, points = dose_rows(replace(dosed, clips=kept), settings, "test")
    assert points == []
    assert {r["status"] for r in rows} == {"n/a"}
    assert all("no unchanged motion of action walk" in r["reason"] for r in rows)


def test_a_bank_without_doses_has_no_rows(bank, settings):
    assert dose_rows(bank, settings, "test") == ([], [])
