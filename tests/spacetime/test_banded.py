"""Banded normal equations against the same in dense form."""

import numpy as np
import pytest

from motionstyle.spacetime.banded import assemble_gradient, factor, laid_out, solve, spread
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


def dense_of(band):
    size = band.shape[1]
    found = np.zeros((size, size))
    for k in range(len(band)):
        index = np.arange(size - k)
        found[index + k, index] = found[index, index + k] = band[k, : size - k]
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
    return laid_out(blocks, np.zeros((controls, 4)))


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
    right = np.random.default_rng(4).standard_normal((basis.controls, N))
    found = solve(factor(banded_of(dense)), right)
    np.testing.assert_allclose(found.ravel(), np.linalg.solve(dense, right.ravel()), rtol=1e-6)


def test_a_matrix_that_is_not_positive_has_no_factor(dense):
    less = dense - 50 * np.eye(len(dense))
    assert factor(banded_of(less)) is None
    assert factor(banded_of(less + 1e12 * np.eye(len(dense)))) is not None
