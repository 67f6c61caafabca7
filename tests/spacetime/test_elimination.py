"""Elimination of λ against dense algebra, where numbers are small and where they are not."""

import numpy as np
import pytest

from motionstyle.spacetime.elimination import eliminate

FRAMES, WIDE, FORCES = 3, 105, 32


@pytest.fixture
def blocks():
    """Stiff blocks that λ balances to within a millionth, as root rows are."""
    rng = np.random.default_rng(5)
    rows = rng.standard_normal((FRAMES, 40, WIDE + FORCES)) * 10.0 ** rng.uniform(-1, 2, (40, 1))
    whole = np.swapaxes(rows, 1, 2) @ rows + 1e-2 * np.eye(WIDE + FORCES)
    bearing = rng.random((FRAMES, FORCES)) < 0.6
    bearing[1] = False
    return whole, bearing


def test_what_is_left_is_the_schur_complement(blocks):
    whole, bearing = blocks
    at = [np.flatnonzero(row) for row in bearing]
    hessian = whole[:, :WIDE, :WIDE].copy()
    found = eliminate(hessian, whole[:, WIDE:, WIDE:], whole[:, :WIDE, WIDE:], at)
    for t, chosen in enumerate(at):
        index = np.concatenate([np.arange(WIDE), WIDE + chosen])
        inverse = np.linalg.inv(whole[t][np.ix_(index, index)])
        wanted = np.linalg.inv(inverse[:WIDE, :WIDE])
        np.testing.assert_allclose(hessian[t], wanted, rtol=1e-4, atol=1e-4 * np.abs(wanted).max())
    assert not found.half[1].any()


def test_forward_and_backward_solve_the_inner_blocks(blocks):
    whole, bearing = blocks
    at = [np.flatnonzero(row) for row in bearing]
    inner = whole[:, WIDE:, WIDE:]
    found = eliminate(whole[:, :WIDE, :WIDE].copy(), inner, whole[:, :WIDE, WIDE:], at)
    right = np.random.default_rng(6).standard_normal((FRAMES, FORCES, 2))
    answer = found.backward(found.forward(right))
    for t, chosen in enumerate(at):
        np.testing.assert_allclose(
            inner[t][np.ix_(chosen, chosen)] @ answer[t, chosen], right[t, chosen], atol=1e-6
        )
        assert not np.delete(answer[t], chosen, axis=0).any()


def test_a_block_that_is_not_finite_is_told(blocks):
    whole, bearing = blocks
    at = [np.flatnonzero(row) for row in bearing]
    inner = whole[:, WIDE:, WIDE:].copy()
    inner[0, at[0][0], at[0][0]] = np.nan
    with pytest.raises(FloatingPointError, match="not finite"):
        eliminate(whole[:, :WIDE, :WIDE].copy(), inner, whole[:, :WIDE, WIDE:], at)
