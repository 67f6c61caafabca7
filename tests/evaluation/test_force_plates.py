"""Estimated against measured forces: exact agreement, known errors, and what is not compared."""

from dataclasses import replace

import numpy as np
import pytest

from motionstyle.evaluation.force_plates import (
    FORCE_PLATE_COLUMNS,
    FootForce,
    compared_frames,
    force_plate_rows,
)


@pytest.fixture
def pushed(plain_motion):
    """A motion whose right foot pushes in a smooth stance, and the plate that saw it."""
    frames = 60
    motion = plain_motion.window(0, frames - 1)
    t = motion.times
    span = t[-1]
    push = np.zeros((frames, 3))
    weight = motion.body.mass * 9.81
    push[:, 1] = weight * np.sin(np.pi * t / span) ** 2
    push[:, 0] = -0.2 * weight * np.sin(2 * np.pi * t / span)
    forces = np.zeros((frames, 8, 3))
    forces[:, 1] = push
    fine = np.linspace(0, span, 1200)
    plate = np.stack([np.interp(fine, t, push[:, a]) for a in range(3)], axis=1)
    return replace(motion, contact_forces=forces), FootForce(fine, plate)


def row(rows, component):
    return next(r for r in rows if r["component"] == component)


def test_equal_forces_agree(pushed):
    motion, plate = pushed
    rows = force_plate_rows(motion, {"r": plate}, "test")
    assert all(set(r) <= set(FORCE_PLATE_COLUMNS) for r in rows)
    vertical = row(rows, "vertical")
    assert vertical["rms_pctbw"] < 0.5
    assert vertical["correlation"] > 0.9999
    assert vertical["peak_plate_pctbw"] == pytest.approx(100, abs=1)
    assert vertical["impulse_plate_bws"] == pytest.approx(motion.times[-1] / 2, rel=0.03)
    assert row(rows, "fore_aft")["correlation"] > 0.999


def test_a_constant_error_is_its_rms(pushed):
    motion, plate = pushed
    forces = motion.contact_forces.copy()
    forces[:, 2, 1] += 0.1 * motion.body.mass * 9.81
    rows = force_plate_rows(replace(motion, contact_forces=forces), {"r": plate}, "test")
    assert row(rows, "vertical")["rms_pctbw"] == pytest.approx(10, abs=0.5)


def test_the_other_foot_is_compared_with_its_own_points(pushed):
    motion, plate = pushed
    rows = force_plate_rows(motion, {"l": plate}, "test")
    assert row(rows, "vertical")["rms_pctbw"] > 50
    assert row(rows, "vertical")["peak_estimated_pctbw"] == 0


def test_a_plate_nobody_stepped_on_is_a_row_with_a_reason(pushed):
    motion, plate = pushed
    quiet = FootForce(plate.times, np.zeros_like(plate.force))
    rows = force_plate_rows(
        replace(motion, contact_forces=np.zeros_like(motion.contact_forces)), {"r": quiet}, "test"
    )
    assert {r["status"] for r in rows} == {"not compared"}
    assert all("fewer than 5 frames" in r["reason"] for r in rows)


def test_frames_outside_the_record_are_not_judged(pushed):
    motion, plate = pushed
    half = len(plate.times) // 2
    short = FootForce(plate.times[:half], plate.force[:half])
    vertical = row(force_plate_rows(motion, {"r": short}, "test"), "vertical")
    assert vertical["seconds_compared"] < motion.times[-1] * 0.55


def test_a_step_beside_the_plates_is_not_judged_and_a_load_made_up_in_swing_is(pushed):
    """The left foot stands beside the plates first, and in swing bears what it should not."""
    motion, _plate = pushed
    weight = motion.body.mass * 9.81
    both = np.concatenate([np.linspace(0, weight, 15), np.full(45, weight)])
    nothing = np.zeros(60)
    beside = np.where(np.arange(60) < 12, 400.0, 0.0)  # ends while weight comes onto the plates
    assert not compared_frames(nothing, beside, both, weight).any()
    in_swing = np.where((np.arange(60) > 30) & (np.arange(60) < 40), 200.0, 0.0)
    judged = compared_frames(nothing, in_swing, both, weight)
    np.testing.assert_array_equal(np.flatnonzero(judged), np.arange(31, 40))


def test_a_stance_the_plate_saw_is_judged_whole(pushed):
    motion, _plate = pushed
    weight = motion.body.mass * 9.81
    seen = np.where((np.arange(60) > 20) & (np.arange(60) < 50), 500.0, 0.0)
    early = np.where((np.arange(60) > 15) & (np.arange(60) < 45), 500.0, 0.0)
    judged = compared_frames(seen, early, seen, weight)
    np.testing.assert_array_equal(np.flatnonzero(judged), np.arange(16, 50))


def test_a_wrong_mass_is_told_from_other_errors(pushed):
    motion, plate = pushed
    heavier = FootForce(plate.times, 1.3 * plate.force)
    vertical = row(force_plate_rows(motion, {"r": heavier}, "test"), "vertical")
    assert vertical["plate_over_estimate"] == pytest.approx(1.3, rel=0.01)
    assert vertical["rms_own_pctbw"] < 0.5
    assert vertical["rms_pctbw"] > 15
    weight = motion.body.mass * 9.81
    assert vertical["rms_n"] == pytest.approx(vertical["rms_pctbw"] * weight / 100)
