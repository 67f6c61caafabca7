"""Sums over frames, in C and in NumPy, against dense algebra."""

import numpy as np
import pytest

from motionstyle.spacetime import frame_sums
from motionstyle.spacetime.frame_sums import SIZE, FrameSums, compiled_kernels, scatter
from motionstyle.spacetime.splines import SplineBasis

FRAMES, WIDE, FORCES = 9, 105, 32


@pytest.fixture(scope="module", params=["compiled", "numpy"])
def sums(request):
    library = compiled_kernels() if request.param == "compiled" else None
    if request.param == "compiled" and library is None:
        pytest.skip("no C compiler on this machine")
    bearing = np.random.default_rng(5).random((FRAMES, FORCES)) < 0.6
    bearing[1], bearing[2] = False, True
    return FrameSums(SplineBasis.uniform(FRAMES, 30.0, 2.0), bearing, library)


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


@pytest.fixture(scope="module")
def whole():
    """Stiff blocks over (u, λ) that λ balances to within a millionth, as root rows are."""
    rng = np.random.default_rng(6)
    rows = rng.standard_normal((FRAMES, 40, WIDE + FORCES)) * 10.0 ** rng.uniform(-1, 2, (40, 1))
    rows[:, :, SIZE:WIDE] *= np.repeat([1e-2, 1e-4], SIZE)
    return np.swapaxes(rows, 1, 2) @ rows + 1e-2 * np.eye(WIDE + FORCES)


def parts(whole):
    """λ's blocks as the Newton system has them: Gauss-Newton parts and the rest apart."""
    inner = np.ascontiguousarray(0.5 * whole[:, WIDE:, WIDE:])
    diagonal = np.einsum("fii->fi", whole[:, WIDE:, WIDE:]).copy()
    inner_rest = 0.5 * whole[:, WIDE:, WIDE:] - np.einsum("fi,ij->fij", diagonal, np.eye(FORCES))
    mixed = np.ascontiguousarray(np.swapaxes(whole[:, :WIDE, WIDE:], 1, 2))
    curved = 0.3 * mixed[:, :, :SIZE]
    gauss = mixed.copy()
    gauss[:, :, :SIZE] -= curved
    return (inner, diagonal), inner_rest, (gauss, np.ascontiguousarray(curved))


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
    blocks = sums.nothing()
    sums.add_products(matrices, blocks)
    rows = matrices @ design[:, :wide]
    expected = np.einsum("frk,frl->kl", rows, rows)
    np.testing.assert_allclose(dense_of(blocks), expected, atol=1e-12 * np.abs(expected).max())


def test_matrices_are_the_dense_ones_and_add_up(sums, design):
    rng = np.random.default_rng(2)
    hessians = rng.standard_normal((FRAMES, WIDE, WIDE))
    hessians += np.swapaxes(hessians, 1, 2).copy()
    blocks = sums.nothing()
    sums.add_matrices(hessians, blocks)
    sums.add_matrices(hessians, blocks)
    expected = 2 * np.einsum("fuk,fuv,fvl->kl", design, hessians, design, optimize=True)
    np.testing.assert_allclose(dense_of(blocks), expected, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("delta", [0.0, 0.3])
def test_what_is_left_is_the_schur_complement(sums, design, whole, delta):
    inner, _rest, mixed = parts(whole)
    blocks = sums.nothing()
    found = sums.eliminate(blocks, delta, inner, mixed)
    expected = 0.0
    for t, bears in enumerate(sums.bearing):
        at = np.flatnonzero(bears)
        own = (1 + delta) * inner[0][t] + np.diag(inner[1][t] + delta)
        cross = (1 + delta) * mixed[0][t, at]
        cross[:, :SIZE] += mixed[1][t, at]
        taken = cross.T @ np.linalg.solve(own[np.ix_(at, at)], cross)
        expected = expected - design[t].T @ taken @ design[t]
        np.testing.assert_allclose(found.half[t, at].T @ found.half[t, at], taken, rtol=1e-6,
                                   atol=1e-9 * np.abs(taken).max())  # fmt: skip
    np.testing.assert_allclose(dense_of(blocks), expected, atol=1e-9 * np.abs(expected).max())
    assert not found.half[1].any()


def test_the_small_difference_of_large_numbers_keeps_its_curvature(sums, design, whole):
    # H - C A^-1 C' is a millionth of H: with inverses instead of factors it loses its sign.
    inner, inner_rest, mixed = parts(whole)
    whole = whole.copy()
    whole[:, WIDE:, WIDE:] -= inner_rest  # what parts() leaves out of λ's own block
    blocks = sums.nothing()
    sums.add_matrices(np.ascontiguousarray(whole[:, :WIDE, :WIDE]), blocks)
    sums.eliminate(blocks, 0.0, inner, mixed)
    wanted = 0.0
    for t, bears in enumerate(sums.bearing):
        index = np.concatenate([np.arange(WIDE), WIDE + np.flatnonzero(bears)])
        inverse = np.linalg.inv(whole[t][np.ix_(index, index)])
        wanted = wanted + design[t].T @ np.linalg.inv(inverse[:WIDE, :WIDE]) @ design[t]
    np.testing.assert_allclose(
        dense_of(blocks), wanted, rtol=1e-4, atol=1e-4 * np.abs(wanted).max()
    )


def test_forward_and_backward_solve_the_inner_blocks(sums, whole):
    inner, _rest, mixed = parts(whole)
    found = sums.eliminate(sums.nothing(), 0.2, inner, mixed)
    right = np.random.default_rng(6).standard_normal((FRAMES, FORCES, 2))
    answer = found.backward(found.forward(right))
    for t, bears in enumerate(sums.bearing):
        at = np.flatnonzero(bears)
        own = (1.2 * inner[0][t] + np.diag(inner[1][t] + 0.2))[np.ix_(at, at)]
        np.testing.assert_allclose(own @ answer[t, at], right[t, at], atol=1e-6)
        assert not np.delete(answer[t], at, axis=0).any()


def test_a_block_that_is_not_finite_is_told(sums, whole):
    inner, _rest, mixed = parts(whole)
    inner[0][0, sums.at[0, 0], sums.at[0, 0]] = np.nan
    with pytest.raises(FloatingPointError, match="not finite"):
        sums.eliminate(sums.nothing(), 0.0, inner, mixed)


def test_arrays_with_gaps_are_refused_not_misread(sums):
    if sums.library is None:
        pytest.skip("NumPy takes them")
    gaps = np.zeros((FRAMES, 24, 2 * WIDE))[:, :, ::2]
    with pytest.raises(ValueError, match="contiguous"):
        sums.add_products(gaps, sums.nothing())


@pytest.mark.parametrize("compiler", [True, False])
def test_numbers_go_to_their_places(monkeypatch, compiler):
    if not compiler:
        monkeypatch.setattr(frame_sums, "compiled_kernels", lambda: None)
    to = np.zeros((2, 2, 3))
    scatter(np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([4, 0]), to)
    assert to.tolist() == [[[2, 0, 0], [0, 1, 0]], [[4, 0, 0], [0, 3, 0]]]
