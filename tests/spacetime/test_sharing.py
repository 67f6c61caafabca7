"""Weight passes from foot to foot: its sum, its direction, and where nothing is known."""

import numpy as np
import pytest

from motionstyle.spacetime.sharing import expected_shares, smooth_step


def walking(lead=0):
    """One foot alone, both, the other alone, both, the first alone; 10 frames each."""
    bearing = np.zeros((50, 2), dtype=bool)
    bearing[:20, lead] = True
    bearing[10:40, 1 - lead] = True
    bearing[30:, lead] = True
    return bearing


@pytest.mark.parametrize("lead", [0, 1])
def test_weight_passes_to_the_foot_that_came_last(lead):
    share = expected_shares(walking(lead))
    np.testing.assert_allclose(share.sum(axis=1), 1)
    assert (share[:10, lead] == 1).all()
    assert (np.diff(share[9:21, lead]) <= 0).all()
    assert (np.diff(share[29:41, lead]) >= 0).all()
    assert share[14:16, lead].mean() == pytest.approx(0.5)
    assert share[10, lead] > 0.99
    assert share[19, lead] < 0.01


def test_feet_swap_with_their_columns():
    np.testing.assert_array_equal(expected_shares(walking(0))[:, ::-1], expected_shares(walking(1)))


def test_nothing_is_expected_where_markers_do_not_tell():
    bearing = walking()
    assert np.isnan(expected_shares(bearing[15:])[:5]).all()  # cut at the start
    assert np.isnan(expected_shares(bearing[:35])[30:]).all()  # and at the end
    assert np.isnan(expected_shares(np.ones((20, 2), dtype=bool))).all()  # standing
    same = np.zeros((30, 2), dtype=bool)
    same[:, 0] = True
    same[10:20, 1] = True  # a foot put down and lifted again
    assert np.isnan(expected_shares(same)[10:20]).all()
    landing = np.zeros((30, 2), dtype=bool)
    landing[10:] = True  # both feet at once out of the air
    assert np.isnan(expected_shares(landing)[10:]).all()
    assert (expected_shares(landing)[:10] == 0).all()


def test_the_smooth_step_starts_and_ends_flat():
    u = np.linspace(-0.5, 1.5, 201)
    values = smooth_step(u)
    slopes = np.gradient(values, u)
    assert values[0] == 0
    assert values[-1] == 1
    assert np.abs(slopes[[49, 50, 150, 151]]).max() < 0.05
    np.testing.assert_allclose(values + values[::-1], 1, atol=1e-12)
