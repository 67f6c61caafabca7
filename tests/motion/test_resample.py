"""Changing rates: exact on smooth signals, free of aliases, sound across re-branched frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motionstyle.body.layout import COORDINATE_INDEX, COORDINATES
from motionstyle.body.rotations import exponential, logarithm, unroll
from motionstyle.errors import MotionStyleError
from motionstyle.motion.motion import Motion
from motionstyle.motion.resample import lowpass, resample

KNEE = COORDINATE_INDEX["knee_flexion_r"]


def motion_of(plain_motion, coordinates, rate, **changes) -> Motion:
    """A motion with these coordinates (F, 35); contacts all false unless given."""
    frames = len(coordinates)
    normals = np.zeros((frames, 8, 3))
    normals[..., 1] = 1.0
    values = {"contacts": np.zeros((frames, 8), dtype=bool), "contact_forces": None} | changes
    return replace(
        plain_motion, coordinates=coordinates, rate_hz=rate, contact_normals=normals, **values
    )


def sine(hertz, rate, seconds=4.0):
    t = np.arange(round(seconds * rate) + 1) / rate
    q = np.zeros((len(t), len(COORDINATES)))
    q[:] = np.sin(2 * np.pi * hertz * t[:, None] + np.arange(len(COORDINATES)))
    q[:, 3:6] *= 0.8
    return t, q


def turning(rate, seconds=3.0, turns=1.6, wobble_hz=0.7):
    """Coordinates of a pelvis that turns left by more than once, and its matrices by time."""

    def matrices(t):
        yaw = 2 * np.pi * turns * t / seconds
        nod = 0.15 * np.sin(2 * np.pi * wobble_hz * t)
        about_y = exponential(yaw[:, None] * np.array([0.0, 1.0, 0.0]))
        return about_y @ exponential(nod[:, None] * np.array([0.0, 0.0, 1.0]))

    t = np.arange(round(seconds * rate) + 1) / rate
    q = np.zeros((len(t), len(COORDINATES)))
    q[:, 3:6], jumps = unroll(logarithm(matrices(t)))
    assert jumps
    return q, tuple(jumps), matrices


def angle_between(a, b):
    """Angles (rad) between rotation matrices."""
    return np.linalg.norm(logarithm(np.swapaxes(a, -1, -2) @ b), axis=-1)


def test_up_a_sine_is_exact(plain_motion):
    _, q = sine(1.0, 30)
    result = resample(motion_of(plain_motion, q, 30.0), 120.0)
    _, expected = sine(1.0, 120)
    assert result.rate_hz == 120.0
    assert result.frames == 481
    # error of a cubic spline: of order (2π/30)⁴/384 = 5e-6 inside, larger at the ends
    error = np.abs(result.coordinates - expected)
    assert error[40:-40].max() < 2e-5
    assert error.max() < 1e-3


def test_down_a_slow_sine_is_exact(plain_motion):
    _, q = sine(1.0, 120)
    result = resample(motion_of(plain_motion, q, 120.0), 30.0)
    _, expected = sine(1.0, 30)
    assert result.frames == 121
    error = np.abs(result.coordinates - expected)
    assert error[15:-15].max() < 1e-4  # |H|² of the filter at 1 of 12 Hz is 1 - 4.8e-5
    assert error.max() < 0.02


def test_down_what_would_alias_is_gone(plain_motion):
    # 25 Hz sampled at 30 Hz would look like 5 Hz of full size
    _, fast = sine(25.0, 120)
    naive = fast[::4]
    assert np.abs(naive[15:-15]).max() > 0.7
    result = resample(motion_of(plain_motion, fast, 120.0), 30.0)
    assert np.abs(result.coordinates[15:-15]).max() < 0.06


def test_down_what_would_alias_is_gone_in_a_rebranched_motion_too(plain_motion):
    q, jumps, _ = turning(120.0)
    t = np.arange(len(q)) / 120
    q[:, KNEE] = q[:, 2] = np.sin(2 * np.pi * 25 * t + 0.3)
    result = resample(motion_of(plain_motion, q, 120.0, rebranched=jumps), 30.0)
    assert np.abs(result.coordinates[15:-15, [2, KNEE]]).max() < 0.06


def test_down_a_trembling_pelvis_is_calmed_in_a_rebranched_motion_too(plain_motion):
    q, jumps, matrices = turning(120.0)
    t = np.arange(len(q)) / 120
    tremble = exponential(0.1 * np.sin(2 * np.pi * 25 * t)[:, None] * np.array([1.0, 0.0, 0.0]))
    q[:, 3:6], jumps = unroll(logarithm(matrices(t) @ tremble))
    result = resample(motion_of(plain_motion, q, 120.0, rebranched=tuple(jumps)), 30.0)
    error = angle_between(exponential(result.coordinates[:, 3:6]), matrices(result.times))
    assert error[15:-15].max() < 0.01


def test_the_same_rate_is_the_same_motion(plain_motion):
    assert resample(plain_motion, 120.0) is plain_motion


@pytest.mark.parametrize("rate", [30.0, 100.0, 240.0])
def test_the_time_span_stays(plain_motion, rate):
    result = resample(plain_motion, rate)
    assert result.times[0] == 0
    assert 0 <= plain_motion.times[-1] - result.times[-1] < 1 / rate
    assert result.id == plain_motion.id
    assert result.provenance == plain_motion.provenance


@pytest.mark.parametrize("rate", [30.0, 50.0, 300.0])
def test_contacts_and_normals_are_those_of_the_nearest_frame(plain_motion, rate):
    result = resample(plain_motion, rate)
    for frame, time in enumerate(result.times):
        distance = np.abs(plain_motion.times - time)
        nearest = np.flatnonzero(distance < distance.min() + 1e-9)
        assert any(
            np.array_equal(result.contacts[frame], plain_motion.contacts[k])
            and np.array_equal(result.contact_normals[frame], plain_motion.contact_normals[k])
            for k in nearest
        )
    assert result.contacts.dtype == bool


def test_forces_are_interpolated_linearly(plain_motion):
    result = resample(plain_motion, 240.0)
    forces = plain_motion.contact_forces
    assert np.allclose(result.contact_forces[::2], forces, atol=1e-9)
    assert np.allclose(result.contact_forces[1::2], (forces[1:] + forces[:-1]) / 2, atol=1e-9)


@pytest.mark.parametrize("rate", [30.0, 120.0, 200.0])
def test_a_rebranched_motion_stays_continuous_in_rotation(plain_motion, rate):
    q, jumps, matrices = turning(60.0)
    result = resample(motion_of(plain_motion, q, 60.0, rebranched=jumps), rate)
    turned = exponential(result.coordinates[:, 3:6])
    largest = 1.2 * 2 * np.pi * 1.6 / 3 / rate + 0.01
    assert angle_between(turned[1:], turned[:-1]).max() < largest
    assert angle_between(turned, matrices(result.times))[3:-3].max() < 2e-3
    # the coordinates themselves do jump, once, and the motion says where
    steps = np.linalg.norm(np.diff(result.coordinates[:, 3:6], axis=0), axis=1)
    assert list(result.rebranched) == [i + 1 for i in np.flatnonzero(steps > np.pi)]
    assert len(result.rebranched) == len(jumps)


def test_joints_of_a_rebranched_motion_are_resampled_like_any_other(plain_motion):
    q, jumps, _ = turning(60.0)
    t = np.arange(len(q)) / 60
    joints = [i for i in range(len(COORDINATES)) if not 3 <= i < 6]
    q[:, joints] = 0.4 * np.sin(2 * np.pi * t[:, None] + np.arange(len(joints)))
    turned = resample(motion_of(plain_motion, q, 60.0, rebranched=jumps), 100.0)
    q[:, 3:6] = 0
    plain = resample(motion_of(plain_motion, q, 60.0), 100.0)
    assert np.allclose(turned.coordinates[:, joints], plain.coordinates[:, joints], atol=1e-9)


def test_a_rebranched_motion_of_an_odd_rate_ends_in_time(plain_motion):
    # the last new time exceeds the last old one by less than rounding lets one see
    q, jumps, _ = turning(29.97, seconds=3.0)
    q, jumps = q[:82], tuple(j for j in jumps if j < 82)
    assert jumps
    assert 90 / 33.3 > 81 / 29.97
    result = resample(motion_of(plain_motion, q, 29.97, rebranched=jumps), 33.3)
    assert result.frames == 91


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_too_few_frames_are_refused(plain_motion, frames):
    with pytest.raises(MotionStyleError, match=f"motion plain: {frames} frames are too few"):
        resample(plain_motion.window(0, frames - 1), 30.0)


@pytest.mark.parametrize("rate", [0.0, -1.0, np.nan, np.inf])
def test_a_rate_that_is_none_is_refused(plain_motion, rate):
    with pytest.raises(MotionStyleError, match="motion plain: cannot resample to"):
        resample(plain_motion, rate)


def test_lowpass_keeps_phase_and_halves_at_the_cutoff():
    t = np.arange(1200) / 120.0
    slow, edge = np.sin(2 * np.pi * 1.0 * t), np.sin(2 * np.pi * 12.0 * t)
    inside = slice(120, -120)
    assert np.allclose(lowpass(slow, 120.0, 12.0)[inside], slow[inside], atol=1e-4)
    assert np.allclose(lowpass(edge, 120.0, 12.0)[inside], edge[inside] / 2, atol=1e-3)


def test_lowpass_passes_constants_and_ramps_to_their_ends():
    values = np.column_stack([np.full(200, 3.0), np.linspace(0, 5, 200)])
    assert np.allclose(lowpass(values, 100.0, 6.0), values, atol=1e-6)


def test_lowpass_leaves_short_and_slow_sequences_alone():
    values = np.random.default_rng(0).normal(size=(9, 2))
    assert np.array_equal(lowpass(values, 100.0, 6.0), values)
    longer = np.random.default_rng(0).normal(size=(50, 2))
    assert np.array_equal(lowpass(longer, 10.0, 4.5), longer)
    assert not np.allclose(lowpass(longer, 10.0, 4.4), longer)
