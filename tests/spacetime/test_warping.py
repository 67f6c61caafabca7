"""Motion warping: feet meet the footprints, and nothing else moves more than it must."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motionstyle.body.kinematics import contact_points
from motionstyle.body.layout import COORDINATE_INDEX, JOINT_COORDINATES
from motionstyle.errors import MotionStyleError
from motionstyle.motion.resample import resample
from motionstyle.spacetime.captured_footprints import footprints_of
from motionstyle.spacetime.edits import Edits, edit_ranges
from motionstyle.spacetime.footprint_constraints import to_constraints
from motionstyle.spacetime.relay import Ramp, arc, relay, straight
from motionstyle.spacetime.starts import copied_along
from motionstyle.spacetime.warping import WarpSettings, _evaluate, warp
from synthetic_walk import make_walk

RATE = 30.0
WALK = resample(make_walk(), RATE).window(10, 69)
RANGES = edit_ranges(WALK, Edits())


def warped(settings=None, **how):
    rows = footprints_of(WALK)
    if how:
        rows = relay(rows, WALK.body, RATE, how.pop("route", straight()), **how)
    feet = to_constraints(rows, WALK.body, WALK.frames, RATE)
    start = copied_along(WALK, rows, WALK.frames, RATE, id="warped")
    return start, feet, warp(start, feet, RANGES, settings, log=lambda _text: None)


def worst_mm(motion, feet):
    away = contact_points(motion.body, motion.pose()) - feet.targets
    return 1000 * np.linalg.norm(away, axis=-1)[feet.held].max()


@pytest.mark.parametrize("smooth", ["motion", "displacement"])
def test_own_footprints_leave_the_motion_nearly_as_it_is(smooth):
    _start, feet, found = warped(WarpSettings(smooth=smooth))
    away = (found.motion.coordinates - WALK.coordinates)[:, JOINT_COORDINATES]
    assert np.degrees(np.sqrt((away**2).mean())) < 1.0
    assert worst_mm(found.motion, feet) < 5
    assert found.report["status"] == "converged"


@pytest.mark.parametrize(
    "how", [{"route": arc(3.0, "left")}, {"surface": Ramp(8.0)}, {"surface": Ramp(-8.0)}]
)
def test_new_footprints_are_met_within_5_mm(how):
    start, feet, found = warped(**how)
    assert worst_mm(start, feet) > 20
    assert worst_mm(found.motion, feet) < 5
    points = contact_points(WALK.body, found.motion.pose())
    heights = ((points - feet.ground) * feet.normals).sum(axis=-1)
    assert heights.min() > -0.005
    assert found.motion.kind == "warp"
    assert found.motion.provenance["variant"] == "warped"
    assert found.report["status"] == "converged"


def test_sliding_feet_stay_on_the_surface_only():
    rows = [replace(r, x=r.x + 0.5, slide=True) for r in footprints_of(WALK)]
    feet = to_constraints(rows, WALK.body, WALK.frames, RATE)
    found = warp(WALK, feet, RANGES, log=lambda _text: None)
    away = contact_points(WALK.body, found.motion.pose()) - feet.targets
    normal = np.abs((away * feet.normals).sum(axis=-1))[feet.held]
    assert normal.max() < 0.005
    assert np.abs(away[feet.held]).max() > 0.4  # nothing pulls them along


def test_locked_joints_stay_locked():
    ranges = RANGES.copy()
    knee = COORDINATE_INDEX["knee_flexion_l"]
    ranges[knee] = np.radians([4.5, 5.5])
    feet = to_constraints(footprints_of(WALK), WALK.body, WALK.frames, RATE)
    found = warp(WALK, feet, ranges, log=lambda _text: None)
    assert np.degrees(np.abs(found.motion.coordinates[:, knee] - np.radians(5))).max() < 1.0


def test_gradient_is_that_of_the_cost():
    start, feet, _found = warped(WarpSettings(iterations=1), surface=Ramp(8.0))
    settings = WarpSettings()
    rng = np.random.default_rng(0)
    q = start.coordinates + 0.02 * rng.standard_normal(start.coordinates.shape)
    qdd = rng.standard_normal(q.shape)
    steps = rng.standard_normal((2, *q.shape))
    whole = _evaluate(start, feet, RANGES, settings, q, qdd)
    eps = 1e-6
    more = _evaluate(start, feet, RANGES, settings, q + eps * steps[0], qdd + eps * steps[1])
    less = _evaluate(start, feet, RANGES, settings, q - eps * steps[0], qdd - eps * steps[1])
    n = q.shape[1]
    slope = (whole.gradients[:, :n] * steps[0]).sum() + (
        whole.gradients[:, 2 * n :] * steps[1]
    ).sum()
    assert (more.cost - less.cost) / (2 * eps) == pytest.approx(2 * slope, rel=1e-4)


def test_lengths_that_differ_are_refused():
    feet = to_constraints(footprints_of(WALK), WALK.body, WALK.frames - 1, RATE)
    with pytest.raises(MotionStyleError, match="60 frames, but constraints of 59"):
        warp(WALK, feet, RANGES)
