"""`Motion` refuses what is no motion, and cuts windows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motionstyle.body.layout import COORDINATE_INDEX
from motionstyle.errors import MotionStyleError
from motionstyle.motion.motion import KINDS


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_value_that_is_no_number_is_named_by_coordinate_and_frame(plain_motion, value):
    q = plain_motion.coordinates.copy()
    q[17, COORDINATE_INDEX["knee_flexion_l"]] = value
    with pytest.raises(MotionStyleError, match=r"motion plain: knee_flexion_l .* frame 17 \(1 "):
        replace(plain_motion, coordinates=q)


def test_the_first_of_several_is_named_and_all_are_counted(plain_motion):
    q = plain_motion.coordinates.copy()
    q[5:8, 3] = np.nan
    with pytest.raises(MotionStyleError, match=r"pelvis_rx .* frame 5 \(3 such values\)"):
        replace(plain_motion, coordinates=q)


@pytest.mark.parametrize(
    ("name", "cut"),
    [
        ("coordinates", np.s_[:, :34]),
        ("coordinates", np.s_[:-1]),
        ("contacts", np.s_[:-1]),
        ("contacts", np.s_[:, :7]),
        ("contact_normals", np.s_[..., :2]),
        ("contact_normals", np.s_[:-1]),
        ("contact_forces", np.s_[:, :7]),
        ("contact_forces", np.s_[:-1]),
        ("observed", np.s_[:34]),
    ],
)
def test_wrong_shapes_are_refused_by_name(plain_motion, name, cut):
    expected = "contacts" if (name, cut) == ("coordinates", np.s_[:-1]) else name
    with pytest.raises(MotionStyleError, match=f"motion plain: {expected} has shape .* expected"):
        replace(plain_motion, **{name: getattr(plain_motion, name)[cut]})


def test_no_frames_are_refused(plain_motion):
    empty = {
        name: getattr(plain_motion, name)[:0]
        for name in ("coordinates", "contacts", "contact_normals", "contact_forces")
    }
    with pytest.raises(MotionStyleError, match="motion plain: no frames"):
        replace(plain_motion, **empty)


def test_an_unknown_kind_is_refused(plain_motion):
    with pytest.raises(MotionStyleError, match=r"kind 'synthesised' is not one of .*captured"):
        replace(plain_motion, kind="synthesised")


@pytest.mark.parametrize("kind", ["captured", "planted", "nio", "warp", "shmm", "adapted"])
def test_the_six_kinds(plain_motion, kind):
    assert kind in KINDS
    assert replace(plain_motion, kind=kind).kind == kind


@pytest.mark.parametrize("rate", [0.0, -30.0, np.nan, np.inf])
def test_a_rate_that_is_none_is_refused(plain_motion, rate):
    with pytest.raises(MotionStyleError, match=r"motion plain: rate is .* Hz"):
        replace(plain_motion, rate_hz=rate)


def test_forces_may_be_unknown(plain_motion):
    assert replace(plain_motion, contact_forces=None).window(0, 3).contact_forces is None


def test_frames_and_times(plain_motion):
    assert plain_motion.frames == 241
    assert np.allclose(plain_motion.times, np.linspace(0, 2, 241), atol=1e-12)


def test_pose_starts_where_the_pelvis_is(plain_motion):
    pose = plain_motion.pose()
    assert pose.positions.shape == (241, 18, 3)
    assert np.array_equal(pose.positions[:, 0], plain_motion.coordinates[:, :3])


def test_window_keeps_both_ends_and_counts_rebranched_frames_anew(plain_motion):
    motion = replace(plain_motion, rebranched=(10, 11, 25, 40, 41))
    part = motion.window(10, 40)
    assert part.frames == 31
    # a jump at the window's first frame is a jump no more
    assert part.rebranched == (1, 15, 30)
    for name in ("coordinates", "contacts", "contact_normals", "contact_forces"):
        assert np.array_equal(getattr(part, name), getattr(motion, name)[10:41])
    assert np.array_equal(part.observed, motion.observed)
    assert part.times[0] == 0
