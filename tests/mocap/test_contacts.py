"""Contacts of foot points whose paths are known, on a level floor and on steps."""

from __future__ import annotations

import numpy as np
import pytest
import yaml
from test_body_fit import SKELETONS, known_gait

from motionstyle.body.kinematics import contact_points, forward_kinematics
from motionstyle.body.layout import CONTACT_POINTS
from motionstyle.mocap.fitting.contacts import detect_contacts, ground_height
from motionstyle.mocap.fitting.floor import StanceThresholds, runs
from motionstyle.mocap.settings import RetargetSettings, by_action

CONFIG = yaml.safe_load((SKELETONS.parent / "config.yaml").read_text())
SETTINGS = RetargetSettings.from_config(CONFIG["retarget"], CONFIG["contacts"])
WALK, RUN = (by_action(SETTINGS.thresholds, action) for action in ("walk", "run"))
RATE = 100.0
COLUMN = {name: i for i, name in enumerate(CONTACT_POINTS)}


def foot_path(rate, bearing, speed_mps=3.0):
    """Points (F, 8, 3) that stand where `bearing` (F,) is true and else travel 15 cm up."""
    travelling = ~bearing
    x = np.cumsum(travelling) * speed_mps / rate
    points = np.zeros((len(bearing), len(CONTACT_POINTS), 3))
    points[..., 0] = x[:, None]
    points[..., 1] = np.where(travelling, 0.15, 0.0)[:, None]
    return points


def at_frames(count, *stretches):
    mask = np.zeros(count, dtype=bool)
    for first, last in stretches:
        mask[first : last + 1] = True
    return mask


@pytest.mark.parametrize("rate", [30.0, 60.0, 120.0])
def test_stances_are_found_to_the_frame(rate):
    bearing = at_frames(round(4 * rate), (round(rate), round(1.6 * rate)), (round(3 * rate), 10**6))
    points = foot_path(rate, bearing)
    found = detect_contacts(points, rate, WALK, np.zeros(points.shape[:2]))
    for column in range(8):
        for (a, b), (c, d) in zip(runs(found[:, column]), runs(bearing), strict=True):
            assert abs(a - c) <= 1  # speeds are central differences
            assert abs(b - d) <= 1


def test_each_point_is_judged_alone_but_the_ball_as_one():
    still = at_frames(200, (50, 150))
    points = foot_path(RATE, still)
    ground = np.zeros(points.shape[:2])
    points[:, COLUMN["heel_r"], 1] += 0.10
    points[:, COLUMN["toe_l"], 1] += 0.10
    points[:, COLUMN["ball_medial_l"], 1] += 0.02
    points[:, COLUMN["ball_lateral_l"], 1] -= 0.02  # inverted: the middle stands at 0
    points[:, COLUMN["ball_medial_r"], 1] += 0.04
    points[:, COLUMN["ball_lateral_r"], 1] += 0.04
    found = detect_contacts(points, RATE, WALK, ground).any(axis=0)
    assert {name for name, i in COLUMN.items() if found[i]} == {
        "toe_r", "heel_l", "ball_medial_l", "ball_lateral_l",
    }  # fmt: skip


def test_level_ground_is_zero_everywhere():
    points = np.random.default_rng(0).normal(size=(30, 8, 3))
    assert not ground_height(points, RATE, WALK, level=True).any()
    assert ground_height(points, RATE, WALK, level=True).shape == (30, 8)


def stairs(rise=0.17):
    """Stand 0.6 s on each of four stairs; 0.6 s of swing between them, 10 cm above the next."""
    n = 60
    heights, stand = [], []
    for step in range(4):
        heights += [step * rise] * n
        stand += [True] * n
        if step < 3:
            s = np.linspace(0, 1, n)
            swing = step * rise + s * rise + 0.25 * np.sin(np.pi * s)
            heights += list(swing)
            stand += [False] * n
    stand = np.array(stand)
    points = foot_path(RATE, stand)
    points[..., 1] = np.array(heights)[:, None]
    return points, stand


def test_ground_under_steps_is_the_step():
    points, stand = stairs()
    ground = ground_height(points, RATE, WALK, level=False)
    first = np.flatnonzero(np.diff(stand.astype(int)) == 1) + 1
    for step, begin in enumerate([0, *first]):
        # whatever swing lies within half a second is higher than this stair, the former one not
        np.testing.assert_allclose(ground[begin + 55 if step else 0, 0], step * 0.17, atol=0.002)
    assert (ground <= points[..., 1] + 1e-12).all()
    found = detect_contacts(points, RATE, WALK, ground)
    for (a, b), (c, d) in zip(runs(found[:, 0]), runs(stand), strict=True):
        assert abs(a - c) <= 3
        assert abs(b - d) <= 3
    flat = detect_contacts(points, RATE, WALK, ground_height(points, RATE, WALK, level=True))
    assert len(runs(flat[:, 0])) == 1  # only the lowest stair is at the level of the floor


