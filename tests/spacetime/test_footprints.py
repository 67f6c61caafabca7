"""Footprints: their table, extraction from motions, and the constraints made of them."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from motionstyle.body.kinematics import contact_points, forward_kinematics
from motionstyle.body.layout import CONTACT_POINTS, COORDINATE_INDEX
from motionstyle.errors import MotionStyleError
from motionstyle.motion.resample import resample
from motionstyle.spacetime.captured_footprints import footprints_of
from motionstyle.spacetime.footprint_constraints import (
    captured_constraints,
    print_poses,
    to_constraints,
)
from motionstyle.spacetime.footprints import (
    COLUMNS,
    Footprint,
    points_of,
    print_axes,
    read_footprints,
    sole_of,
    write_footprints,
)
from synthetic_walk import STEP, WIDTH, make_walk


def test_table_keeps_every_value(tmp_path):
    rows = footprints_of(resample(make_walk(), 30.0))
    write_footprints(tmp_path / "footprints.tsv", rows)
    back = read_footprints(tmp_path / "footprints.tsv")
    for before, after in zip(rows, back, strict=True):
        assert after.row == before.row
        for name in COLUMNS:
            assert getattr(after, name) == pytest.approx(getattr(before, name), abs=1e-6)


@pytest.mark.parametrize(
    ("column", "text", "message"),
    [
        ("foot", "right", "row 3, column foot: 'right' is not one of r, l"),
        ("point", "heal", r"row 3, column point: 'heal' .*did you mean heel"),
        ("t_on", "", "row 3, column t_on: empty"),
        ("x", "1,5", "row 3, column x: '1,5' is not a number; write a decimal point"),
        ("slide", "maybe", "row 3, column slide: 'maybe' is not one of yes, no"),
    ],
)
def test_table_names_the_wrong_cell(tmp_path, column, text, message):
    path = tmp_path / "footprints.tsv"
    write_footprints(path, [Footprint("r", "heel", 0, 1, 0, 0, 0, 0)])
    lines = path.read_text().splitlines()
    cells = lines[2].split("\t")
    cells[COLUMNS.index(column)] = text
    path.write_text("\n".join([*lines[:2], "\t".join(cells)]))
    with pytest.raises(MotionStyleError, match=message):
        read_footprints(path)


def test_table_names_a_missing_column(tmp_path):
    path = tmp_path / "footprints.tsv"
    path.write_text("\t".join(COLUMNS[:-1]) + "\n")
    with pytest.raises(MotionStyleError, match="column 'slide' is missing"):
        read_footprints(path)


def test_sole_is_where_flat_contact_points_are(plain_body, standing):
    points = contact_points(plain_body, forward_kinematics(plain_body, standing))[0]
    for foot in "rl":
        sole = sole_of(plain_body, foot)
        heel = points[CONTACT_POINTS.index(f"heel_{foot}")]
        for name, (ahead, aside) in sole.points.items():
            found = points[CONTACT_POINTS.index(f"{name}_{foot}")] - heel
            assert found == pytest.approx([ahead, 0, aside], abs=1e-9)


def test_print_axes_follow_yaw_and_slope():
    forward, right = print_axes(90.0, np.array([0.0, 1.0, 0.0]))
    assert forward == pytest.approx([0, 0, -1], abs=1e-12)
    assert right == pytest.approx([1, 0, 0], abs=1e-12)
    slope = np.radians(10)
    forward, right = print_axes(0.0, np.array([-np.sin(slope), np.cos(slope), 0.0]))
    assert forward == pytest.approx([np.cos(slope), np.sin(slope), 0])
    assert right == pytest.approx([0, 0, 1])


def test_group_foot_lays_down_the_whole_sole(plain_body):
    sole = sole_of(plain_body, "l")
    one = Footprint("l", "foot", 0, 1, 2.0, 0.1, 3.0, 180.0)
    places = points_of(one, sole)
    assert set(places) == {f"{n}_l" for n in ("heel", "ball_medial", "ball_lateral", "toe")}
    assert places["heel_l"] == pytest.approx([2.0, 0.1, 3.0])
    assert places["toe_l"] == pytest.approx([2.0 - sole.points["toe"][0], 0.1, 3.0])


@pytest.mark.parametrize("heading", [0.0, 0.7])
def test_prints_of_a_made_up_walk_are_where_it_was_put(heading):
    motion = make_walk(heading=heading)
    poses = print_poses(footprints_of(motion), motion.body, motion.rate_hz)
    assert [p.foot for p in poses] == ["l", "r", "l", "r", "l", "r", "l", "r", "l"]
    assert {p.stop - p.first for p in poses[2:-2]} == {60}
    along = np.array([np.cos(heading), 0, -np.sin(heading)])
    steps = np.diff([p.heel for p in poses], axis=0)
    assert steps @ along == pytest.approx(np.full(len(steps), STEP), abs=1e-6)
    aside = np.abs(steps @ np.cross(along, [0, 1, 0]))
    assert aside == pytest.approx(np.full(len(steps), WIDTH), abs=1e-6)
    assert [p.yaw for p in poses] == pytest.approx(np.full(9, np.degrees(heading)), abs=1e-6)


@pytest.mark.parametrize("rate", [100.0, 30.0])
def test_captured_footprints_give_back_contacts_and_places(tmp_path, rate):
    motion = resample(make_walk(), rate)
    for shape in ("own", "rigid"):
        write_footprints(tmp_path / "f.tsv", footprints_of(motion, shape))
        rows = read_footprints(tmp_path / "f.tsv")
        feet = to_constraints(rows, motion.body, motion.frames, rate)
        assert (feet.held == motion.contacts).all()
        points = contact_points(motion.body, motion.pose())
        away = np.linalg.norm(points - feet.targets, axis=-1)[feet.held]
        assert away.max() < (1e-4 if rate == 100 else 5e-3)


def test_footprints_serve_another_rate():
    motion = make_walk()
    feet = to_constraints(footprints_of(motion), motion.body, 126, 30.0)
    expected = resample(motion, 30.0).contacts
    for p in range(8):
        starts = [
            np.flatnonzero(np.diff(mask[:, p].astype(int)) == 1)
            for mask in (feet.held[: len(expected)], expected)
        ]
        assert len(starts[0]) == len(starts[1])
        assert np.abs(starts[0] - starts[1]).max() <= 1


def test_rigid_prints_keep_the_shape_of_a_shaking_foot():
    motion = make_walk()
    shaken = motion.coordinates.copy()
    shaken[:, 6:] += 0.01 * np.random.default_rng(0).standard_normal(shaken[:, 6:].shape)
    rows = footprints_of(replace(motion, coordinates=shaken), "rigid")
    prints = {}
    for row in rows:  # each print has a yaw of its own
        prints.setdefault((row.foot, row.yaw), {}).update(
            points_of(row, sole_of(motion.body, row.foot))
        )
    assert {len(points) for points in prints.values()} == {4}
    for (foot, _yaw), points in prints.items():
        sole = sole_of(motion.body, foot)
        for a, b in itertools.combinations(points, 2):
            wanted = math.dist(sole.points[a[:-2]], sole.points[b[:-2]])
            assert math.dist(points[a], points[b]) == pytest.approx(wanted, abs=1e-9)


def test_own_paths_are_targets_a_motion_itself_meets(plain_motion):
    feet = captured_constraints(plain_motion)
    points = contact_points(plain_motion.body, plain_motion.pose())
    assert (feet.held == plain_motion.contacts).all()
    assert np.abs(points - feet.targets)[feet.held].max() == 0
    heights = ((points - feet.ground) * feet.normals).sum(axis=-1)
    assert (heights - feet.clearance)[~feet.held].min() >= -1e-12
    assert feet.clearance.max() == 0


def test_swinging_feet_keep_above_the_level_floor():
    motion = make_walk()
    feet = to_constraints(footprints_of(motion), motion.body, motion.frames, motion.rate_hz)
    assert np.abs(feet.ground[..., 1]).max() < 1e-9
    assert (feet.normals == [0, 1, 0]).all()
    assert (feet.friction == 0.8).all()


def test_sliding_rows_have_little_friction():
    motion = make_walk(200)
    rows = [replace(r, slide=r.foot == "r") for r in footprints_of(motion)]
    feet = to_constraints(rows, motion.body, motion.frames, motion.rate_hz)
    assert feet.sliding[:, :4].sum() == feet.held[:, :4].sum() > 0
    assert not feet.sliding[:, 4:].any()
    assert set(feet.friction[feet.sliding]) == {0.02}


def test_foot_shape_of_a_bent_toe_is_flat_in_its_print(plain_body):
    motion = make_walk(100)
    bent = motion.coordinates.copy()
    bent[:, COORDINATE_INDEX["toes_extension_r"]] = 0.3
    rows = footprints_of(replace(motion, coordinates=bent))
    for pose in print_poses(rows, motion.body, motion.rate_hz):
        toe = [r for r in pose.rows if r.point == "toe"]
        assert all(r.y == pytest.approx(0, abs=1e-9) for r in toe)


def test_a_toe_that_leaves_as_the_heel_meets_the_next_step_is_another_print():
    motion = make_walk(100)
    contacts = np.zeros_like(motion.contacts)
    toe, heel = CONTACT_POINTS.index("toe_r"), CONTACT_POINTS.index("heel_r")
    contacts[0:30, toe] = True
    contacts[30:60, heel] = True
    q = motion.coordinates.copy()
    q[30:, 0] += 0.4
    rows = footprints_of(replace(motion, coordinates=q, contacts=contacts))
    assert [(r.point, r.t_on) for r in rows] == [("toe", 0.0), ("heel", 0.3)]
    poses = print_poses(rows, motion.body, motion.rate_hz)
    assert len(poses) == 2
