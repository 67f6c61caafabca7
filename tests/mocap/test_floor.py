"""Stances by hysteresis, and the plane the feet stand on, where both are known."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from test_body_fit import CMU, clip_of, known_gait

from motionstyle.body.kinematics import contact_points, forward_kinematics
from motionstyle.body.layout import CONTACT_POINTS, NODE_INDEX
from motionstyle.body.rotations import exponential
from motionstyle.mocap.fitting import floor
from motionstyle.mocap.fitting.floor import FloorFit, StanceThresholds, fit_floor, hysteresis, runs
from motionstyle.mocap.skeletons import faults

RULES = StanceThresholds(
    enter_height_m=0.02,
    leave_height_m=0.04,
    enter_speed_mps=0.2,
    leave_speed_mps=0.6,
    shortest_s=0.05,
    gap_s=0.03,
)
RATE = 100.0
BALLS = [CONTACT_POINTS.index(f"ball_medial_{side}") for side in "rl"]


def text(mask):
    return "".join(".#"[int(one)] for one in mask)


def bearing(heights_cm, speeds=None, rules=RULES):
    heights = np.array(heights_cm) / 100
    speeds = np.zeros(len(heights)) if speeds is None else np.array(speeds)
    return text(hysteresis(heights, speeds, rules, RATE))


@pytest.mark.parametrize(
    ("mask", "expected"),
    [
        ("", []),
        ("...", []),
        ("###", [(0, 2)]),
        ("#..##.#", [(0, 0), (3, 4), (6, 6)]),
        (".##", [(1, 2)]),
    ],
)
def test_runs(mask, expected):
    found = runs(np.array([c == "#" for c in mask], dtype=bool))
    assert found == expected


def test_there_is_one_function_for_runs():
    assert faults.runs is floor.runs


# Each frame is 10 ms; heights in cm: 1 enters, 3 stays, 9 is off the ground.
@pytest.mark.parametrize(
    ("heights", "expected"),
    [
        # begins and ends at the leave height, if the enter height is reached in between
        ([9, 9, 3, 3, 1, 1, 1, 3, 3, 9, 9], "..#######.."),
        # never low enough to enter
        ([9, 9, 3, 3, 3, 3, 3, 3, 3, 9, 9], "..........."),
        # dropped: shorter than 5 frames
        ([9, 9, 3, 1, 1, 3, 9, 9, 9, 9, 9], "..........."),
        # kept: just 5 frames
        ([9, 9, 3, 1, 1, 1, 3, 9, 9, 9, 9], "..#####...."),
        # short ones at either end of the clip may go on outside it
        ([1, 1, 9, 9, 9, 9, 9, 9, 9, 1, 1], "##.......##"),
        # a gap of 3 frames is closed
        ([9, 1, 1, 9, 9, 9, 1, 1, 1, 9, 9], ".########.."),
        # one of 4 is not, and leaves two that are too short
        ([9, 1, 1, 9, 9, 9, 9, 1, 1, 9, 9], "..........."),
        # no gap is closed at the ends of the clip
        ([9, 9, 1, 1, 1, 1, 1, 9, 9], "..#####.."),
    ],
)
def test_height_rules(heights, expected):
    assert bearing(heights) == expected


@pytest.mark.parametrize(
    ("speeds", "expected"),
    [
        ([2, 0.5, 0.5, 0.1, 0.1, 0.5, 2], ".#####."),
        ([2, 0.5, 0.5, 0.5, 0.5, 0.5, 2], "......."),
        ([2, 0.7, 0.1, 0.1, 0.1, 0.1, 2], "......."),
    ],
)
def test_speed_rules(speeds, expected):
    assert bearing([0] * len(speeds), speeds) == expected


def test_low_and_slow_must_come_together():
    assert bearing([1, 1, 1, 3, 3, 3, 3], [0.5, 0.5, 0.5, 0.1, 0.1, 0.1, 0.1]) == "......."
    assert bearing([1, 1, 1, 3, 3, 3, 3], [0.5, 0.5, 0.1, 0.1, 0.1, 0.1, 0.1]) == "#######"


def test_durations_count_in_seconds():
    heights = np.array([9, 9, 1, 1, 1, 9, 9]) / 100
    assert hysteresis(heights, np.zeros(7), RULES, 60.0).any()  # 50 ms
    assert not hysteresis(heights, np.zeros(7), RULES, 120.0).any()  # 25 ms


def test_speed_is_exact_on_a_straight_line_and_a_parabola():
    t = np.arange(50) / 120.0
    points = np.stack(
        [t[:, None] * [1.0, 2.0, -2.0], np.column_stack([0 * t, 4.9 * t**2, 0 * t])], axis=1
    )
    speeds = floor.speed(points, 120.0)
    np.testing.assert_allclose(speeds[:, 0], 3.0, atol=1e-9)
    np.testing.assert_allclose(speeds[1:-1, 1], 9.8 * t[1:-1], atol=1e-9)


@pytest.fixture(scope="module")
def walk(plain_body):
    return known_gait(plain_body, seconds=4.0)


def ball_paths(gait):
    pose = forward_kinematics(gait.body, gait.coordinates)
    nodes = [NODE_INDEX[f"toes_{side}"] for side in "rl"]
    return pose.positions[:, nodes]


def tilted(points, degrees, heading_deg=0.0, height=0.0):
    """Turn points about the horizontal axis that makes the ground rise towards a heading."""
    heading = np.radians(heading_deg)
    axis = np.array([-np.sin(heading), 0.0, np.cos(heading)])
    turn = exponential(np.radians(degrees) * axis)
    return points @ turn.T + [0.0, height, 0.0]


def test_every_stance_of_a_walk_is_found(walk):
    found = floor.standing_points(ball_paths(walk), walk.rate_hz, RULES)
    truth = [runs(walk.contacts[:, ball]) for ball in BALLS]
    assert [p for p, _, _ in found] == [0] * len(truth[0]) + [1] * len(truth[1])
    for (_, first, last), (begin, end) in zip(found, truth[0] + truth[1], strict=True):
        # it lies within the contact but for what hysteresis adds, 0.1 s on either side
        assert begin - 10 <= first <= begin + 2
        assert end - 12 <= last <= end + 3


@pytest.mark.parametrize("heading", [0.0, 180.0])
@pytest.mark.parametrize("degrees", [0.5, 1.3, 3.0, 5.0])
def test_a_planted_tilt_is_found(walk, degrees, heading):
    fit = fit_floor(tilted(ball_paths(walk), degrees, heading, height=0.7), RATE, RULES, level=True)
    assert fit.tilt_deg == pytest.approx(degrees, abs=0.1)
    assert np.degrees(np.arctan(fit.slope_x)) == pytest.approx(
        degrees if heading == 0 else -degrees, abs=0.1
    )
    # the ball joints stand 2.5 cm above the floor
    standing = walk.body.geometry.contact_points[CONTACT_POINTS.index("toe_r"), 1]
    assert fit.offset == pytest.approx(0.7 - standing, abs=0.005)
    assert fit.contacts >= 5
    assert fit.span_m > 3.0


def test_no_stance_is_lost_on_a_floor_that_rises(walk):
    """A foot's former stance lies up to 7 cm lower on this floor, 1.1 s before."""
    level = floor.standing_points(ball_paths(walk), RATE, RULES)
    uphill = floor.standing_points(tilted(ball_paths(walk), 3.0), RATE, RULES)
    assert [p for p, _, _ in uphill] == [p for p, _, _ in level]


