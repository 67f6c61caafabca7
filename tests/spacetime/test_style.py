"""A style is 147 numbers with names and units, which survive their file or are refused."""

import json
import re

import numpy as np
import pytest

from motionstyle.dynamics.passive import PassiveParameters, passive_forces
from motionstyle.errors import MotionStyleError
from motionstyle.spacetime.style import (
    Style,
    initial_style,
    load_style,
    parameter_names,
    save_style,
)


@pytest.fixture
def style():
    numbers = np.random.default_rng(5).uniform(0.1, 9, 147)
    empty = Style(np.zeros(29), PassiveParameters(*np.zeros((4, 29))))
    found = empty.with_vector(numbers)
    return Style(found.preferences, found.passive, 2e4, 0.03, {"clip": "walk", "status": "made up"})


def test_there_are_147_parameters_each_with_its_own_name(style):
    names = parameter_names()
    assert len(names) == len(set(names)) == len(style.vector()) == 147
    assert names[0] == "preference.hip_flexion_r"
    assert names[-2:] == ["shoe_stiffness", "shoe_rest_length"]
    at = names.index("damping.knee_flexion_l")
    assert style.vector()[at] == style.passive.damping[names.index("preference.knee_flexion_l")]


def test_a_vector_makes_the_style_it_came_from(style):
    again = style.with_vector(style.vector())
    np.testing.assert_array_equal(again.vector(), style.vector())
    assert again.about == style.about


def test_a_file_gives_back_every_bit(style, tmp_path):
    save_style(tmp_path / "style.json", style)
    again = load_style(tmp_path / "style.json")
    np.testing.assert_array_equal(again.vector(), style.vector())
    assert again.about == style.about
    content = json.loads((tmp_path / "style.json").read_text())
    assert content["parameters"]["stiffness_above.knee_flexion_l"]["unit"] == "N m/rad"


def spoilt(style, folder, spoil):
    """The path of the style's file after `spoil` has changed its content."""
    path = folder / "spoilt.json"
    save_style(path, style)
    content = json.loads(path.read_text())
    spoil(content)
    path.write_text(json.dumps(content))
    return path


@pytest.mark.parametrize(
    ("name", "entry", "message"),
    [
        ("damping.tail", 1.0, "damping.tail is unknown"),
        ("rest_angle.knee_flexion_r", {"value": 4.0, "unit": "deg"}, " is in deg, expected rad"),
        ("shoe_stiffness", {"value": "firm", "unit": "N/m"}, " is 'firm', not a number"),
        ("shoe_stiffness", {"value": float("nan"), "unit": "N/m"}, " is nan, not a number"),
        ("shoe_stiffness", {"unit": "N/m"}, " is None, not a number"),
        ("damping.knee_flexion_r", None, " is None, not a number"),
        ("preference.knee_flexion_r", -0.1, " is -0.1, must not be negative"),
    ],
)
def test_a_faulty_parameter_is_refused_by_name(style, tmp_path, name, entry, message):
    message = message if message.startswith(name) else name + message
    with pytest.raises(MotionStyleError, match=re.escape(f"spoilt.json: {message}")):
        load_style(spoilt(style, tmp_path, lambda c: c["parameters"].__setitem__(name, entry)))


def test_a_missing_parameter_and_another_schema_are_refused(style, tmp_path):
    with pytest.raises(MotionStyleError, match=r"spoilt.json: damping.knee_flexion_r is missing"):
        load_style(spoilt(style, tmp_path, lambda c: c["parameters"].pop("damping.knee_flexion_r")))
    with pytest.raises(MotionStyleError, match=r"spoilt.json: style schema 7, expected 1"):
        load_style(spoilt(style, tmp_path, lambda c: c.__setitem__("schema", 7)))


def test_a_negative_rest_angle_is_fine(style, tmp_path):
    numbers = style.vector()
    numbers[parameter_names().index("rest_angle.knee_flexion_r")] = -0.2
    save_style(tmp_path / "s.json", style.with_vector(numbers))
    np.testing.assert_array_equal(load_style(tmp_path / "s.json").vector(), numbers)


def test_the_first_style_takes_springs_from_the_forces_they_explain():
    rng = np.random.default_rng(6)
    angles, rates = rng.standard_normal((2, 60, 29)) * 0.3
    angles -= angles.mean(axis=0)
    true = PassiveParameters(*rng.uniform(10, 40, (2, 29)), rng.uniform(1, 5, 29), np.zeros(29))
    style = initial_style(angles, rates, passive_forces(true, angles, rates), (3e4, 0.01))
    assert style.preferences.sum() == pytest.approx(1)
    np.testing.assert_allclose(style.passive.stiffness_above, true.stiffness_above, rtol=1e-5)
    np.testing.assert_allclose(style.passive.damping, true.damping, rtol=1e-5)
    assert (style.shoe_stiffness, style.shoe_rest_length) == (3e4, 0.01)
