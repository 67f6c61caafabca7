"""Estimated against measured forces: exact agreement, known errors, and what is not compared."""

from dataclasses import replace

import numpy as np
import pytest

from motionstyle.evaluation.force_plates import FORCE_PLATE_COLUMNS, FootForce, force_plate_rows


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
