"""Styles set by hand or drawn at random, and styles of other bodies."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from motionstyle.body.layout import JOINT_COORDINATES
from motionstyle.body.ranges import joint_ranges
from motionstyle.dynamics.passive import PassiveParameters
from motionstyle.errors import MotionStyleError
from motionstyle.spacetime.made_styles import Spread, hand_style, random_style
from motionstyle.spacetime.style import JOINTS_29, Style, load_style, save_style
from motionstyle.spacetime.synthesis import style_warning

TABLE = Path(__file__).parents[2] / "config/hand_style.yaml"


@pytest.fixture
def initial():
    """A style as eq. (22) gives it: even preferences, some springs of zero."""
    springs = np.where(np.arange(29) % 3, 40.0, 0.0)
    passive = PassiveParameters(springs, springs[::-1].copy(), np.full(29, 2.0), np.zeros(29))
    return Style(np.full(29, 1 / 29), passive, 1e4, 0.01, {"clip": "walk", "recipe": "initial"})


# --------------------------------------------------------------------------------- set by hand
def test_the_shipped_table_is_a_style_for_any_body(plain_motion, tmp_path):
    style = hand_style(TABLE, plain_motion)
    assert style.preferences.sum() == pytest.approx(1)
    assert style.about["body_mass_kg"] == plain_motion.body.mass
    content = yaml.safe_load(TABLE.read_text(encoding="utf-8"))
    knee = list(JOINTS_29).index("knee_flexion_l")
    wanted = content["joints"]["knee_flexion_*"]
    scale = plain_motion.body.mass / content["reference_mass_kg"]
    assert style.passive.stiffness_above[knee] == pytest.approx(scale * wanted["stiffness"])
    assert style.passive.damping[knee] == pytest.approx(scale * wanted["damping"])
    assert style.passive.rest_angle[knee] == pytest.approx(np.radians(wanted["rest_deg"]))
    low, high = joint_ranges()[JOINT_COORDINATES].T
    assert ((low <= style.passive.rest_angle) & (style.passive.rest_angle <= high)).all()
    save_style(tmp_path / "hand.json", style)
    assert load_style(tmp_path / "hand.json").vector() == pytest.approx(style.vector(), rel=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: c["joints"].pop("head_*"), "no pattern fits joint head_flexion"),
        (lambda c: c["joints"].update(kneecap={}), "joints.kneecap: needs stiffness"),
        (lambda c: c["joints"]["head_*"].update(stiffness=-1), "head_*: stiffness is -1, must not"),
        (lambda c: c["joints"]["head_*"].update(damping="soft"), "damping is 'soft', not a number"),
        (lambda c: c["joints"]["head_*"].update(rest=3), "'rest' is unknown"),
        (lambda c: c.pop("reference_mass_kg"), "needs reference_mass_kg"),
        (lambda c: c.update(reference_mass_kg=0), "reference_mass_kg is 0"),
        (lambda c: c.update(joints=[]), "needs a group `joints`"),
    ],
)
def test_a_faulty_table_is_refused_by_entry(tmp_path, plain_motion, change, message):
    content = yaml.safe_load(TABLE.read_text(encoding="utf-8"))
    change(content)
    path = tmp_path / "mine.yaml"
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(MotionStyleError, match=re.escape(message)) as caught:
        hand_style(path, plain_motion)
    assert str(path) in str(caught.value)


# ------------------------------------------------------------------------------------- at random
def test_a_random_style_is_the_same_for_the_same_seed(initial):
    assert random_style(initial, 3).vector() == pytest.approx(random_style(initial, 3).vector())
    assert np.abs(random_style(initial, 3).vector() - random_style(initial, 4).vector()).max() > 0
    assert random_style(initial, 3).about == {"clip": "walk", "recipe": "twin", "seed": 3}


def test_random_styles_keep_bounds_and_have_the_spread_they_say(initial):
    styles = [random_style(initial, seed) for seed in range(300)]
    low, high = joint_ranges()[JOINT_COORDINATES].T
    for style in styles:
        assert style.preferences.sum() == pytest.approx(1)
        assert (style.preferences > 0).all()
        p = style.passive
        assert ((low <= p.rest_angle) & (p.rest_angle <= high)).all()
        assert 0 < max(p.stiffness_above.max(), p.stiffness_below.max()) <= 500
        assert 0 < p.damping.max() <= 50
    spread = Spread()
    ratios = np.array([np.log(s.preferences / s.preferences[0])[1:] for s in styles])
    assert ratios.std() == pytest.approx(np.sqrt(2) * spread.preference, rel=0.05)
    springs = np.log([s.passive.stiffness_above for s in styles])
    assert springs.std(axis=0).mean() == pytest.approx(spread.stiffness, rel=0.05)
    assert np.exp(springs[:, 0].mean()) == pytest.approx(spread.least_stiffness, rel=0.1)
    assert np.exp(springs[:, 1].mean()) == pytest.approx(40, rel=0.1)


# ------------------------------------------------------------------------- style of another body
def test_a_style_of_another_body_is_told_in_one_sentence(initial, plain_motion):
    mass = plain_motion.body.mass
    fitting = replace(initial, about={"clip": "walk", "body_mass_kg": 1.15 * mass})
    assert style_warning(fitting, plain_motion) == ""
    heavy = replace(initial, about={"clip": "giant", "body_mass_kg": 2 * mass})
    told = style_warning(heavy, plain_motion)
    assert told.startswith("style of giant was made for a body of 146 kg, plain has 73 kg")
    assert "\n" not in told
    assert style_warning(replace(initial, about={}), plain_motion) == ""
    assert style_warning(replace(initial, about={"body_mass_kg": "?"}), plain_motion) == ""
