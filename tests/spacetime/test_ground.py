"""Ground under the feet: a floor, stairs in both directions, a ramp."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from motionstyle.motion.motion import Motion
from motionstyle.spacetime.ground import UP, find_ground

STANCES = ((0, 10), (20, 30), (40, 50))


@pytest.fixture
def stepping(plain_body):
    """All foot points stand in three stances at heights that a test gives, (50 frames)."""

    def make(heights, surface, normal=UP):
        frames = STANCES[-1][1]
        contacts = np.zeros((frames, 8), dtype=bool)
        points = np.zeros((frames, 8, 3))
        for (first, stop), height in zip(STANCES, heights, strict=True):
            contacts[first:stop] = True
            points[first:stop, :, 1] = height
            points[first:stop, :, 0] = first / 20
        for (_, first), (stop, _) in pairwise(STANCES):
            between = np.linspace(0, 1, stop - first + 2)[1:-1, None]
            ends = points[[first - 1]][0], points[[stop]][0]
            points[first:stop] = ends[0] + between[..., None] * (ends[1] - ends[0])
            points[first:stop, :, 1] += 0.1
        motion = Motion(
            "steps", "captured", 100.0, np.zeros((frames, 35)), plain_body, contacts,
            np.broadcast_to(normal, (frames, 8, 3)).copy(), np.ones(35, dtype=bool),
            provenance={"surface": surface},
        )  # fmt: skip
        return points, motion

    return make


def test_a_level_floor_is_at_zero_whatever_the_feet_say(stepping):
    points, motion = stepping((0.004, -0.003, 0.0), "level")
    ground = find_ground(points, motion, 0)
    heights, normals = ground.clearance(points)
    np.testing.assert_array_equal(heights, points[..., 1])
    np.testing.assert_array_equal(normals, np.broadcast_to(UP, normals.shape))
    assert (ground.targets[motion.contacts][:, 1] == 0).all()


@pytest.mark.parametrize("heights", [(0.0, 0.17, 0.34), (0.34, 0.17, 0.0)])
def test_each_stair_is_its_own_plane(stepping, heights):
    points, motion = stepping(heights, "stairs")
    ground = find_ground(points, motion, 0)
    clearance, _ = ground.clearance(points)
    np.testing.assert_allclose(clearance[motion.contacts], 0, atol=1e-12)
    # in swing a point may be below the stair it leaves or the one it seeks, not below both
    low = points.copy()
    low[10:20, :, 1] = max(heights[:2]) - 0.05
    assert (ground.clearance(low)[0][10:20] > 0.1).all()
    low[10:20, :, 1] = min(heights[:2]) - 0.02
    np.testing.assert_allclose(ground.clearance(low)[0][10:20], -0.02, atol=1e-12)


def test_heights_over_a_ramp_are_along_its_normal(stepping):
    slope = np.radians(10)
    normal = np.array([-np.sin(slope), np.cos(slope), 0.0])
    points, motion = stepping((0.0, np.tan(slope), 2 * np.tan(slope)), "ramp", normal)
    ground = find_ground(points, motion, 0)
    np.testing.assert_allclose(ground.clearance(points)[0][motion.contacts], 0, atol=1e-12)
    raised = points + 0.03 * normal
    found, normals = ground.clearance(raised)
    np.testing.assert_allclose(found[motion.contacts], 0.03, atol=1e-12)
    np.testing.assert_allclose(normals[5, 0], normal, atol=1e-12)


def test_holds_fade_but_not_where_the_clip_cuts_them(stepping):
    points, motion = stepping((0.0, 0.0, 0.0), "level")
    hold = find_ground(points, motion, 3).hold[:, 0]
    assert hold[0] == 1
    np.testing.assert_allclose(hold[6:10], [1, 0.75, 0.5, 0.25])
    np.testing.assert_allclose(hold[20:24], [0.25, 0.5, 0.75, 1])
    assert hold[-1] == 1
    assert (hold[10:20] == 0).all()


def test_a_point_that_never_stands_on_stairs_has_no_ground(stepping):
    points, motion = stepping((0.0, 0.17, 0.34), "stairs")
    contacts = motion.contacts.copy()
    contacts[:, 3] = False
    ground = find_ground(points, replace(motion, contacts=contacts), 0)
    assert (ground.clearance(points)[0][:, 3] > 100).all()
