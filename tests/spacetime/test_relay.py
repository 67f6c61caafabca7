"""Footprints laid along other ways and onto other surfaces."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from motionstyle.errors import MotionStyleError
from motionstyle.spacetime.captured_footprints import footprints_of
from motionstyle.spacetime.edits import Edits, edit_body
from motionstyle.spacetime.footprint_checks import check_footprints
from motionstyle.spacetime.footprint_constraints import print_poses, to_constraints
from motionstyle.spacetime.footprints import sole_of
from motionstyle.spacetime.relay import (
    Piece,
    Ramp,
    Route,
    Stairs,
    arc,
    relay,
    resoled,
    sharp_turn,
    straight,
)
from synthetic_walk import RATE, STEP, WIDTH, make_walk

WALK = make_walk()
ROWS = footprints_of(WALK)


def laid(route=None, frames=None, **how):
    rows = relay(ROWS, WALK.body, RATE, route or straight(), **how)
    check_footprints(rows, how.get("other_body") or WALK.body, frames or WALK.frames, RATE)
    return print_poses(rows, how.get("other_body") or WALK.body, RATE)


def middles(poses):
    half = sole_of(WALK.body, "r").points["toe"][0] / 2
    yaws = np.radians([p.yaw for p in poses])
    return np.array([p.heel for p in poses]) + half * np.column_stack(
        [np.cos(yaws), 0 * yaws, -np.sin(yaws)]
    )


def test_the_same_way_gives_the_same_prints():
    for before, after in zip(print_poses(ROWS, WALK.body, RATE), laid(), strict=True):
        assert (after.foot, after.first, after.stop) == (before.foot, before.first, before.stop)
        assert after.heel == pytest.approx(before.heel, abs=1e-9)
        assert after.yaw == pytest.approx(before.yaw, abs=1e-9)


def test_longer_and_slower_steps():
    poses = laid(straight(1.2), frames=630, time_scale=1.5)
    steps = np.diff([p.heel for p in poses], axis=0)
    assert steps[:, 0] == pytest.approx(1.2 * STEP)
    assert np.abs(steps[:, 2]) == pytest.approx(WIDTH)
    assert {p.stop - p.first for p in poses[2:-2]} == {90}


@pytest.mark.parametrize(("side", "sign"), [("left", 1.0), ("right", -1.0)])
def test_prints_on_an_arc_lie_on_two_circles(side, sign):
    radius = 3.0
    poses = laid(arc(radius, side))
    start = middles(poses)[0]
    outside = WIDTH / 2 * (1 if poses[0].foot == "r" else -1)
    centre = start - np.array([0, 0, sign * radius + outside])
    for pose, middle in zip(poses, middles(poses), strict=True):
        expected = radius + sign * WIDTH / 2 * (1 if pose.foot == "r" else -1)
        assert np.linalg.norm(middle - centre) == pytest.approx(expected, abs=1e-6)
        tangent = sign * np.cross([0, 1, 0], middle - centre)
        yaw = np.degrees(np.arctan2(-tangent[2], tangent[0]))
        assert (pose.yaw - yaw + 180) % 360 - 180 == pytest.approx(0, abs=1e-6)


def test_sharp_turn_comes_back():
    poses = laid(sharp_turn(0.5, "left", 0.5, 0.6))
    assert abs(abs(poses[-1].yaw) - 180) < 1e-6
    back = np.diff(middles(poses)[-3:], axis=0)
    assert back[:, 0] == pytest.approx(-STEP, abs=1e-6)


def test_way_is_continuous_in_place_and_heading():
    route = Route((Piece(1.0), Piece(2.0, 120.0, 0.7), Piece(1.5, -40.0), Piece(9.0)))
    s = np.linspace(-1, 8, 4000)
    places = np.array([route.at(float(x))[0] for x in s])
    headings = np.array([route.at(float(x))[1] for x in s])
    speed = np.linalg.norm(np.diff(places, axis=0), axis=1) / np.diff(s)
    assert speed.max() == pytest.approx(1.0, abs=1e-3)
    assert speed.min() == pytest.approx(0.7, abs=1e-3)
    assert np.abs(np.diff(headings)).max() < 0.01
    assert np.degrees(headings[-1]) == pytest.approx(80)


@pytest.mark.parametrize("slope", [-10.0, -5.0, 8.0])
def test_ramp_prints_lie_in_one_tilted_plane(slope):
    poses = laid(surface=Ramp(slope))
    normal = np.array([-np.sin(np.radians(slope)), np.cos(np.radians(slope)), 0])
    heights = [(p.heel - poses[0].heel) @ normal for p in poses]
    assert heights == pytest.approx(np.zeros(len(poses)), abs=1e-9)
    assert np.array([p.normal for p in poses]) == pytest.approx(np.tile(normal, (len(poses), 1)))
    steps = np.linalg.norm(np.diff([p.heel for p in poses], axis=0), axis=1)
    assert steps == pytest.approx(np.hypot(STEP, WIDTH))
    assert poses[-1].heel[1] == pytest.approx(
        poses[0].heel[1] + (len(poses) - 1) * STEP * np.sin(np.radians(slope))
    )


def test_level_lead_to_a_ramp_has_no_print_across_the_edge():
    poses = laid(surface=Ramp(10.0, level_m=1.0))
    level = [p for p in poses if p.normal[1] > 1 - 1e-9]
    tilted = [p for p in poses if p.normal[1] < 1 - 1e-9]
    assert level
    assert tilted
    assert all(p.heel[1] == 0 for p in level)
    toe = sole_of(WALK.body, "r").points["toe"][0]
    edge = middles(poses)[0][0] + 1.0
    assert max(p.heel[0] for p in level) + toe < edge
    assert min(p.heel[0] for p in tilted) > edge


def test_stairs_have_one_print_a_step_and_feet_clear_the_edges():
    tread, rise = 0.3, 0.17
    rows = relay(ROWS, WALK.body, RATE, straight(), surface=Stairs(tread, rise))
    check_footprints(rows, WALK.body, WALK.frames, RATE)
    poses = print_poses(rows, WALK.body, RATE)
    for k, pose in enumerate(poses):
        assert pose.heel[1] == pytest.approx(k * rise)
    assert np.diff([p.heel[0] for p in poses]) == pytest.approx(tread)
    feet = to_constraints(rows, WALK.body, WALK.frames, RATE)
    steps = {round(k * rise, 6) for k in range(len(poses))}
    assert set(np.unique(feet.ground[..., 1].round(6))) <= steps
    right = [p for p in poses if p.foot == "r"]
    for before, after in itertools.pairwise(right):
        swing = feet.ground[before.stop : after.first, :4, 1]
        assert (np.diff(swing, axis=0) >= -1e-9).all()  # never back down
        assert {round(h, 6) for h in swing.ravel()} == {
            round(before.heel[1] + k * rise, 6) for k in range(3)
        }


def test_another_body_leaves_its_own_soles_where_the_feet_were():
    small = edit_body(WALK.body, Edits(length_scale=0.8))
    before = print_poses(ROWS, WALK.body, RATE)
    after = print_poses(resoled(ROWS, WALK.body, RATE, small, slide=False), small, RATE)
    length = sole_of(WALK.body, "r").points["toe"][0]
    for a, b in zip(before, after, strict=True):
        assert b.heel - a.heel == pytest.approx([0.1 * length, 0, 0], abs=1e-9)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: relay(ROWS, WALK.body, RATE, arc(2, "left"), surface=Ramp(5)), "this one turns"),
        (lambda: relay(ROWS[:3], WALK.body, RATE, straight()), "too few"),
        (lambda: relay(ROWS, WALK.body, RATE, straight(), time_scale=9), "time_scale 9"),
        (lambda: arc(0, "left"), "radius 0"),
        (lambda: sharp_turn(1, "up", 0, 1), "'up'"),
        (
            lambda: relay(
                relay(ROWS, WALK.body, RATE, arc(1, "left")), WALK.body, RATE, straight()
            ),
            "only a straight movement",
        ),
        (
            lambda: relay(
                relay(ROWS, WALK.body, RATE, straight(), surface=Ramp(9)),
                WALK.body,
                RATE,
                straight(),
            ),
            "on a slope",
        ),
    ],
)
def test_what_cannot_be_laid_is_refused(build, message):
    with pytest.raises(MotionStyleError, match=message):
        build()
