"""Footprints that no body can follow are refused, and the message names the rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motionstyle.errors import MotionStyleError
from motionstyle.spacetime.captured_footprints import footprints_of
from motionstyle.spacetime.footprint_checks import check_footprints
from motionstyle.spacetime.footprints import Footprint, numbered
from synthetic_walk import RATE, make_walk

WALK = make_walk()
ROWS = footprints_of(WALK)
FRAMES = WALK.frames


def check(rows, **how):
    check_footprints(rows, WALK.body, FRAMES, RATE, **how)


def stance(k):
    """Row numbers of the k-th stance of the walk, counted from 0."""
    times = sorted({one.t_on for one in ROWS})
    return [i for i, one in enumerate(ROWS) if one.t_on == times[k]]


def changed(indices, **values):
    """The walk's rows with some changed; callables get the old value."""
    rows = list(ROWS)
    for i in indices:
        new = {n: v(getattr(rows[i], n)) if callable(v) else v for n, v in values.items()}
        rows[i] = replace(rows[i], **new)
    return rows


def test_a_good_walk_passes():
    check(ROWS)
    check(numbered([Footprint("r", "foot", 0, 1, 0, 0, 0, 0)]))


def test_a_stride_of_5_m():
    own = stance(4)
    number = ROWS[own[0]].row
    with pytest.raises(MotionStyleError, match=rf"{number} .*step of [45]\.\d+ m is out of reach"):
        check(changed(own, x=lambda x: x + 5.0))


def test_wrong_foot_order():
    own = stance(4)
    other = "l" if ROWS[own[0]].foot == "r" else "r"
    with pytest.raises(MotionStyleError, match=r"foot stands in two .*must take turns") as caught:
        check(changed(own, foot=other))
    assert str(ROWS[own[0]].row) in str(caught.value)


def test_hops_are_allowed_where_asked_for():
    hops = [Footprint("r", "foot", 0.5 * k, 0.5 * k + 0.3, 0.4 * k, 0, 0, 0) for k in range(3)]
    check(hops, alternate=False)
    with pytest.raises(MotionStyleError, match=r"rows 3 .* and 4 .*twice in a row"):
        check(hops)


def test_left_and_right_exchanged():
    swap = {"r": "l", "l": "r"}
    wide = [replace(r, z=r.z * 3, foot=swap[r.foot]) for r in ROWS]
    with pytest.raises(MotionStyleError, match=r"wrong side .*left and right exchanged"):
        check(wide)


def test_a_contact_that_never_touches_because_it_is_too_short():
    own = stance(3)[:1]
    with pytest.raises(MotionStyleError, match=r"never touches: .*than one frame") as caught:
        check(changed(own, t_off=lambda _: ROWS[own[0]].t_on + 0.001))
    assert f"row {ROWS[own[0]].row} (" in str(caught.value)


def test_a_contact_that_never_touches_because_it_is_too_high():
    with pytest.raises(MotionStyleError, match=r"rise of 1.50 m is out of reach .*never touch"):
        check(changed(stance(4), y=1.5))


@pytest.mark.parametrize("duration", [0.0, -0.2])
def test_zero_and_negative_duration(duration):
    own = stance(3)[:1]
    rows = changed(own, t_off=lambda _: ROWS[own[0]].t_on + duration)
    with pytest.raises(MotionStyleError, match="t_off must lie after t_on"):
        check(rows)


@pytest.mark.parametrize("values", [{"t_on": -0.3}, {"t_off": 99.0}])
def test_beyond_the_motion(values):
    with pytest.raises(MotionStyleError, match=r"beyond the motion \(0 to 4.2 s\)"):
        check(changed(stance(3)[:1], **values))


def test_normals_must_be_unit_and_no_walls():
    with pytest.raises(MotionStyleError, match=r"normal has length 1.2, must be 1"):
        check(changed([0], normal_y=1.2))
    wall = {"normal_x": np.sin(1.2), "normal_y": np.cos(1.2)}
    with pytest.raises(MotionStyleError, match="steeper than 60 degrees"):
        check(changed([0], **wall))


def test_one_point_in_two_places_at_once():
    row = next(r for r in ROWS if r.point == "heel" and 1 < r.t_on < 2)
    doubled = [*ROWS, replace(row, x=row.x + 0.05, row=77)]
    message = rf"rows {row.row} .* and 77 .*hold heel_{row.foot} in two places at"
    with pytest.raises(MotionStyleError, match=message):
        check(doubled)


def test_points_apart_from_the_shape_of_the_foot():
    row = next(r for r in ROWS if r.point == "toe" and 1 < r.t_on < 2)
    with pytest.raises(MotionStyleError, match=r"apart at .*; on this foot they are 0\.\d+ m"):
        check([replace(r, x=r.x + 0.08) if r is row else r for r in ROWS])


def test_prints_below_the_floor():
    own = stance(4)
    message = r"lies 0\.040 m below the floor"
    with pytest.raises(MotionStyleError, match=message):
        check(changed(own, y=-0.04))


def test_a_foot_left_behind():
    rows = changed(stance(2), t_off=lambda t: t + 1.3)
    with pytest.raises(MotionStyleError, match=r"(still held|in two places|twice)"):
        check(rows)


def test_every_problem_is_told_with_the_file():
    rows = changed([0], normal_y=2.0)
    rows[5] = replace(rows[5], t_off=rows[5].t_on)
    with pytest.raises(MotionStyleError) as caught:
        check(rows, name="mine.tsv")
    lines = str(caught.value).splitlines()
    assert len(lines) == 2
    assert all(line.startswith("mine.tsv: row ") for line in lines)
