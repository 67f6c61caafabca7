"""Sums over frames, in C and in NumPy, against dense algebra."""

import numpy as np
import pytest

from motionstyle.spacetime import kernels
from motionstyle.spacetime.frame_sums import Curvature, ForceBlocks, FrameSums
from motionstyle.spacetime.kernels import SIZE, compiled_kernels, scatter
from motionstyle.spacetime.splines import SplineBasis

FRAMES, WIDE, FORCES = 9, 105, 32
LEAST = 1e-2  # of λ's diagonal, as the barrier's


@pytest.fixture(scope="module")
def bearing():
    found = np.random.default_rng(5).random((FRAMES, FORCES)) < 0.6
    found[1], found[2] = False, True
    return found


@pytest.fixture(scope="module", params=["compiled", "numpy"])
def sums(request, bearing):
    compiled = request.param == "compiled"
    if compiled and compiled_kernels() is None:
        pytest.skip("no C compiler on this machine")
    return FrameSums(SplineBasis.uniform(FRAMES, 30.0, 2.0), bearing, compiled=compiled)


@pytest.fixture(scope="module")
def design(sums):
    """Φ with u = Φ c, (F, 105, K·35), built column by column from `evaluate`."""
    controls = sums.basis.controls
    found = np.zeros((FRAMES, WIDE, controls * SIZE))
    for k in range(controls * SIZE):
        unit = np.zeros(controls * SIZE)
        unit[k] = 1.0
        found[:, :, k] = np.concatenate(sums.basis.evaluate(unit.reshape(-1, SIZE)), axis=1)
    return found


def stiff(rows):
    """Blocks over (u, λ) that λ balances but for a small rest, as it does root rows."""
    rng = np.random.default_rng(6)
    found = rng.standard_normal((FRAMES, rows, WIDE + FORCES))
    found *= 10.0 ** rng.uniform(-1, 2, (rows, 1))
    found[:, :, SIZE:WIDE] *= np.repeat([1e-2, 1e-4], SIZE)
    least = LEAST * np.repeat([1.0, 1e-4, 1e-8, 1.0], [SIZE, SIZE, SIZE, FORCES])
    return np.swapaxes(found, 1, 2) @ found + np.diag(least)


@pytest.fixture(scope="module")
def whole():
    return stiff(rows=40)


def parts(whole):
    """λ's blocks as the Newton system has them; together at δ = 0 those of `whole`."""
    mixed = np.ascontiguousarray(np.swapaxes(whole[:, :WIDE, WIDE:], 1, 2))
    place = 0.3 * mixed[:, :, :SIZE]
    mixed[:, :, :SIZE] -= place
    inner = whole[:, WIDE:, WIDE:] - LEAST * np.eye(FORCES)
    return ForceBlocks(inner, np.full((FRAMES, FORCES), LEAST), mixed, place)


def dense_of(blocks):
    controls = len(blocks)
    found = np.zeros((controls, SIZE, controls + 3, SIZE))
    for k in range(controls):
        for e in range(4):
            found[k, :, k + e] = blocks[k, e, :SIZE, :SIZE]
    upper = np.triu(found[:, :, :controls].reshape(controls * SIZE, -1))
    return upper + np.triu(upper, 1).T


@pytest.mark.parametrize("wide", [WIDE, SIZE])
def test_products_are_the_dense_ones(sums, design, wide):
    matrices = np.random.default_rng(1).standard_normal((FRAMES, 24, wide))
    matrices[1::2, ::3] = 0.0  # rows of what does not count
    matrices[2] = 0.0
    blocks = sums.nothing()
    sums.add_products(matrices, blocks)
    rows = matrices @ design[:, :wide]
    expected = np.einsum("frk,frl->kl", rows, rows)
    np.testing.assert_allclose(dense_of(blocks), expected, atol=1e-12 * np.abs(expected).max())


def curvature_of(hessians):
    """Full matrices as numbers of one triangle; those over q, which do not count, are spoilt."""
    pattern = np.triu_indices(WIDE)
    numbers = hessians[:, *pattern]
    numbers[:, (pattern[0] < SIZE) & (pattern[1] < SIZE)] = np.nan
    place = hessians[:, :SIZE, :SIZE]
    none = np.zeros((len(hessians), SIZE))
    return Curvature(np.ascontiguousarray(numbers), pattern, np.ascontiguousarray(place), none)


def test_curvatures_are_the_dense_ones_and_add_up(sums, design):
    rng = np.random.default_rng(2)
    hessians = rng.standard_normal((FRAMES, WIDE, WIDE))
    hessians += np.swapaxes(hessians, 1, 2).copy()
    np.testing.assert_array_equal(curvature_of(hessians).dense(), hessians)
    blocks = sums.nothing()
    sums.add_curvature(curvature_of(hessians), blocks)
    sums.add_curvature(curvature_of(hessians), blocks)
    expected = 2 * np.einsum("fuk,fuv,fvl->kl", design, hessians, design, optimize=True)
    np.testing.assert_allclose(dense_of(blocks), expected, atol=1e-12 * np.abs(expected).max())


def test_diagonals_are_those_of_the_dense_ones(sums, design):
    values = np.random.default_rng(8).standard_normal((FRAMES, SIZE))
    blocks, joints = sums.nothing(), np.arange(SIZE)
    blocks[:, :, joints, joints] += sums.diagonals(values)
    expected = np.einsum("fuk,fu,ful->kl", design[:, :SIZE], values, design[:, :SIZE])
    np.testing.assert_allclose(dense_of(blocks), expected, atol=1e-12 * np.abs(expected).max())