def test_going_down_a_foot_stands_on_its_step_until_it_leaves_it():
    """Half a second later the point rests a stair lower; that is not yet its ground."""
    points, stand = stairs()
    down = points[::-1].copy()
    stand = stand[::-1]
    ground = ground_height(down, RATE, WALK, level=False)
    np.testing.assert_allclose(ground[stand], down[..., 1][stand], atol=0.01)
    found = detect_contacts(down, RATE, WALK, ground)
    for (a, b), (c, d) in zip(runs(found[:, 0]), runs(stand), strict=True):
        assert abs(a - c) <= 3
        assert abs(b - d) <= 3


@pytest.mark.parametrize("rate", [60.0, 100.0, 120.0])
def test_strikes_and_lifts_of_a_known_walk(plain_body, rate):
    walk = known_gait(plain_body, rate_hz=rate)
    points = contact_points(plain_body, forward_kinematics(plain_body, walk.coordinates))
    found = detect_contacts(points, rate, WALK, np.zeros(points.shape[:2]))
    assert_stances(walk, found, frames=2)
    # in between, the points bear no less than they do, and beyond it only while within reach
    assert (found | ~walk.contacts)[3:-3].mean() > 0.99
    assert points[..., 1][found].max() <= WALK.leave_height_m


def assert_stances(gait, found, frames):
    """Feet land and leave within some frames of where they do."""
    last = len(found) - 1
    for side in "rl":
        own = [i for name, i in COLUMN.items() if name.endswith(side)]
        stances = runs(found[:, own].any(axis=1))
        truth = runs(gait.contacts[:, own].any(axis=1))
        assert len(stances) == len(truth)
        for (a, b), (c, d) in zip(stances, truth, strict=True):
            assert abs(a - c) <= frames
            assert abs(b - d) <= frames or b == d == last


def known_run(body, rate_hz=100.0):
    return known_gait(
        body, rate_hz=rate_hz, speed=3.0, stride_s=0.7, stance=0.32, pelvis_m=0.82, lift=0.15,
        pitch_deg=(8, 40),
    )  # fmt: skip


@pytest.mark.parametrize("rate", [60.0, 120.0])
def test_a_run_does_not_lose_its_stances(plain_body, rate):
    run = known_run(plain_body, rate)
    points = contact_points(plain_body, forward_kinematics(plain_body, run.coordinates))
    found = detect_contacts(points, rate, RUN, np.zeros(points.shape[:2]))
    # the gates of a run are wide: the foot bears 70 ms too long at worst
    assert_stances(run, found, frames=0.07 * rate)


def test_a_fast_rolling_foot_needs_the_gates_of_a_run():
    """Slipping at 0.5 m/s for 80 ms and bouncing by 35 mm, as a running forefoot does."""
    still = at_frames(200, (100, 108))
    points = foot_path(RATE, still)
    points[100:109, :, 0] += (0.5 / RATE * np.arange(9))[:, None]
    points[100:109, :, 1] = 0.034
    ground = np.zeros(points.shape[:2])
    assert detect_contacts(points, RATE, RUN, ground).any(axis=0).all()
    assert not detect_contacts(points, RATE, WALK, ground).any()


@pytest.mark.parametrize(
    ("action", "expected"),
    [("walk", "W"), ("walk-turn-left", "T"), ("walk-left", "W"), ("run", "D"), ("turn-walk", "D")],
)
def test_values_by_action(action, expected):
    assert by_action({"default": "D", "walk": "W", "walk-turn-left": "T"}, action) == expected


def test_an_actions_thresholds_are_the_default_ones_but_for_those_it_names():
    default = {
        "enter_height_m": 0.025, "leave_height_m": 0.03, "enter_speed_mps": 0.25,
        "leave_speed_mps": 0.8, "shortest_s": 0.07, "gap_s": 0.05,
    }  # fmt: skip
    contacts = {"default": default, "hop": {"leave_speed_mps": 2.0}}
    settings = RetargetSettings.from_config(CONFIG["retarget"], contacts)
    assert settings.thresholds["hop"] == StanceThresholds(0.025, 0.03, 0.25, 2.0, 0.07, 0.05)
    assert by_action(settings.thresholds, "hop-left") == settings.thresholds["hop"]
    assert by_action(settings.thresholds, "run").leave_speed_mps == 0.8
    for name in ("repair", "smallest_tilt_deg", "largest_tilt_deg", "shortest_span_m"):
        assert getattr(settings, name) == CONFIG["retarget"][name]
    assert (
        by_action(settings.cutoff_hz, "walk-turn-left") == CONFIG["retarget"]["cutoff_hz"]["walk"]
    )
