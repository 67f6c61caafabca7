"""Ramp against level walking, on motions whose changes and forces are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motionstyle.body.layout import COORDINATE_INDEX
from motionstyle.evaluation import ramps
from motionstyle.evaluation.gait import foot_strikes
from synthetic_walk import make_walk

LEVEL = make_walk()
Q = COORDINATE_INDEX


def changed(**angles):
    q = LEVEL.coordinates.copy()
    for name, degrees in angles.items():
        q[:, Q[name]] += np.radians(degrees)
    return replace(LEVEL, coordinates=q)


def loaded(motion, forces):
    """The motion with total forces (F, 3), in body weights, shared by bearing points."""
    share = motion.contacts / np.maximum(motion.contacts.sum(axis=1, keepdims=True), 1)
    weight = motion.body.mass * 9.81
    return replace(motion, contact_forces=share[..., None] * forces[:, None] * weight)


def test_changes_of_angles_are_those_put_in():
    bent = changed(
        abdomen_flexion=0.0, hip_flexion_r=10, hip_flexion_l=20, knee_flexion_r=6, knee_flexion_l=8
    )
    row = ramps.ramp_row(bent, LEVEL, 8.0)
    strikes = {side: len(foot_strikes(LEVEL, side)) for side in "rl"}
    mean = (10 * strikes["r"] + 20 * strikes["l"]) / sum(strikes.values())
    assert row["direction"] == "up"
    assert row["hip_heel_strike_change_deg"] == pytest.approx(mean)
    assert 6 < row["knee_heel_strike_change_deg"] < 8
    assert 6 < row["knee_stance_change_deg"] < 8
    assert row["ankle_heel_strike_change_deg"] == pytest.approx(0, abs=1e-9)
    assert row["trunk_pitch_change_deg"] == pytest.approx(0, abs=1e-9)
    assert "support_moment_change_nm_per_kg" not in row
    assert np.isnan(row["mean_normal_error_pctbw"])
    assert set(row) <= set(ramps.RAMP_COLUMNS)


def test_a_pelvis_pitched_forward_pitches_the_trunk():
    q = LEVEL.coordinates.copy()
    q[:, Q["pelvis_rz"]] -= np.radians(7)
    row = ramps.ramp_row(replace(LEVEL, coordinates=q), LEVEL, -5.0)
    assert row["direction"] == "down"
    assert row["trunk_pitch_change_deg"] == pytest.approx(7, abs=1e-6)


@pytest.mark.parametrize("slope", [-10.0, 5.0])
def test_forces_that_carry_the_weight_obey_the_laws(slope):
    steady = np.tile([0.0, 1.0, 0.0], (LEVEL.frames, 1))
    laws = ramps.mean_forces(loaded(LEVEL, steady), slope)
    for name in ("tangential", "normal", "impulse"):
        assert laws[name] == pytest.approx(0, abs=1e-9)
    assert laws["momentum"] == pytest.approx(0, abs=1e-6)
    lifted = ramps.mean_forces(loaded(LEVEL, 1.1 * steady), slope)
    assert lifted["normal"] == pytest.approx(10 * np.cos(np.radians(slope)))
    assert lifted["tangential"] == pytest.approx(10 * np.sin(np.radians(slope)))


def test_a_motion_that_gains_speed_says_so():
    q = LEVEL.coordinates.copy()
    q[:, 0] += 0.5 * 0.3 * LEVEL.times**2
    faster = replace(LEVEL, coordinates=q)
    steady = np.tile([0.3 / 9.81, 1.0, 0.0], (LEVEL.frames, 1))
    laws = ramps.mean_forces(loaded(faster, steady), 0.0)
    assert laws["tangential"] == pytest.approx(laws["momentum"], rel=0.02)


def test_peak_force_and_support_moment_are_of_whole_stances():
    forces = np.tile([0.0, 1.0, 0.0], (LEVEL.frames, 1))
    heavy, light = loaded(LEVEL, 1.2 * forces), loaded(LEVEL, forces)

    def torques(motion):
        found = np.zeros((motion.frames, 35))
        size = 1.0 if motion is light else 2.0
        for name, share in (("hip", -10), ("knee", -20), ("ankle", -5)):
            joint = "ankle_dorsiflexion" if name == "ankle" else f"{name}_flexion"
            for side in "rl":
                found[:, Q[f"{joint}_{side}"]] = size * share
        return found

    row = ramps.ramp_row(heavy, light, 8.0, torques)
    assert row["peak_normal_force_change_pctbw"] == pytest.approx(20)
    assert row["support_moment_change_nm_per_kg"] == pytest.approx(35 / LEVEL.body.mass)
