"""Fitting coordinates to markers of a body in known poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_body_fit import CMU, clip_of, known_gait
from test_contacts import WALK

from motionstyle.body.kinematics import contact_points, forward_kinematics
from motionstyle.body.layout import (
    CONTACT_POINTS,
    COORDINATE_INDEX,
    COORDINATES,
    EXPONENTIAL_BLOCKS,
    HINGE_COLUMNS,
    NODES,
)
from motionstyle.body.rotations import exponential
from motionstyle.mocap.fitting import retarget
from motionstyle.mocap.fitting.body_fit import NodeFrames, measure_body, node_frames
from motionstyle.mocap.fitting.contacts import detect_contacts
from motionstyle.mocap.fitting.floor import runs
from motionstyle.mocap.fitting.virtual_markers import (
    ground_markers,
    marker_distances,
    place_markers,
)

RATE = 100.0
ALL = np.ones(len(COORDINATES), dtype=bool)


@pytest.fixture(scope="module")
def walk(plain_body):
    return known_gait(plain_body, seconds=1.5)


def true_frames(body, coordinates):
    """The frames of all nodes exactly as they are."""
    pose = forward_kinematics(body, coordinates)
    return NodeFrames(
        {node: pose.positions[:, i] for i, node in enumerate(NODES)},
        {node: pose.rotations[:, i] for i, node in enumerate(NODES)},
        {},
    )


@pytest.fixture(scope="module")
def markers(walk):
    return place_markers(true_frames(walk.body, walk.coordinates), walk.body, set(NODES))


def test_markers_lie_on_the_true_body(walk, markers):
    assert marker_distances(walk.body, markers, walk.coordinates).max() < 1e-9
    off = np.array(walk.coordinates)
    off[:, 0] += 0.03
    np.testing.assert_allclose(marker_distances(walk.body, markers, off), 0.03, atol=1e-9)


def test_copied_angles_are_the_coordinates_of_a_body_like_ours(walk):
    copied = retarget.copied_angles(true_frames(walk.body, walk.coordinates), ALL)
    np.testing.assert_allclose(copied, walk.coordinates, atol=1e-9)


def test_copied_angles_of_unobserved_coordinates_are_zero(walk):
    seen = ALL.copy()
    seen[[COORDINATE_INDEX["toes_extension_l"], COORDINATE_INDEX["head_rotation"]]] = False
    copied = retarget.copied_angles(true_frames(walk.body, walk.coordinates), seen)
    assert not copied[:, ~seen].any()
    np.testing.assert_allclose(copied[:, seen], walk.coordinates[:, seen], atol=1e-9)


@pytest.mark.parametrize("off_deg", [1.0, 15.0])
def test_the_true_coordinates_are_found_from_a_wrong_start(walk, markers, off_deg):
    rng = np.random.default_rng(1)
    start = walk.coordinates + np.radians(off_deg) * rng.uniform(-1, 1, walk.coordinates.shape)
    found = retarget.fit_coordinates(walk.body, markers, start, ALL, iterations=30)
    error = np.abs(found - walk.coordinates)
    # the prior draws towards the start: 0.01 m per rad against markers 0.1 m and more away
    assert np.degrees(error[:, 3:].max()) < 0.05 * off_deg
    assert marker_distances(walk.body, markers, found).max() < 2e-4 * off_deg


def test_coordinates_that_are_not_free_stay(walk, markers):
    free = np.array([name.startswith("knee") for name in COORDINATES])
    start = walk.coordinates + 0.1
    found = retarget.fit_coordinates(walk.body, markers, start, free)
    np.testing.assert_array_equal(found[:, ~free], start[:, ~free])
    assert (found[:, free] != start[:, free]).any()
    start = np.where(free, walk.coordinates + 0.1, walk.coordinates)
    found = retarget.fit_coordinates(walk.body, markers, start, free)
    np.testing.assert_allclose(found, walk.coordinates, atol=2e-4)


@pytest.mark.parametrize("joint", ["toes_extension_r", "ankle_dorsiflexion_l"])
def test_a_hinge_found_a_whole_turn_away_comes_back(walk, markers, joint):
    column, turned = COORDINATE_INDEX[joint], slice(10, 14)
    start = np.array(walk.coordinates)
    start[turned, column] += 2 * np.pi
    found = retarget.fit_coordinates(walk.body, markers, start, ALL, iterations=30)
    np.testing.assert_allclose(found[:, 3:], walk.coordinates[:, 3:], atol=1e-3)


def test_frames_do_not_depend_on_one_another(walk, markers, monkeypatch):
    start = walk.coordinates + 0.05
    whole = retarget.fit_coordinates(walk.body, markers, start, ALL)
    monkeypatch.setattr(retarget, "CHUNK", 40)
    np.testing.assert_allclose(
        retarget.fit_coordinates(walk.body, markers, start, ALL), whole, atol=1e-9
    )


def test_a_marker_of_no_weight_pulls_at_nothing(walk, markers):
    world, weights = np.array(markers.world), np.array(markers.weights)
    world[:, 4] += 0.3
    weights[:, 4] = 0.0
    pulled = replace(markers, world=world)
    ignored = replace(markers, world=world, weights=weights)
    near = retarget.fit_coordinates(walk.body, ignored, walk.coordinates, ALL)
    far = retarget.fit_coordinates(walk.body, pulled, walk.coordinates, ALL)
    np.testing.assert_allclose(near, walk.coordinates, atol=1e-6)
    assert np.abs(far - walk.coordinates).max() > 0.02


def sliding(walk):
    """The walk with legs that let the feet slide and sink, as bad data does."""
    bad = np.array(walk.coordinates)
    t = np.arange(len(bad)) / RATE
    bad[:, 0] += 0.012 * np.sin(2 * np.pi * 1.5 * t)
    bad[:, 1] -= 0.006
    return bad


def worst(body, coordinates, contacts):
    """Rms slip of bearing points about their places, and their rms height, both in mm."""
    points = contact_points(body, forward_kinematics(body, coordinates))
    slips = [
        ((points[a : b + 1, p][:, [0, 2]] - points[a : b + 1, p][:, [0, 2]].mean(0)) ** 2).sum(1)
        for p in range(8)
        if not CONTACT_POINTS[p].startswith("toe")  # its tip rolls
        for a, b in runs(contacts[:, p])
    ]
    heights = points[..., 1][contacts]
    return 1000 * np.sqrt([np.concatenate(slips).mean(), (heights**2).mean()])


def test_grounding_stops_sliding_and_sinking_and_leaves_the_trunk(walk):
    bad = sliding(walk)
    markers = place_markers(true_frames(walk.body, bad), walk.body, set(NODES))
    ground = np.zeros(walk.contacts.shape)
    legs = retarget.fit_legs_to_ground(
        walk.body, markers, bad, walk.contacts, ground, RATE, cutoff_hz=6.0
    )
    before, after = worst(walk.body, bad, walk.contacts), worst(walk.body, legs, walk.contacts)
    assert before[0] > 5
    assert after[0] < 0.8 * before[0]
    assert before[1] > 5
    assert after[1] < 0.5 * before[1]
    moved = [n.rsplit("_", 1)[0] for n in retarget.LEG_COORDINATES] + ["toes", "knee", "hip"]
    rest = [
        i for i, n in enumerate(COORDINATES) if n.split("_")[0] not in {*moved, "ankle", "foot"}
    ]
    assert len(rest) == 35 - 14
    np.testing.assert_array_equal(legs[:, rest], bad[:, rest])


def test_a_walk_that_stands_well_is_hardly_changed(walk, markers):
    ground = np.zeros(walk.contacts.shape)
    legs = retarget.fit_legs_to_ground(
        walk.body, markers, walk.coordinates, walk.contacts, ground, RATE, cutoff_hz=50.0
    )
    # the two sides of the ball and the heel bear while the sole is flat: nothing to correct
    assert np.degrees(np.abs(legs - walk.coordinates).max()) < 0.7
    slip, deep = worst(walk.body, legs, walk.contacts)
    assert slip < 1.5
    assert deep < 0.2


def test_ground_markers_hold_still_and_fade_at_both_ends_of_a_stance(walk):
    points = contact_points(walk.body, forward_kinematics(walk.body, sliding(walk)))
    contacts = np.zeros(walk.contacts.shape, dtype=bool)
    contacts[20:60, 0] = True
    contacts[:30, 4] = True  # begins before the clip
    ground = np.full(contacts.shape, 0.01)
    held = ground_markers(walk.body, points, contacts, ground, RATE)
    stance = held.world[20:60, 0]
    assert np.ptp(stance, axis=0).max() == 0.0
    assert stance[0, 1] == 0.01
    low, high = points[20:60, 0].min(axis=0), points[20:60, 0].max(axis=0)
    assert (stance[0, [0, 2]] >= low[[0, 2]]).all()
    assert (stance[0, [0, 2]] <= high[[0, 2]]).all()
    hold = held.weights[20:60, 0, 0]
    assert hold[0] < 0.2 * hold.max()
    assert hold[-1] < 0.2 * hold.max()
    assert (np.diff(hold[:20]) >= 0).all()
    assert held.weights[0, 4, 0] == held.weights[10, 4, 0] > 0
    assert held.weights[29, 4, 0] < 0.2 * held.weights[10, 4, 0]
    free = ~contacts & (points[..., 1] >= ground)
    assert not held.weights[free].any()
    sunken = ~contacts & (points[..., 1] < ground)
    assert sunken.any()
    assert (held.world[..., 1][sunken] == 0.01).all()
    assert not held.weights[..., 0][sunken].any()  # lifted, not held back


def test_toes_are_lifted_just_clear_of_the_ground_and_no_further(walk):
    q = np.array(walk.coordinates)
    toes = [COORDINATE_INDEX[f"toes_extension_{side}"] for side in "rl"]
    tips = [CONTACT_POINTS.index(f"toe_{side}") for side in "rl"]
    q[:, toes] = 0.0
    sunk = contact_points(walk.body, forward_kinematics(walk.body, q))[:, tips, 1]
    assert sunk.min() < -0.02
    lifted = retarget.lift_toes(walk.body, q, np.zeros((len(q), 8)))
    height = contact_points(walk.body, forward_kinematics(walk.body, lifted))[:, tips, 1]
    assert height.min() > -1e-9
    np.testing.assert_allclose(height[sunk < -1e-9], 0.0, atol=1e-9)
    np.testing.assert_array_equal(lifted[:, toes][sunk > 1e-9], q[:, toes][sunk > 1e-9])
    others = [i for i in range(35) if i not in toes]
    np.testing.assert_array_equal(lifted[:, others], q[:, others])
    raised = retarget.lift_toes(walk.body, q, np.full((len(q), 8), 0.5))
    assert np.degrees(raised[:, toes]).max() == pytest.approx(75.0)


def test_a_body_of_the_clips_own_fits_its_markers(plain_body, walk):
    clip = clip_of(CMU, plain_body, walk.coordinates, RATE, twist_deg=40.0)
    geometry, frames = measure_body(node_frames(clip, CMU), "male", RATE, WALK)
    body = replace(plain_body, geometry=geometry)
    markers = place_markers(frames, body, set(CMU.joints))
    start = retarget.copied_angles(frames, ALL)
    found = retarget.fit_coordinates(body, markers, start, ALL)
    assert 1000 * marker_distances(body, markers, found).max() < 0.5
    error = np.degrees(found - walk.coordinates)
    toes = [COORDINATE_INDEX[f"toes_extension_{side}"] for side in "rl"]
    assert np.abs(np.delete(error, [0, 1, 2, *toes], axis=1)).max() < 0.3
    # where the toes are straight is a convention: in their median pose
    assert np.ptp(error[:, toes], axis=0).max() < 0.1
    assert np.abs(error[:, toes]).max() < 6
    points = contact_points(body, forward_kinematics(body, found))
    assert detect_contacts(points, RATE, WALK, np.zeros(points.shape[:2])).any()


def test_a_hinge_that_passes_half_a_turn_stays_continuous():
    truth = np.zeros((200, len(COORDINATES)))
    truth[:, list(HINGE_COLUMNS)] = np.radians(np.linspace(0, 250, 200))[:, None]
    wrapped = truth - 2 * np.pi * np.round(truth / (2 * np.pi))
    assert np.abs(np.diff(wrapped, axis=0)).max() > 6
    found, jumps = retarget.make_continuous(wrapped)
    np.testing.assert_allclose(found, truth, atol=1e-12)
    assert jumps == ()


def test_a_frame_a_whole_turn_away_does_not_make_a_toe_spin(walk, markers):
    """Filtered as it was, rajagopal's toe turned by 400 degrees in swing."""
    toe = COORDINATE_INDEX["toes_extension_r"]
    turned = np.array(walk.coordinates)
    turned[20:26, toe] += 2 * np.pi
    points = contact_points(walk.body, forward_kinematics(walk.body, walk.coordinates))
    level, none = np.full(points.shape[:2], -1.0), np.zeros(points.shape[:2], dtype=bool)

    def toes(coordinates):
        """The filtered toe."""
        return retarget.fit_legs_to_ground(walk.body, markers, coordinates, none, level, RATE, 6.0)[
            :, toe
        ]

    np.testing.assert_allclose(toes(turned), toes(walk.coordinates), atol=1e-6)


