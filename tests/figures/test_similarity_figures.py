"""Figures of similarity and adaptation: they say what they show, and draw what is in the tables."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.text import Text

from motionstyle.errors import MotionStyleError
from motionstyle.figures.adaptation import (
    adaptation_strips_figure,
    surface_of,
    triptych_figure,
)
from motionstyle.figures.similarity import (
    discrimination_figure,
    dose_figure,
    features_figure,
    leakage_figure,
    subspaces_figure,
)
from motionstyle.similarity.events import EventRules

SETS = ("whole_body", "left_leg", "right_leg")


def texts(figure):
    return " ".join(text.get_text() for text in figure.findobj(Text))


@pytest.fixture
def walking(plain_motion):
    """The made-up walk with stances of half a second."""
    contacts = np.zeros_like(plain_motion.contacts)
    phase = np.arange(plain_motion.frames) % 120
    contacts[:, :4] = (phase < 70)[:, None]
    contacts[:, 4:] = ((phase + 60) % 120 < 70)[:, None]
    return replace(plain_motion, contacts=contacts)


@pytest.fixture
def adapted(walking):
    surface = {"places_m": [0.5], "rises_m": [0.2], "origin_m": [0, 0], "direction": [1, 0]}
    return replace(walking, id="up", kind="adapted", provenance={"surface": surface})


def test_the_features_figure_names_the_three_centres_and_108_numbers(walking):
    shown = texts(features_figure(walking, EventRules()))
    assert "18 K = 108 numbers a pair" in shown
    assert all(part in shown for part in ("upper body", "left leg", "right leg"))
    with pytest.raises(MotionStyleError, match="no contact events"):
        features_figure(replace(walking, contacts=np.zeros_like(walking.contacts)), EventRules())


def test_the_leakage_figure_shows_all_sets_folds_and_the_papers_point():
    rows = [
        {
            "set": name,
            "size": "paper",
            "folds": "pattern",
            "width": width,
            "relative_width": "0.1" if width == "chosen" else width,
            "status": "ok",
            "mean_relative_leakage": "0.05",
            "mismatched_mean_relative_leakage": "0.3",
            "data": "planted",
        }
        for name in SETS
        for width in ("chosen", "0.1", "1")
    ]
    held_out = {f"{name}.paper.pattern": np.array([0.05, 0.15, 0.3]) for name in SETS}
    figure = leakage_figure(rows, held_out)
    shown = texts(figure)
    assert "planted motions: drawn, not claimed" in shown
    assert shown.count("folds by pattern: mean 0.17, 67% < 0.2") == 3
    assert "paper: about 90 % below 0.2" in shown


def test_subspaces_discrimination_and_doses_draw_their_rows():
    rows = [
        {
            "leg": leg,
            "components": str(n),
            "cumulative_variance_pct": str(99 + n / 175),
            "segments": "12",
            "clips": "3",
            "data": "captured",
        }
        for leg in SETS[1:]
        for n in (15, 60)
    ]
    assert "left leg: 12 segments of 3 clips" in texts(subspaces_figure(rows))
    found = [
        {
            "level": "type",
            "set": n,
            "method": m,
            "auc": "0.9",
            "ci_low": "0.8",
            "ci_high": "0.95",
            "status": "ok",
            "reason": "",
        }
        for n in SETS
        for m in ("one_class_svm", "leakage")
    ]
    found += [
        {
            "level": "subject",
            "set": n,
            "method": "dtw",
            "status": "n/a",
            "reason": "fewer than 3 similar pairs",
        }
        for n in SETS
    ]
    figure = discrimination_figure(found)
    assert "fewer than 3 similar pairs" in texts(figure)
    points = [
        {
            "series": "walk-step",
            "set": n,
            "dose": str(d),
            "relative_leakage": str(d),
            "svm_score": str(-d),
        }
        for n in SETS
        for d in (0.0, 0.1, 0.2)
    ]
    assert "walk-step" in texts(dose_figure(points))
    assert "no planted doses" in texts(dose_figure([]))


def test_the_triptych_and_strips_show_ground_and_verdict(walking, adapted):
    row = {"penetration_cm": "61.8", "relative_leakage": "0.08"}
    rows = dict.fromkeys(("example", "full", "without_style"), row)
    figure = triptych_figure(walking, adapted, adapted, rows, "up")
    assert "the example itself (penetration 61.8 cm, leakage 0.08)" in texts(figure)
    table = [
        {"task": "up", "variant": "full", "solved": "yes", "status": "converged"},
        {"task": "lost", "variant": "full", "solved": "no", "status": "refused"},
    ]
    shown = texts(adaptation_strips_figure({"up": adapted}, table))
    assert "up: solved" in shown
    assert "lost: not solved" in shown
    assert "refused" in shown
    assert surface_of(adapted).height_at(np.array([2.0]))[0] == pytest.approx(0.2)
    with pytest.raises(MotionStyleError, match="names no surface"):
        surface_of(walking)
