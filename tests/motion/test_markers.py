"""Measured markers beside a motion: kept bit for bit, resampled, and absent where absent."""

import numpy as np
import pytest

from motionstyle.errors import MotionStyleError
from motionstyle.motion.markers import MarkerPaths, load_markers, save_markers


@pytest.fixture
def markers():
    rng = np.random.default_rng(1)
    t = np.arange(100) / 100.0
    smooth = np.stack([np.sin(2 * t), np.cos(3 * t), t], axis=1)[:, None] + rng.random((1, 4, 3))
    weights = np.ones((100, 4))
    weights[40:50, 2] = 0
    return MarkerPaths(
        names=("a", "b", "c", "d"),
        nodes=np.array([0, 1, 1, 5]),
        local=rng.random((4, 3)),
        measured=smooth + 0.001,
        smooth=smooth,
        weights=weights,
        rate_hz=100.0,
    )


def test_what_is_saved_comes_back(markers, tmp_path):
    save_markers(tmp_path / "m.npz", markers)
    again = load_markers(tmp_path / "m.npz")
    assert again.names == markers.names
    for name in ("nodes", "local", "measured", "smooth", "weights", "rate_hz"):
        np.testing.assert_array_equal(getattr(again, name), getattr(markers, name))
    save_markers(tmp_path / "none.npz", None)
    assert load_markers(tmp_path / "none.npz") is None


def test_another_rate_and_start_tell_the_same_paths(markers):
    slow = markers.at(30.0, 0.2, 20)
    times = 0.2 + np.arange(20) / 30
    expected = np.sin(2 * times) - np.sin(0.4)
    np.testing.assert_allclose(slow.smooth[:, 0, 0] - slow.smooth[0, 0, 0], expected, atol=2e-3)
    assert slow.measured.shape == (20, 4, 3)
    unseen = (times > 0.39) & (times < 0.5)
    assert (slow.weights[unseen, 2] == 0).all()
    assert (slow.weights[~unseen, 2] == 1).all()


def test_an_unreadable_file_says_what_to_do(tmp_path):
    (tmp_path / "m.npz").write_text("no archive")
    with pytest.raises(MotionStyleError, match=r"m\.npz: not a readable file of markers"):
        load_markers(tmp_path / "m.npz")
