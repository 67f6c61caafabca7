"""Edits as data: masses against brute force, ranges, shoes, ground, and other bodies."""

from __future__ import annotations

import numpy as np
import pytest

from motionstyle.body.layout import COORDINATE_INDEX, NODE_INDEX
from motionstyle.body.ranges import joint_ranges
from motionstyle.errors import MotionStyleError
from motionstyle.spacetime.captured_footprints import footprints_of
from motionstyle.spacetime.edits import (
    SUITCASE,
    Edits,
    Load,
    edit_body,
    edit_constraints,
    edit_ranges,
    edit_shoes,
    into_ranges,
)
from motionstyle.spacetime.footprint_constraints import to_constraints


def point_masses(mass, com, inertia):
    """Six point masses (6), (6, 3) with this mass, centre of mass and inertia."""
    moments, axes = np.linalg.eigh(inertia)
    spread = moments.sum() / 2 - moments
    arms = np.sqrt(3 * spread / mass) * axes
    places = np.concatenate([com + arms.T, com - arms.T])
    return np.full(6, mass / 6), places


def summed(masses, places):
    """Mass, centre of mass and inertia about it, by adding up points."""
    com = masses @ places / masses.sum()
    inertia = np.zeros((3, 3))
    for m, p in zip(masses, places - com, strict=True):
        inertia += m * ((p @ p) * np.eye(3) - np.outer(p, p))
    return masses.sum(), com, inertia


def test_a_suitcase_is_3_kg_25_cm_below_the_right_wrist(plain_body):
    body = edit_body(plain_body, Edits(loads=(SUITCASE,)))
    i = NODE_INDEX["hand_r"]
    masses, places = point_masses(plain_body.masses[i], plain_body.coms[i], plain_body.inertias[i])
    mass, com, inertia = summed(np.append(masses, 3.0), np.vstack([places, [0, -0.25, 0]]))
    assert body.masses[i] == pytest.approx(mass)
    assert body.coms[i] == pytest.approx(com)
    assert body.inertias[i] == pytest.approx(inertia, abs=1e-12)
    assert body.mass == pytest.approx(plain_body.mass + 3)
    others = np.arange(18) != i
    assert (body.masses[others] == plain_body.masses[others]).all()
    assert (body.inertias[others] == plain_body.inertias[others]).all()
    assert "edited" in body.mass_source


def test_two_loads_add_up_whatever_their_order(plain_body):
    loads = (Load("thorax", 5.0, (-0.1, 0.1, 0.0)), Load("thorax", 2.0, (0.2, 0.0, 0.1)))
    a, b = (edit_body(plain_body, Edits(loads=order)) for order in (loads, loads[::-1]))
    assert a.inertias == pytest.approx(b.inertias)
    assert a.coms == pytest.approx(b.coms)


def test_no_edits_change_nothing(plain_body, plain_motion):
    assert edit_body(plain_body, Edits()) is plain_body
    feet = to_constraints(footprints_of(plain_motion), plain_body, plain_motion.frames, 120.0)
    assert edit_constraints(feet, Edits()) is feet
    assert edit_shoes(2e4, 0.01, Edits()) == (2e4, 0.01)


def test_another_body_keeps_its_shape(plain_body):
    body = edit_body(plain_body, Edits(length_scale=0.8, mass_scale=0.5))
    assert body.leg_length == pytest.approx(0.8 * plain_body.leg_length)
    assert body.mass == pytest.approx(0.5 * plain_body.mass)
    assert body.inertias == pytest.approx(0.5 * 0.64 * plain_body.inertias)
    assert body.geometry.contact_points == pytest.approx(0.8 * plain_body.geometry.contact_points)


@pytest.mark.parametrize(
    "load", [Load("hand_r", -5.0, (0, 0, 0)), Load("toes_l", -100.0, (0, 0, 0))]
)
def test_no_node_may_be_left_without_mass(plain_body, load):
    with pytest.raises(MotionStyleError, match=f"{load.node} is left with -.*must be positive"):
        edit_body(plain_body, Edits(loads=(load,)))


def test_zero_mass_is_refused():
    with pytest.raises(MotionStyleError, match=r"mass_scale is 0.0; it must be a factor above 0"):
        Edits(mass_scale=0.0)


def test_limp_locks_the_knee_and_halves_the_hip(plain_motion):
    edits = Edits(locked={"knee_flexion_l": 5.0}, narrowed={"hip_flexion_l": 0.5})
    ranges = edit_ranges(plain_motion, edits)
    knee, hip = COORDINATE_INDEX["knee_flexion_l"], COORDINATE_INDEX["hip_flexion_l"]
    assert np.degrees(ranges[knee]) == pytest.approx([4.5, 5.5])
    own = np.degrees(plain_motion.coordinates[:, hip])
    assert np.degrees(np.ptp(ranges[hip])) == pytest.approx(np.ptp(own) / 2)
    assert np.degrees(ranges[hip].mean()) == pytest.approx((own.max() + own.min()) / 2)
    free = [k for k in range(6, 35) if k not in (knee, hip)]
    usual = joint_ranges()
    assert (ranges[free, 0] <= usual[free, 0]).all()
    assert (ranges[free, 1] >= usual[free, 1]).all()
    assert np.isinf(ranges[:6]).all()
    inside = into_ranges(plain_motion.coordinates, ranges)
    assert (inside >= ranges[:, 0]).all()
    assert (inside <= ranges[:, 1]).all()


def test_ranges_take_in_what_the_example_does(plain_motion):
    low, high = edit_ranges(plain_motion, Edits()).T
    assert (plain_motion.coordinates >= low).all()
    assert (plain_motion.coordinates <= high).all()


def test_shoes_and_ground(plain_motion):
    edits = Edits(shoe_stiffness=0.5, shoe_rest_length=2.0, friction=0.1)
    assert edit_shoes(2e4, 0.01, edits) == (1e4, 0.02)
    feet = to_constraints(footprints_of(plain_motion), plain_motion.body, 241, 120.0)
    assert (edit_constraints(feet, edits).friction == 0.1).all()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"locked": {"knee_flex_l": 5}},
            "'knee_flex_l' is not a joint .*did you mean knee_fle",
        ),
        ({"narrowed": {"pelvis_ty": 0.5}}, "'pelvis_ty' is not a joint coordinate"),
        ({"narrowed": {"hip_flexion_l": 0}}, "narrow hip_flexion_l is 0"),
        ({"loads": (Load("hand", 3, (0, 0, 0)),)}, "'hand' is not a node .*did you mean hand_"),
        ({"loads": (Load("hand_r", np.nan, (0, 0, 0)),)}, "values not finite"),
        ({"friction": -0.1}, "friction is -0.1; it must not be negative"),
        ({"shoe_stiffness": -1}, "shoe_stiffness is -1"),
    ],
)
def test_edits_that_make_no_sense_are_refused(values, message):
    with pytest.raises(MotionStyleError, match=message):
        Edits(**values)
