"""Starts of a synthesis: an example copied along new footprints, and perturbed."""

from __future__ import annotations

import numpy as np
import pytest

from motionstyle.body.kinematics import contact_points
from motionstyle.body.layout import JOINT_COORDINATES, NODE_INDEX
from motionstyle.errors import MotionStyleError
from motionstyle.spacetime.captured_footprints import footprints_of
from motionstyle.spacetime.edits import Edits, edit_body
from motionstyle.spacetime.footprint_constraints import to_constraints
from motionstyle.spacetime.relay import Ramp, arc, relay, sharp_turn, straight
from motionstyle.spacetime.starts import copied_along, matching_frames, perturbed, root_way
from synthetic_walk import RATE, SPEED, make_walk

WALK = make_walk(300, heading=0.4)
ROWS = footprints_of(WALK)


def copied(route=None, frames=None, body=None, **how):
    rows = relay(ROWS, WALK.body, RATE, route or straight(), other_body=body, **how)
    return copied_along(WALK, rows, frames or WALK.frames, RATE, id="copied", body=body), rows


def foot_errors(motion, rows):
    feet = to_constraints(rows, motion.body, motion.frames, RATE)
    points = contact_points(motion.body, motion.pose())
    return np.linalg.norm(points - feet.targets, axis=-1)[feet.held]


def test_own_footprints_give_the_example_back():
    motion, _rows = copied()
    assert motion.kind == "warp"
    assert motion.provenance["variant"] == "copied"
    assert motion.provenance["example"] == WALK.id
    assert motion.coordinates == pytest.approx(WALK.coordinates, abs=1e-9)
    assert (motion.contacts == WALK.contacts).all()


def test_the_papers_start_has_its_root_on_the_spline():
    motion = copied_along(WALK, ROWS, WALK.frames, RATE, id="copied", on_the_way=True)
    way = root_way(ROWS, WALK.body, WALK.frames, RATE)
    assert motion.coordinates[:, [0, 2]] == pytest.approx(way.places[:, [0, 2]], abs=1e-9)
    assert motion.coordinates[:, 6:] == pytest.approx(WALK.coordinates[:, 6:], abs=1e-9)


def test_slower_is_the_same_movement_over_more_time():
    motion, rows = copied(frames=450, time_scale=1.5)
    assert foot_errors(motion, rows).max() < 0.03
    speed = np.linalg.norm(np.diff(motion.coordinates[50:400, :3], axis=0), axis=1).mean() * RATE
    assert speed == pytest.approx(SPEED / 1.5, rel=0.03)


@pytest.mark.parametrize("side", ["left", "right"])
def test_on_an_arc_the_pelvis_turns_with_the_way(side):
    motion, rows = copied(arc(4.0, side))
    forward = motion.pose().rotations[:, NODE_INDEX["pelvis"], :, 0]
    heading = np.unwrap(np.arctan2(-forward[:, 2], forward[:, 0]))
    turned = heading[200] - heading[100]  # before and after, half a step is straight on
    assert abs(turned) == pytest.approx(SPEED * 1.0 / 4.0, rel=0.1)
    assert (turned > 0) == (side == "left")
    assert np.sqrt((foot_errors(motion, rows) ** 2).mean()) < 0.05


def test_a_sharp_turn_stays_continuous():
    motion, _rows = copied(sharp_turn(0.5, "left", 0.3, 0.6))
    steps = np.abs(np.diff(motion.coordinates, axis=0))
    assert steps.max() < 0.2


@pytest.mark.parametrize("slope", [-8.0, 10.0])
def test_on_a_ramp_the_root_follows_the_surface(slope):
    motion, _rows = copied(surface=Ramp(slope))
    x = motion.coordinates[:, :3] - motion.coordinates[0, :3]
    travelled = np.hypot(x[-1, 0], x[-1, 2])
    assert x[-1, 1] / travelled == pytest.approx(np.tan(np.radians(slope)), abs=0.01)


def test_a_smaller_body_carries_its_root_lower():
    body = edit_body(WALK.body, Edits(length_scale=0.8))
    motion, rows = copied(straight(0.8), body=body)
    assert motion.body is body
    assert motion.coordinates[:, 1].mean() == pytest.approx(
        0.8 * WALK.coordinates[:, 1].mean(), rel=0.01
    )
    assert foot_errors(motion, rows).max() < 0.03


def test_frames_are_copied_from_the_same_feet():
    example = np.repeat([3, 1, 3, 2, 3, 1, 3, 2], [4, 10, 5, 10, 5, 10, 5, 6])
    wanted = np.repeat([3, 2, 3, 1, 3, 2, 3, 1, 3, 2], [8, 15, 8, 15, 8, 15, 8, 15, 8, 3])
    frames = matching_frames(example, wanted)
    assert (example[np.round(frames).astype(int)] == wanted).all()
    assert frames.min() >= 0
    assert frames.max() <= len(example) - 1
    assert (matching_frames(example, example) == np.arange(len(example))).all()


def test_feet_the_example_never_puts_down_are_copied_by_time():
    frames = matching_frames(np.full(11, 3), np.full(21, 0))
    assert frames == pytest.approx(np.linspace(0, 10, 21))


def test_one_stance_gives_no_way():
    rows = [r for r in ROWS if r.foot == "r" and r.t_on == 0.3]
    with pytest.raises(MotionStyleError, match="1 stance gives the root no way"):
        root_way(rows, WALK.body, 100, RATE)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_perturbed_starts_are_smooth_known_and_repeatable(seed):
    motion = perturbed(WALK, seed)
    again = perturbed(WALK, seed)
    assert (motion.coordinates == again.coordinates).all()
    away = motion.coordinates - WALK.coordinates
    assert not away[:, :6].any()
    assert np.degrees(np.sqrt((away[:, JOINT_COORDINATES] ** 2).mean())) == pytest.approx(10)
    spectrum = np.abs(np.fft.rfft(away[:, JOINT_COORDINATES] * np.hanning(300)[:, None], axis=0))
    power = (spectrum**2).sum(axis=1)
    assert power[np.fft.rfftfreq(300, 1 / RATE) > 3].sum() < 0.02 * power.sum()
    assert np.abs(away - (perturbed(WALK, seed + 10).coordinates - WALK.coordinates)).max() > 0.1