def test_the_band_is_the_dense_matrix_with_what_is_added(sums):
    rng = np.random.default_rng(3)
    blocks = sums.nothing()
    for k in range(sums.basis.controls):
        for e in range(min(4, sums.basis.controls - k)):
            blocks[k, e, :SIZE, :SIZE] = rng.standard_normal((SIZE, SIZE))
    shift, dense = rng.standard_normal((len(blocks), 4)), dense_of(blocks)
    size = len(dense)
    added = rng.standard_normal(size)
    for k, e in np.ndindex(shift.shape):
        if k + e < len(blocks):
            lines = np.arange(SIZE)
            dense[(k + e) * SIZE + lines, k * SIZE + lines] += shift[k, e]
    dense[np.arange(size), np.arange(size)] += added
    band = sums.banded(blocks, shift, added)
    assert band.shape == (4 * SIZE, size)
    assert band.flags.f_contiguous
    for k in range(4 * SIZE):
        np.testing.assert_allclose(band[k, : size - k], np.diagonal(dense, -k), atol=1e-12)


@pytest.mark.parametrize("delta", [0.0, 0.3])
def test_what_is_taken_out_is_what_dense_algebra_takes(sums, bearing, design, whole, delta):
    forces, blocks = parts(whole), sums.nothing()
    found = sums.eliminate(blocks, delta, forces)
    expected = 0.0
    for t, bears in enumerate(bearing):
        at = np.flatnonzero(bears)
        own = (1 + delta) * forces.inner[t] + np.diag(forces.diagonal[t] + delta)
        cross = (1 + delta) * forces.mixed[t, at]
        cross[:, :SIZE] += forces.mixed_place[t, at]
        taken = cross.T @ np.linalg.solve(own[np.ix_(at, at)], cross)
        expected = expected - design[t].T @ taken @ design[t]
        most = np.abs(taken).max(initial=0.0)
        np.testing.assert_allclose(found.half[t, at].T @ found.half[t, at], taken, atol=1e-8 * most)
    np.testing.assert_allclose(dense_of(blocks), expected, atol=1e-8 * np.abs(expected).max())
    assert not found.half[1].any()


def schur_complements(bearing, design, whole):
    wanted = 0.0
    for t, bears in enumerate(bearing):
        index = np.concatenate([np.arange(WIDE), WIDE + np.flatnonzero(bears)])
        inverse = np.linalg.inv(whole[t][np.ix_(index, index)])
        wanted = wanted + design[t].T @ np.linalg.inv(inverse[:WIDE, :WIDE]) @ design[t]
    return wanted


def test_what_is_left_is_the_schur_complement(sums, bearing, design, whole):
    blocks = sums.nothing()
    sums.add_curvature(curvature_of(whole[:, :WIDE, :WIDE]), blocks)
    sums.eliminate(blocks, 0.0, parts(whole))
    wanted = schur_complements(bearing, design, whole)
    np.testing.assert_allclose(
        dense_of(blocks), wanted, rtol=1e-4, atol=1e-4 * np.abs(wanted).max()
    )


def test_a_small_difference_of_large_numbers_is_kept(sums, design):
    # λ can balance all rows, so that less than a ten-thousandth of H is left.
    every = FrameSums(sums.basis, np.full((FRAMES, FORCES), True), compiled=bool(sums.library))
    whole = stiff(rows=30)
    blocks = every.nothing()
    every.add_curvature(curvature_of(whole[:, :WIDE, :WIDE]), blocks)
    large = np.abs(blocks).max()
    every.eliminate(blocks, 0.0, parts(whole))
    wanted = schur_complements(np.full((FRAMES, FORCES), True), design, whole)
    most = np.abs(wanted).max()
    assert most < 1e-4 * large
    np.testing.assert_allclose(dense_of(blocks), wanted, atol=1e-7 * most)  # inverses: 1e-6


def test_forward_and_backward_solve_the_inner_blocks(sums, bearing, whole):
    forces = parts(whole)
    found = sums.eliminate(sums.nothing(), 0.2, forces)
    right = np.random.default_rng(6).standard_normal((FRAMES, FORCES, 2))
    answer = found.backward(found.forward(right))
    for t, bears in enumerate(bearing):
        at = np.flatnonzero(bears)
        own = (1.2 * forces.inner[t] + np.diag(forces.diagonal[t] + 0.2))[np.ix_(at, at)]
        np.testing.assert_allclose(own @ answer[t, at], right[t, at], atol=1e-6)
        assert not np.delete(answer[t], at, axis=0).any()


def test_a_block_that_is_not_finite_is_told(sums, whole):
    forces = parts(whole)
    forces.inner[0, sums.at[0, 0], sums.at[0, 0]] = np.nan
    with pytest.raises(FloatingPointError, match="not finite"):
        sums.eliminate(sums.nothing(), 0.0, forces)


def test_arrays_with_gaps_are_refused_not_misread(sums):
    if sums.library is None:
        pytest.skip("NumPy takes them")
    gaps = np.zeros((FRAMES, 24, 2 * WIDE))[:, :, ::2]
    with pytest.raises(ValueError, match="contiguous"):
        sums.add_products(gaps, sums.nothing())


@pytest.mark.parametrize("compiler", [True, False])
def test_numbers_go_to_their_places(monkeypatch, compiler):
    if not compiler:
        monkeypatch.setattr(kernels, "compiled_kernels", lambda: None)
    to = np.zeros((2, 2, 3))
    scatter(np.array([[1.0, 2.0, 9.0], [3.0, 4.0, 9.0]]), np.array([4, 0]), to)
    assert to.tolist() == [[[2, 0, 0], [0, 1, 0]], [[4, 0, 0], [0, 3, 0]]]
