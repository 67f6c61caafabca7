"""Banded normal equations against the same in dense form."""

import numpy as np
import pytest

from motionstyle.spacetime.banded import BandedHessian, assemble_gradient, solve, spread
from motionstyle.spacetime.splines import SplineBasis

N, FRAMES = 3, 13


@pytest.fixture(scope="module")
def basis():
    return SplineBasis.uniform(FRAMES, 30.0, 2.0)


@pytest.fixture(scope="module")
def design(basis):
    """Φ with u = Φ c, (F, 3N, K·N), built column by column from `evaluate`."""
    found = np.zeros((FRAMES, 3 * N, basis.controls * N))
    for k in range(basis.controls * N):
        unit = np.zeros(basis.controls * N)
        unit[k] = 1.0
        found[:, :, k] = np.concatenate(basis.evaluate(unit.reshape(-1, N)), axis=1)
    return found


@pytest.fixture(scope="module")
def hessians():
    """Symmetric positive definite, with small parts for the derivatives as in the real problem."""
    root = np.random.default_rng(1).standard_normal((FRAMES, 3 * N, 3 * N))
    root *= np.repeat([1.0, 1e-1, 1e-3], N)[:, None]
    return root @ root.swapaxes(1, 2)


def dense_of(banded):
    size = banded.band.shape[1]
    found = np.zeros((size, size))
    for k in range(len(banded.band)):
        index = np.arange(size - k)
        found[index + k, index] = found[index, index + k] = banded.band[k, : size - k]
    return found


@pytest.fixture(scope="module")
def dense(design, hessians):
    return np.einsum("fuk,fuv,fvl->kl", design, hessians, design)


def banded_of(dense):
    """The same by blocks between each control point and itself and the next three."""
    controls = len(dense) // N
    blocks = np.zeros((controls, 4, N, N))
    for k in range(controls):
        for e in range(min(4, controls - k)):
            blocks[k, e] = dense[k * N : (k + 1) * N, (k + e) * N : (k + e + 1) * N]
    return BandedHessian.of(blocks)


def test_the_band_is_the_dense_matrix(dense):
    np.testing.assert_allclose(dense_of(banded_of(dense)), dense, rtol=1e-12)


def test_the_gradient_is_the_dense_one(basis, design):
    gradients = np.random.default_rng(2).standard_normal((FRAMES, 3 * N))
    found = assemble_gradient(basis, gradients)
    np.testing.assert_allclose(found.ravel(), np.einsum("fuk,fu->k", design, gradients), rtol=1e-9)


def test_spread_and_gradient_are_each_other_s_transpose(basis, design):
    controls = np.random.default_rng(3).standard_normal((basis.controls, N))
    expected = np.einsum("fuk,k->fu", design, controls.ravel())
    np.testing.assert_allclose(spread(basis, controls), expected, rtol=1e-9, atol=1e-9)


def test_the_solution_is_the_dense_one(basis, dense):
    banded = banded_of(dense)
    added = np.linspace(0.5, 2.0, basis.controls * N)
    right = np.random.default_rng(4).standard_normal((basis.controls, N))
    factor = banded.factor(added)
    expected = np.linalg.solve(dense_of(banded) + np.diag(added), right.ravel())
    np.testing.assert_allclose(solve(factor, right).ravel(), expected, rtol=1e-7)
    again = banded.factor(added)
    np.testing.assert_array_equal(factor, again)  # the band itself is not overwritten


def test_a_matrix_that_is_not_positive_has_no_factor(dense):
    less = banded_of(dense - 50 * np.eye(len(dense)))
    assert less.factor() is None
    assert less.factor(1e12) is not None