def test_the_normal_is_that_of_the_plane():
    fit = FloorFit(0.3, 0.1, -0.2, 5, 2.0)
    along_x, along_z = np.array([1.0, fit.slope_x, 0.0]), np.array([0.0, fit.slope_z, 1.0])
    assert fit.normal @ along_x == pytest.approx(0.0, abs=1e-12)
    assert fit.normal @ along_z == pytest.approx(0.0, abs=1e-12)
    assert np.linalg.norm(fit.normal) == pytest.approx(1.0)
    assert fit.normal[1] > 0
    assert fit.tilt_deg == pytest.approx(np.degrees(np.arccos(fit.normal[1])))


def stepping(spots, seconds=0.5):
    """One foot that stands on each spot (x, y, z) in turn, lifted by 20 cm between them."""
    n = round(seconds * RATE)
    pieces = [np.tile(spots[0], (n, 1))]
    for before, after in itertools.pairwise(spots):
        s = np.linspace(0, 1, n)[:, None]
        arc = before + (3 * s**2 - 2 * s**3) * (np.array(after) - before)
        arc[:, 1] += 0.2 * np.sin(np.pi * s[:, 0])
        pieces += [arc[1:-1], np.tile(after, (n, 1))]
    return np.concatenate(pieces)[:, None]


def test_a_tilt_that_is_not_significant_is_left_alone():
    rng = np.random.default_rng(3)
    spots = np.column_stack([np.arange(7) * 0.3, 0.012 * rng.standard_normal(7), np.zeros(7)])
    by_hand = np.polyfit(spots[:, 0], spots[:, 1], 1)[0]
    assert abs(np.degrees(np.arctan(by_hand))) > 0.15  # the noise alone seems tilted
    fit = fit_floor(stepping(spots), RATE, RULES, level=True)
    assert fit.contacts == 7
    assert fit.tilt_deg == 0.0
    assert fit.offset == pytest.approx(spots[:, 1].mean(), abs=0.01)
    spots[:, 1] += np.tan(np.radians(4.0)) * spots[:, 0]  # the same noise on a real tilt
    fit = fit_floor(stepping(spots), RATE, RULES, level=True)
    assert fit.tilt_deg == pytest.approx(4.0, abs=1.5)


