"""Measures of synthesised motions, on motions whose numbers are known by construction."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionstyle.body.layout import COORDINATE_INDEX, COORDINATES
from motionstyle.body.rotations import exponential, logarithm
from motionstyle.evaluation import syntheses as measure
from motionstyle.evaluation import synthesis_rows as rows
from motionstyle.motion.motion import Motion
from motionstyle.spacetime.captured_footprints import footprints_of
from motionstyle.spacetime.edits import Edits, edit_ranges
from motionstyle.spacetime.footprint_constraints import to_constraints
from motionstyle.spacetime.synthesis_plan import make_plan, planned_footprints
from motionstyle.spacetime.synthesis_sheet import FootprintSource, SynthesisRow
from synthetic_walk import RATE, make_body, make_walk

WALK = make_walk()
Q = COORDINATE_INDEX
DEG = np.pi / 180


def posed(motion=WALK, **angles):
    """The walk with some joints at given angles (deg): numbers or (F,)."""
    q = motion.coordinates.copy()
    for name, value in angles.items():
        q[:, Q[name]] = np.radians(value)
    return replace(motion, coordinates=q)


def gliding(radius=None, lean_deg=0.0, frames=300, speed=1.5):
    """A stiff body that glides, feet together, on a line or a circle to the left, leaning left."""
    t = np.arange(frames) / RATE
    q = np.zeros((frames, len(COORDINATES)))
    q[:, 1] = 0.93
    heading = np.zeros(frames) if radius is None else speed * t / radius
    if radius is None:
        q[:, 0] = speed * t
    else:
        q[:, 0], q[:, 2] = radius * np.sin(heading), -radius * (1 - np.cos(heading))
    turn = exponential(np.outer(heading, [0, 1.0, 0]))
    tilt = exponential(np.array([-np.radians(lean_deg), 0.0, 0.0]))  # left is −z, roll about −x
    q[:, 3:6] = logarithm(turn @ tilt)
    contacts = np.zeros((frames, 8), dtype=bool)
    normals = np.broadcast_to([0.0, 1.0, 0.0], (frames, 8, 3)).copy()
    return Motion("glide", "nio", RATE, q, make_body(), contacts, normals, np.ones(35, dtype=bool))


@pytest.mark.parametrize("lean", [-6.0, 0.0, 12.0])
def test_lean_on_a_circle_is_the_one_put_in(lean):
    motion = gliding(radius=2.0, lean_deg=lean)
    assert measure.lean_to_centre_deg(motion) == pytest.approx(lean, abs=0.3)
    assert measure.lean_left_deg(motion) == pytest.approx(lean, abs=0.3)


def test_balance_on_a_circle_is_atan_of_v2_over_rg():
    expected = np.degrees(np.arctan(1.5**2 / (2.0 * 9.81)))
    motion = gliding(radius=2.0, lean_deg=expected)
    assert measure.turn_radius_m(motion) == pytest.approx(2.0, rel=1e-6)
    assert measure.balance_lean_deg(motion) == pytest.approx(expected, rel=0.05)
    assert measure.lean_over_balance_ratio(motion) == pytest.approx(1.0, rel=0.07)


def test_straight_motions_have_no_lean_to_a_centre():
    assert np.isnan(measure.lean_to_centre_deg(gliding()))
    assert np.isnan(measure.lean_over_balance_ratio(gliding()))
    assert np.isnan(measure.lean_to_centre_deg(WALK))


def test_a_turn_is_the_feet_s_where_the_pelvis_drifts_out_of_it():
    frames, circle = 900, gliding(radius=2.0, frames=900, speed=0.15)
    lean = 40 * np.linspace(0, 1, frames) ** 2 * DEG  # outwards, about the feet, ever faster
    tilt = exponential(lean[:, None] * [1.0, 0, 0])
    turn = exponential(circle.coordinates[:, 3:6])
    q = circle.coordinates.copy()
    q[:, :3] += np.einsum("fij,fjk,k->fi", turn, tilt - np.eye(3), [0, 0.93, 0])
    q[:, 3:6] = logarithm(turn @ tilt)
    outwards = replace(circle, coordinates=q)
    turning = measure.turning_frames(outwards)
    assert turning.mean() > 0.8  # the pelvis itself goes straight on
    expected = -np.degrees(lean[turning].mean())
    assert measure.lean_to_centre_deg(outwards) == pytest.approx(expected, abs=1.0)


def test_mirrored_turns_lean_alike():
    motion = gliding(radius=2.0, lean_deg=5.0)
    q = motion.coordinates.copy()
    q[:, [2, 3, 4]] *= -1  # in a mirror at z = 0
    right = replace(motion, coordinates=q)
    assert measure.lean_to_centre_deg(right) == pytest.approx(5.0, abs=0.3)
    assert measure.lean_left_deg(right) == pytest.approx(-5.0, abs=0.3)


def test_trunk_lean_and_twist():
    assert measure.trunk_lean_deg(WALK) == pytest.approx(0.0, abs=1e-6)
    assert measure.torso_twist_range_deg(WALK) == pytest.approx(0.0, abs=1e-6)
    phase = np.linspace(0, 4 * np.pi, WALK.frames)
    twisted = posed(abdomen_rotation=7 * np.sin(phase), thorax_rotation=3 * np.sin(phase))
    assert measure.torso_twist_range_deg(twisted) == pytest.approx(20.0, abs=0.01)


def test_arms():
    phase = np.linspace(0, 6 * np.pi, WALK.frames)
    motion = posed(
        shoulder_flexion_r=10 + 15 * np.sin(phase), elbow_flexion_r=20, elbow_flexion_l=40
    )
    assert measure.right_arm_swing_deg(motion) == pytest.approx(30, abs=0.01)
    assert measure.elbow_flexion_deg(motion) == pytest.approx(30)
    straight = posed(shoulder_flexion_r=30)
    reach = 100 * (0.29 + 0.26 + 0.09) * np.sin(30 * DEG)
    assert measure.right_hand_forward_mean_cm(straight) == pytest.approx(reach, abs=0.01)
    assert measure.right_hand_forward_range_cm(straight) == pytest.approx(0, abs=0.01)


def test_vertical_travel_ignores_a_steady_climb():
    phase = 2 * np.pi * np.arange(400) / 100
    motion = gliding(frames=400)
    q = motion.coordinates.copy()
    q[:, 1] += 0.02 * np.cos(phase)
    bobbing = replace(motion, coordinates=q)
    assert measure.com_vertical_range_cm(bobbing) == pytest.approx(4.0, abs=0.1)
    q = q.copy()
    q[:, 1] += np.linspace(0, 0.7, 400)
    assert measure.com_vertical_range_cm(replace(motion, coordinates=q)) == pytest.approx(
        4.0, abs=0.1
    )


def test_flight_is_told_by_forces_where_they_are_known():
    assert measure.flight_s(WALK) == 0.0
    contacts = WALK.contacts.copy()
    contacts[100:112] = contacts[200:220] = False
    assert measure.flight_s(replace(WALK, contacts=contacts)) == pytest.approx(0.16)
    forces = np.zeros((WALK.frames, 8, 3))
    forces[..., 1] = WALK.body.mass * 9.81 / 8
    forces[150:160] *= 0.01
    hop = replace(WALK, contact_forces=forces)
    assert measure.flight_s(hop) == pytest.approx(0.10)


def test_peak_force_is_the_mean_over_whole_stances():
    forces = np.zeros((WALK.frames, 8, 3))
    weight = WALK.body.mass * 9.81
    for columns, peak in ((slice(0, 4), 1.2), (slice(4, 8), 1.4)):
        forces[:, columns, 1] = WALK.contacts[:, columns] * weight * peak / 4
    found = measure.peak_normal_force_bw(replace(WALK, contact_forces=forces))
    assert 1.2 < found < 1.4
    assert np.isnan(measure.peak_normal_force_bw(WALK))


def test_slide_is_how_far_points_travel_while_they_touch():
    assert measure.slide_cm(WALK) == pytest.approx(0, abs=1e-6)
    motion = gliding(speed=1.0)
    contacts = motion.contacts.copy()
    contacts[100:151] = True
    assert measure.slide_cm(replace(motion, contacts=contacts)) == pytest.approx(50, abs=1e-6)


def test_style_distance_is_the_rms_of_mean_cycles():
    bent = posed(elbow_flexion_r=10, elbow_flexion_l=10)
    joints = 29 - 2  # toes are left out
    expected = np.sqrt(2 * 10**2 / joints)
    assert measure.style_distance_deg(bent, WALK) == pytest.approx(expected)
    assert measure.style_distance_deg(WALK, WALK) == 0
    later = WALK.window(50, 419)  # another part of the same walk
    assert measure.style_distance_deg(WALK, later) < 0.3
    sad, happy = posed(head_flexion=25), posed(head_flexion=-5)
    assert measure.closer_to_own(posed(head_flexion=20), sad, [happy, WALK])
    assert not measure.closer_to_own(posed(head_flexion=5), sad, [happy, WALK])
    assert measure.closer_to_own(WALK, sad, []) is None


def test_style_distance_of_motions_without_a_cycle():
    still, bent = gliding(), posed(gliding(), elbow_flexion_l=10)
    assert measure.style_distance_deg(still, bent) == pytest.approx(10 / np.sqrt(27))


def test_unobserved_joints_are_not_scored():
    seen = WALK.observed.copy()
    seen[Q["elbow_flexion_l"]] = False
    blind = replace(posed(elbow_flexion_l=50), observed=seen)
    assert measure.style_distance_deg(blind, WALK) == 0
    assert measure.joint_rms_deg(blind, WALK) == 0
    assert measure.joint_rms_deg(posed(head_flexion=27), WALK) == pytest.approx(27 / np.sqrt(27))
    assert np.isnan(measure.joint_rms_deg(WALK.window(0, 99), WALK))


@pytest.fixture(scope="module")
def feet():
    return to_constraints(footprints_of(WALK), WALK.body, WALK.frames, RATE)


def moved(x=0.0, y=0.0):
    q = WALK.coordinates.copy()
    q[:, 0] += x
    q[:, 1] += y
    return replace(WALK, coordinates=q)


def test_foot_errors_and_depth(feet):
    assert rows.foot_error_mm(WALK, feet) < 0.1
    assert rows.depth_mm(WALK, feet) < 0.1
    assert rows.foot_error_mm(moved(x=0.007), feet) == pytest.approx(7, abs=0.1)
    assert rows.depth_mm(moved(y=-0.004), feet) == pytest.approx(4, abs=0.1)
    allowed = replace(feet, clearance=np.full_like(feet.clearance, -0.01))
    assert rows.depth_mm(moved(y=-0.004), allowed, allowed=True) == pytest.approx(4, abs=0.1)
    free = replace(allowed, held=np.zeros_like(feet.held))
    assert rows.depth_mm(moved(y=-0.004), free, allowed=True) == 0
    sliding = replace(feet, sliding=feet.held)
    assert rows.foot_error_mm(moved(x=0.5), sliding) < 0.1
    assert rows.foot_error_mm(moved(y=0.003), sliding) == pytest.approx(3, abs=0.1)


def test_friction_cone(feet):
    forces = np.where(feet.held[..., None], [70.0, 100.0, 0.0], 0.0)
    assert rows.cone_excess_n(replace(WALK, contact_forces=forces), feet) == 0
    slippery = np.where(feet.held[..., None], [60.0, 100.0, 80.0], 0.0)
    assert rows.cone_excess_n(replace(WALK, contact_forces=slippery), feet) == pytest.approx(20)
    pulled = -forces
    assert rows.cone_excess_n(replace(WALK, contact_forces=pulled), feet) == pytest.approx(100)
    loose = np.where(feet.held[..., None], 0.0, [0.0, 30.0, 0.0])
    assert rows.cone_excess_n(replace(WALK, contact_forces=loose), feet) == pytest.approx(30)
    assert np.isnan(rows.cone_excess_n(WALK, feet))


def test_joint_ranges():
    ranges = edit_ranges(WALK, Edits(locked={"elbow_flexion_l": 0}))
    assert rows.range_excess_deg(WALK, ranges) == 0
    assert rows.range_excess_deg(posed(elbow_flexion_l=3), ranges) == pytest.approx(2.5)


def test_a_row_has_every_measured_column(feet):
    own = replace(WALK, provenance={"subject": "a"})
    same = replace(posed(head_flexion=20), provenance={"subject": "a"})
    other = replace(posed(head_flexion=-20), provenance={"subject": "b"})
    forces = np.where(feet.held[..., None], [0.0, 100.0, 0.0], 0.0)
    motion = replace(WALK, contact_forces=forces)
    row = rows.synthesis_measures(
        motion, feet, edit_ranges(WALK, Edits()), own=own, others=[same, other], captured=WALK
    )
    assert set(row) <= set(rows.SYNTHESIS_COLUMNS)
    assert set(measure.MEASURES) <= set(row)
    assert row["cone_kept"] is True
    assert row["joint_ranges_kept"] is True
    assert row["closer_to_own_style"] is True
    assert row["closer_to_own_subject"] is True
    assert row["joint_rms_to_captured_deg"] == 0


def sheet_row(**cells):
    known = {
        **{"id": "up", "experiment": None, "task": "ramp_up", "example": "walk"},
        **{"style": "initial", "mood": "sad", "footprints": FootprintSource(), "edits": Edits()},
        **{"first_frame": None, "last_frame": None, "others": (), "note": None},
        **{"row": 2, "folder": Path()},
    }
    return SynthesisRow(**known | cells)


def test_one_row_for_the_synthesis_and_each_baseline():
    row = sheet_row()
    plan = make_plan(row, WALK, *planned_footprints(row, WALK))
    own = replace(WALK, provenance={"subject": "a", "action": "walk"})
    reports = {
        "nio": {"status": "converged", "E": 5.0, "root_share_of_E_pct": 0.1, "cone_excess_n": 0.1},
        "warp": {"status": "converged", "iterations": 3},
    }
    motions = {"nio": WALK, "warp": WALK, "copied": plan.copied}
    found = rows.synthesis_rows(
        row, plan, motions, reports, "default", own=own, others=[], captured=None
    )
    assert [one["kind"] for one in found] == ["nio", "warp", "copied"]
    assert [one["status"] for one in found] == ["converged", "converged", "ok"]
    for one in found:
        assert set(one) <= set(rows.SYNTHESIS_COLUMNS)
        assert (one["subject"], one["action"], one["mood"]) == ("a", "walk", "sad")
    assert found[0]["E"] == 5.0
    assert found[0]["cone_kept"] is True
    assert "E" not in found[2]
    assert found[0]["lean_to_centre_deg"] is None  # a straight walk; JSON knows no nan
    json.dumps(found, allow_nan=False)


def test_footprints_that_failed_are_rows_with_their_reason():
    failed = {"status": "failed", "reason": "too far\ntoo high"}
    reports = {"nio": failed, "warp": failed}
    found = rows.synthesis_rows(
        sheet_row(), None, {}, reports, "default", own=WALK, others=[], captured=None
    )
    for one in found:
        assert (one["status"], one["reason"]) == ("failed", "too far; too high")