@pytest.mark.parametrize("block", EXPONENTIAL_BLOCKS)
def test_exponential_maps_become_continuous(block):
    t = np.linspace(0, 1, 200)
    truth = np.outer(np.radians(100 + 160 * t), [0.6, 0.0, 0.8])  # 100 to 260 degrees
    q = np.zeros((200, len(COORDINATES)))
    q[:, block] = truth * (1 - 2 * np.pi / np.linalg.norm(truth, axis=1))[:, None]
    q[:40, block] = truth[:40]  # as a logarithm gives it: the branch changes at 180 degrees
    assert np.abs(np.diff(q, axis=0)).max() > 3
    result, jumps = retarget.make_continuous(q)
    np.testing.assert_allclose(result[:, block], truth, atol=1e-9)
    assert jumps == ()


def test_a_full_turn_is_rebranched_once_and_reported():
    angle = np.radians(np.linspace(0, 720, 400))
    q = np.zeros((400, len(COORDINATES)))
    q[:, 4] = np.arctan2(np.sin(angle), np.cos(angle))
    result, jumps = retarget.make_continuous(q)
    assert len(jumps) == 2
    steps = np.abs(np.diff(result[:, 4]))
    assert {int(i) + 1 for i in np.flatnonzero(steps > np.pi)} == set(jumps)
    np.testing.assert_allclose(exponential(result[:, 3:6]), exponential(q[:, 3:6]), atol=1e-9)
