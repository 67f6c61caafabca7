"""Gait numbers on a synthetic walk whose steps, times and angles are known by construction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motionstyle.body.kinematics import contact_points
from motionstyle.body.layout import (
    CONTACT_POINTS,
    COORDINATE_INDEX,
    COORDINATES,
    NODE_INDEX,
)
from motionstyle.evaluation import gait
from motionstyle.motion.motion import Motion
from synthetic_walk import RATE, SPEED, STEP, STRIDE, WIDTH, ankle_path, make_walk


@pytest.fixture(scope="module")
def walk() -> Motion:
    return make_walk()


def test_the_synthetic_walk_stands_where_it_says(walk):
    points = contact_points(walk.body, walk.pose())
    heights = points[..., 1][walk.contacts]
    assert np.abs(heights).max() < 1e-9


def test_stances_join_the_points_of_a_foot_and_stand_at_the_heel(walk):
    stances = gait.foot_stances(walk)
    assert [(s.side, s.first, s.last) for s in stances[:4]] == [
        ("l", 0, 39),
        ("r", 30, 89),
        ("l", 80, 139),
        ("r", 130, 189),
    ]
    ankle = ankle_path(np.array([35]), 30)[0, 0]
    np.testing.assert_allclose(stances[1].place, [ankle - 0.06, 0.0, WIDTH / 2], atol=1e-9)


def test_a_stance_on_the_forefoot_stands_where_its_heel_would(walk):
    contacts = walk.contacts.copy()
    contacts[:, [k for k, name in enumerate(CONTACT_POINTS) if name.startswith("heel")]] = False
    forefoot = replace(walk, contacts=contacts)
    for flat, raised in zip(gait.foot_stances(walk), gait.foot_stances(forefoot), strict=True):
        np.testing.assert_allclose(raised.place, flat.place, atol=1e-9)
    assert gait.foot_strikes(forefoot, "r") == [30, 130, 230, 330]


@pytest.mark.parametrize("heading", [0.0, 0.7, -2.5])
def test_steps_speed_and_cadence_whatever_the_heading(heading):
    walk = make_walk(heading=heading)
    np.testing.assert_allclose(gait.step_lengths(walk), STEP, atol=1e-6)
    np.testing.assert_allclose(gait.step_widths(walk), WIDTH, atol=1e-6)
    assert gait.mean_speed(walk) == pytest.approx(SPEED, rel=1e-6)
    assert gait.cadence(walk) == pytest.approx(120.0)
    assert gait.speed_error_pct(walk) == pytest.approx(0.0, abs=1e-4)


def test_sway_does_not_lengthen_the_path(walk):
    q = walk.coordinates.copy()
    q[:, 2] += 0.04 * np.sin(2 * np.pi * np.arange(walk.frames) / STRIDE)
    swaying = replace(walk, coordinates=q)
    raw = np.linalg.norm(np.diff(q[:, [0, 2]], axis=0), axis=1).sum() * RATE / (walk.frames - 1)
    assert raw > 1.005 * SPEED
    assert gait.mean_speed(swaying) == pytest.approx(SPEED, rel=0.002)


def test_feet_that_run_ahead_of_the_body_show_in_the_speed_error(walk):
    q = walk.coordinates.copy()
    ahead = 0.05 * np.arange(walk.frames) / STRIDE  # rad: 5 hundredths more every stride
    for side in "rl":
        q[:, COORDINATE_INDEX[f"hip_flexion_{side}"]] += ahead
    error = gait.speed_error_pct(replace(walk, coordinates=q))
    hip_to_floor = 0.77
    assert error == pytest.approx(100 * 0.05 * hip_to_floor / (2 * STEP), abs=0.5)


def test_speed_is_not_compared_where_a_step_is_missing(walk):
    contacts = walk.contacts.copy()
    contacts[170:250, [k for k, n in enumerate(CONTACT_POINTS) if n.endswith("_l")]] = False
    assert np.isnan(gait.speed_error_pct(replace(walk, contacts=contacts)))


def test_sliding_feet_slip_and_standing_feet_do_not(walk):
    q = walk.coordinates.copy()
    q[:, 0] *= 1.1
    assert gait.foot_slip_mm(replace(walk, coordinates=q)) > 10
    assert gait.foot_slip_mm(walk) < 1e-6


def test_stance_and_double_support(walk):
    assert gait.stance_fraction(walk) == pytest.approx(0.60)
    assert gait.double_support(walk) == pytest.approx(0.20)


def test_cycles_run_from_heel_strike_to_heel_strike_and_none_is_made_up(walk):
    assert gait.gait_cycles(walk, "r") == [(30, 130), (130, 230), (230, 330)]
    assert gait.gait_cycles(walk, "l") == [(80, 180), (180, 280), (280, 380)]
    # from the middle of a right stance: its beginning is not a strike
    cut = walk.window(50, 250)
    assert gait.foot_strikes(cut, "r") == [80, 180]
    assert gait.gait_cycles(cut, "r") == [(80, 180)]


def test_the_strike_is_the_heels_even_if_the_toe_is_first(walk):
    contacts = walk.contacts.copy()
    contacts[130:134, CONTACT_POINTS.index("heel_r")] = False
    assert gait.foot_strikes(replace(walk, contacts=contacts), "r") == [30, 134, 230, 330]


def test_nothing_is_known_of_a_motion_that_never_touches_the_ground(walk):
    flying = replace(walk, contacts=np.zeros_like(walk.contacts))
    assert gait.foot_stances(flying) == []
    assert len(gait.step_lengths(flying)) == len(gait.step_widths(flying)) == 0
    for number in (
        gait.cadence,
        gait.stance_fraction,
        gait.double_support,
        gait.speed_error_pct,
        gait.foot_slip_mm,
    ):
        assert np.isnan(number(flying)), number.__name__
    assert gait.mean_speed(flying) == pytest.approx(SPEED, rel=1e-6)


def test_landing_on_both_feet_at_once_gives_no_cadence(walk):
    contacts = np.zeros_like(walk.contacts)
    contacts[50:90] = True
    assert np.isnan(gait.cadence(replace(walk, contacts=contacts)))


def test_slip_is_the_rms_distance_from_the_mean_place(walk):
    q = walk.coordinates.copy()
    contacts = np.zeros_like(walk.contacts)
    contacts[40:60, CONTACT_POINTS.index("heel_r")] = True
    q[:] = q[0]
    q[40:60, 0] += 0.001 * np.arange(20)
    expected = np.std(np.arange(20))
    assert gait.foot_slip_mm(replace(walk, coordinates=q, contacts=contacts)) == pytest.approx(
        expected
    )


def test_penetration_is_measured_from_the_floor_or_from_a_raised_contact(walk):
    def raised(by: float) -> Motion:
        q = walk.coordinates.copy()
        q[:, 1] += by
        return replace(walk, coordinates=q)

    assert gait.penetration_mm(walk) == pytest.approx(0.0, abs=1e-6)
    assert gait.penetration_mm(raised(-0.012)) == pytest.approx(12.0)
    assert gait.penetration_mm(raised(0.3)) == pytest.approx(0.0, abs=1e-6)
    q = raised(0.3).coordinates
    q[60, 1] -= 0.02
    assert gait.penetration_mm(replace(walk, coordinates=q)) == pytest.approx(20.0)


def test_angles_have_the_clinical_signs(walk):
    q = np.zeros((30, len(COORDINATES)))
    q[:, 0] = np.arange(30) * 0.05
    for name, degrees in (
        ("hip_flexion_r", 30),
        ("knee_flexion_r", 50),
        ("ankle_dorsiflexion_l", -20),
        ("pelvis_rz", -15),
    ):
        q[:, COORDINATE_INDEX[name]] = np.radians(degrees)
    motion = replace(
        walk, coordinates=q, contacts=walk.contacts[:30], contact_normals=walk.contact_normals[:30]
    )
    angles = gait.clinical_angles(motion)
    expected = {
        "hip_flexion_r": 30,
        "hip_flexion_l": 0,
        "knee_flexion_r": 50,
        "ankle_dorsiflexion_l": -20,
        "trunk_lean": 15,
    }
    for name, value in expected.items():
        np.testing.assert_allclose(angles[name], value, atol=1e-9, err_msg=name)
    knee = motion.pose().positions
    ahead = knee[0, NODE_INDEX["foot_r"], 0] - knee[0, NODE_INDEX["shank_r"], 0]
    assert ahead < 0  # a flexed knee carries the ankle backward


def test_hip_flexion_is_the_first_cardan_angle_not_a_component_of_the_exponential_map(walk):
    from scipy.spatial.transform import Rotation

    turned = Rotation.from_euler("ZXY", [40, -12, 20], degrees=True).as_rotvec()
    q = np.zeros((30, len(COORDINATES)))
    q[:, COORDINATE_INDEX["hip_flexion_r"]] = turned[2]
    q[:, COORDINATE_INDEX["hip_adduction_r"]] = turned[0]
    q[:, COORDINATE_INDEX["hip_rotation_r"]] = turned[1]
    motion = replace(
        walk, coordinates=q, contacts=walk.contacts[:30], contact_normals=walk.contact_normals[:30]
    )
    np.testing.assert_allclose(gait.clinical_angles(motion)["hip_flexion_r"], 40, atol=1e-9)
    assert abs(np.degrees(turned[2]) - 40) > 0.5


def test_cycles_are_stretched_to_percent():
    signal = np.arange(50.0)
    rows = gait.normalised_cycles(signal, [(10, 20), (20, 45)], 101)
    assert rows.shape == (2, 101)
    np.testing.assert_allclose(rows[:, [0, 50, 100]], [[10, 15, 20], [20, 32.5, 45]])
    assert gait.normalised_cycles(signal, []).shape == (0, 101)


def test_both_legs_of_a_symmetric_walk_have_the_same_cycle(walk):
    knee = gait.joint_cycles(walk, "knee_flexion")
    assert knee.shape == (6, 101)
    np.testing.assert_allclose(knee, np.broadcast_to(knee[0], knee.shape), atol=1e-6)
    assert np.ptp(knee[0]) > 10
