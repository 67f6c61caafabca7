"""The two models of one set of pairs: one-class SVM and kernel PCA (specification §6).

k(p, q) = exp(−Γ‖p − q‖²). With I patterns: f_s(p) = Σ α_i k(p_i, p) − ρ; z(p) = Φ(p) − mean Φ,
its leakage is what z has outside the span of the O_c leading axes,
leak(p) = ‖z‖² − Σ_{i≤O_c} z_i², and the relative leakage is leak(p)/‖z‖².
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.spatial.distance import cdist, pdist
from sklearn.svm import OneClassSVM

from motionstyle.errors import MotionStyleError

Array = NDArray[np.float64]
FEWEST_PATTERNS = 3


@dataclass(frozen=True)
class Scaling:
    """Means and deviations that standardise each feature."""

    mean: Array
    deviation: Array

    def apply(self, patterns: Array) -> Array:
        """Return standardised patterns (I, n)."""
        return (patterns - self.mean) / self.deviation


@dataclass(frozen=True)
class StyleModel:
    """One-class SVM and kernel PCA of one set.

    Attributes
    ----------
    name : the set.
    scaling : of the features, from the training patterns.
    patterns : standardised training patterns, (I, n).
    gamma, svm_gamma : Γ of kernel PCA and of the SVM, on standardised features.
    alphas, rho : of the SVM, (I,); Σ α = 1.
    axes : β, coefficients of the leading unit axes of kernel PCA, (I, O_c).
    column_means, grand_mean : of the Gram matrix, to centre new patterns.
    """

    name: str
    scaling: Scaling
    patterns: Array
    gamma: float
    svm_gamma: float
    alphas: Array
    rho: float
    axes: Array
    column_means: Array
    grand_mean: float

    def kernel(self, patterns: Array, gamma: float) -> Array:
        """Return k between patterns (J, n) in raw features and the training ones, (J, I)."""
        scaled = self.scaling.apply(np.atleast_2d(patterns))
        return np.exp(-gamma * cdist(scaled, self.patterns, "sqeuclidean"))

    def svm_scores(self, patterns: Array) -> Array:
        """Return f_s of patterns (J, n), (J,); at least 0 inside."""
        return self.kernel(patterns, self.svm_gamma) @ self.alphas - self.rho

    def leakages(self, patterns: Array) -> tuple[Array, Array]:
        """Return leak(p) and the relative leakage of patterns (J, n), both (J,)."""
        kernel = self.kernel(patterns, self.gamma)
        return kernel_leakages(kernel, self.axes, self.column_means, self.grand_mean)


def kernel_leakages(
    kernel: Array, axes: Array, column_means: Array, grand_mean: float
) -> tuple[Array, Array]:
    """Return leak(p) and the relative leakage (J,) from the kernel (J, I) with k(p, p) = 1."""
    means = kernel.mean(axis=1)
    norms = 1.0 - 2 * means + grand_mean
    centred = kernel - means[:, None] - column_means + grand_mean
    leak = np.maximum(norms - ((centred @ axes) ** 2).sum(axis=1), 0.0)
    return leak, np.clip(leak / np.maximum(norms, 1e-300), 0.0, 1.0)


def fit_scaling(patterns: Array, name: str, standardise: bool = True) -> Scaling:
    """Return the scaling of features from training patterns (I, n).

    Raises
    ------
    MotionStyleError
        If a feature is not a number or does not vary.
    """
    if not np.isfinite(patterns).all():
        row, column = np.argwhere(~np.isfinite(patterns))[0]
        raise MotionStyleError(f"set {name}: feature {column} of pattern {row} is not a number")
    deviation = patterns.std(axis=0)
    flat = np.flatnonzero(deviation <= 1e-10 * np.maximum(np.abs(patterns).max(axis=0), 1e-9))
    if len(flat):
        raise MotionStyleError(
            f"set {name}: feature {flat[0]} has no variance over {len(patterns)} patterns, so it "
            "cannot be standardised; the pairs seem to be copies of one"
        )
    if not standardise:
        return Scaling(np.zeros(patterns.shape[1]), np.ones(patterns.shape[1]))
    return Scaling(patterns.mean(axis=0), deviation)


def median_squared_distance(patterns: Array) -> float:
    """Return the median squared distance of patterns (I, n): the unit of kernel widths."""
    return float(np.median(pdist(patterns, "sqeuclidean")))


def fit_model(
    patterns: Array,
    name: str,
    *,
    relative_width: float,
    cutoff: int,
    svm_width: float | None = None,
    nu: float | None = None,
) -> StyleModel:
    """Return both models of training patterns (I, n) in raw features.

    Parameters
    ----------
    relative_width : Γ of kernel PCA times the median squared distance of standardised patterns.
    svm_width : the same of the SVM; None for that of kernel PCA.
    cutoff : O_c; at most I − 1 axes are there.
    nu : of the SVM; None for the hard margin, ν = 1/I, which keeps every training pattern inside.

    Raises
    ------
    MotionStyleError
        If there are fewer than three patterns, a feature does not vary, ν is infeasible, or the
        kernel matrix is not positive semidefinite.
    """
    count = len(patterns)
    if count < FEWEST_PATTERNS:
        raise MotionStyleError(
            f"set {name}: {count} patterns, at least {FEWEST_PATTERNS} are needed to learn a "
            "similarity; mark more clips of this type as `similarity` in the sheet"
        )
    if nu is not None and not 1 / count <= nu <= 1:
        raise MotionStyleError(
            f"set {name}: ν = {nu} is infeasible for {count} patterns; it must lie between "
            f"1/{count} (hard margin) and 1"
        )
    scaling = fit_scaling(patterns, name)
    scaled = scaling.apply(patterns)
    distances = cdist(scaled, scaled, "sqeuclidean")
    unit = median_squared_distance(scaled)
    if unit <= 0:
        raise MotionStyleError(f"set {name}: most patterns are copies of one another")
    gamma = relative_width / unit
    svm_gamma = gamma if svm_width is None else svm_width / unit
    gram = np.exp(-svm_gamma * distances)
    svm = OneClassSVM(kernel="precomputed", nu=1 / count if nu is None else nu, tol=1e-9)
    svm.fit(gram)
    total = svm.dual_coef_.sum()
    alphas = np.zeros(count)
    alphas[svm.support_] = svm.dual_coef_[0] / total
    scores = gram @ alphas
    # with a hard margin ρ is the least score; LIBSVM finds it within its tolerance
    rho = float(scores.min()) if nu is None else float(svm.offset_[0] / total)
    axes, columns, grand = kernel_axes(np.exp(-gamma * distances), cutoff, name)
    return StyleModel(name, scaling, scaled, gamma, svm_gamma, alphas, rho, axes, columns, grand)


def kernel_axes(gram: Array, cutoff: int, name: str) -> tuple[Array, Array, float]:
    """Return β of the leading axes, (I, O_c), and the Gram matrix' column and grand means.

    Eigenvalues below the rounding of the largest belong to copies of patterns and are no axes.
    """
    columns, grand = gram.mean(axis=0), float(gram.mean())
    centred = gram - columns - columns[:, None] + grand
    count = len(gram)
    values, vectors = eigh(centred, subset_by_index=(max(0, count - cutoff), count - 1))
    # eigenvalues that are left out and at least 0 have a sum of squares of at most their sum's
    # square; more betrays a negative one without computing them all
    rest = np.trace(centred) - values.sum()
    spread = np.square(centred).sum() - np.square(values).sum()
    if min(rest, values[0]) < -1e-8 * count or spread > (max(rest, 0) + 1e-6 * count) ** 2:
        least = float(eigh(centred, eigvals_only=True, subset_by_index=(0, 0))[0])
        raise MotionStyleError(
            f"set {name}: the kernel matrix is not positive semidefinite (eigenvalue {least:.2g}, "
            f"largest {values[-1]:.2g}), so it has no principal axes"
        )
    if values[-1] <= 1e-12:
        raise MotionStyleError(f"set {name}: all patterns are equal, so there is nothing to learn")
    kept = np.flatnonzero(values > 1e-10 * values[-1])[::-1]
    values, vectors = values[kept], vectors[:, kept]
    signs = np.sign(vectors[np.abs(vectors).argmax(axis=0), np.arange(vectors.shape[1])])
    return vectors * signs / np.sqrt(values), columns, grand