def test_a_slope_along_a_direction_the_feet_do_not_span_is_not_fitted():
    spots = np.column_stack([np.arange(6) * 0.15, np.arange(6) * 0.01, np.tile([0.0, 0.2], 3)])
    short = fit_floor(stepping(spots), RATE, RULES, level=True, shortest_span_m=1.0)
    assert short.tilt_deg == 0.0
    assert short.span_m < 1.0
    long = fit_floor(stepping(spots), RATE, RULES, level=True, shortest_span_m=0.5)
    assert long.tilt_deg == pytest.approx(np.degrees(np.arctan(0.01 / 0.15)), abs=0.1)
    assert long.slope_z == pytest.approx(0.0, abs=0.01)


def test_a_foot_caught_in_mid_air_does_not_tilt_the_floor():
    spots = np.column_stack([np.arange(9) * 0.4, np.zeros(9), np.zeros(9)])
    spots[:, 1] = np.tan(np.radians(2.0)) * spots[:, 0]
    spots[6, 1] += 0.12  # held in the air
    ordinary = np.degrees(np.arctan(np.polyfit(spots[:, 0], spots[:, 1], 1)[0]))
    assert abs(ordinary - 2.0) > 0.3
    fit = fit_floor(stepping(spots), RATE, RULES, level=True)
    assert fit.contacts == 9
    assert fit.tilt_deg == pytest.approx(2.0, abs=0.1)


def test_a_foot_still_falling_at_the_clips_end_does_not_tilt_the_floor():
    spots = np.column_stack([np.arange(6) * 0.7, np.zeros(6), np.zeros(6)])
    points = stepping(spots)
    falling = np.tile(points[-1:], (10, 1, 1))
    falling[:, 0, 0] += 0.5
    falling[:, 0, 1] = 0.06 - 0.001 * np.arange(10)
    lifted = np.linspace(points[-1], falling[0], 60)
    lifted[:, 0, 1] += 0.1 * np.sin(np.linspace(0, np.pi, 60))
    cut = np.concatenate([points, lifted, falling])
    found = floor.standing_points(cut, RATE, RULES)
    assert len(found) == 7  # it is slow, and the lowest of what is seen
    fit = fit_floor(cut, RATE, RULES, level=True)
    assert fit.contacts == 6
    assert fit.tilt_deg == 0.0
    assert fit.offset == pytest.approx(0.0, abs=1e-3)


def test_a_cut_stance_counts_where_there_is_no_other():
    points = np.tile([0.3, 0.4, 0.1], (12, 1))[:, None]
    fit = fit_floor(points, RATE, RULES, level=True)
    assert (fit.contacts, fit.offset, fit.tilt_deg) == (1, pytest.approx(0.4), 0.0)


def test_stairs_are_not_a_tilt_and_their_lowest_step_is_the_floor():
    spots = np.column_stack([np.arange(8) * 0.3, 0.17 * np.arange(8) + 0.5, np.zeros(8)])
    fit = fit_floor(stepping(spots), RATE, RULES, level=False)
    assert fit.tilt_deg == 0.0
    assert fit.contacts == 8
    assert 0.5 <= fit.offset <= 0.5 + 0.17
    assert fit_floor(stepping(spots), RATE, RULES, level=True).tilt_deg > 25


def test_without_a_stance_the_floor_is_the_lowest_level():
    t = np.arange(200) / RATE
    points = np.column_stack([3 * t, 1.0 + 0.2 * np.sin(9 * t), 0 * t])[:, None]
    fit = fit_floor(points, RATE, RULES, level=True)
    assert fit.contacts == 0
    assert fit.tilt_deg == 0.0
    assert fit.offset == pytest.approx(0.8, abs=0.01)


def test_moving_a_clip_moves_points_and_turns_frames(plain_body, walk):
    clip = clip_of(CMU, plain_body, walk.coordinates[:20], RATE)
    turn, shift = exponential(np.array([0.3, -0.8, 0.5])), np.array([1.0, 2.0, 3.0])
    moved = floor.move_clip(clip, turn, shift)
    np.testing.assert_allclose(moved.positions[7, 5], turn @ clip.positions[7, 5] + shift)
    np.testing.assert_allclose(moved.rotations[7, 5], turn @ clip.rotations[7, 5])
    np.testing.assert_allclose(moved.rest_offsets, clip.rest_offsets)


def test_the_walk_of_these_tests_has_the_contacts_it_says(walk):
    points = contact_points(walk.body, forward_kinematics(walk.body, walk.coordinates))
    speeds = floor.speed(points, RATE)[:, BALLS]
    inside = walk.contacts[:, BALLS]
    inside = inside[1:-1] & inside[2:] & inside[:-2]
    assert speeds[1:-1][inside].max() < 1e-6
    assert 0.3 < inside.mean() < 0.7
