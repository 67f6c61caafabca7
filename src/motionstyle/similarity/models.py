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
    gamma : Γ of the kernel, on standardised features.
    alphas, rho : of the SVM, (I,); Σ α = 1.
    axes : β, coefficients of the leading unit axes of kernel PCA, (I, O_c).
    column_means, grand_mean : of the Gram matrix, to centre new patterns.
    """

    name: str
    scaling: Scaling
    patterns: Array
    gamma: float
    alphas: Array
    rho: float
    axes: Array
    column_means: Array
    grand_mean: float

    def kernel(self, patterns: Array) -> Array:
        """Return k between patterns (J, n) in raw features and the training ones, (J, I)."""
        scaled = self.scaling.apply(np.atleast_2d(patterns))
        return np.exp(-self.gamma * cdist(scaled, self.patterns, "sqeuclidean"))

    def svm_scores(self, patterns: Array) -> Array:
        """Return f_s of patterns (J, n), (J,); at least 0 inside."""
        return self.kernel(patterns) @ self.alphas - self.rho

    def leakages(self, patterns: Array) -> tuple[Array, Array]:
        """Return leak(p) and the relative leakage of patterns (J, n), both (J,)."""
        kernel = self.kernel(patterns)
        means = kernel.mean(axis=1)
        norms = 1.0 - 2 * means + self.grand_mean
        centred = kernel - means[:, None] - self.column_means + self.grand_mean
        leak = np.maximum(norms - ((centred @ self.axes) ** 2).sum(axis=1), 0.0)
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
    """Return the median squared distance of patterns (I, n), the unit kernel widths are given in."""
    return float(np.median(pdist(patterns, "sqeuclidean")))


def fit_model(
    patterns: Array,
    name: str,
    *,
    relative_width: float,
    cutoff: int,
    nu: float | None = None,
    gamma: float | None = None,
) -> StyleModel:
    """Return both models of training patterns (I, n) in raw features.

    Parameters
    ----------
    relative_width : Γ times the median squared distance of the standardised patterns.
    cutoff : O_c; at most I − 1 axes are there.
    nu : of the SVM; None for the hard margin, ν = 1/I, which keeps every training pattern inside.
    gamma : Γ itself, instead of the relative width.

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
    if gamma is None:
        gamma = relative_width / median_squared_distance(scaled)
    gram = np.exp(-gamma * cdist(scaled, scaled, "sqeuclidean"))
    svm = OneClassSVM(kernel="precomputed", nu=1 / count if nu is None else nu, tol=1e-9)
    svm.fit(gram)
    total = svm.dual_coef_.sum()
    alphas = np.zeros(count)
    alphas[svm.support_] = svm.dual_coef_[0] / total
    scores = gram @ alphas
    # with a hard margin ρ is the least score; LIBSVM finds it within its tolerance
    rho = float(scores.min()) if nu is None else float(svm.offset_[0] / total)
    axes, columns, grand = _kernel_axes(gram, cutoff, name)
    return StyleModel(name, scaling, scaled, gamma, alphas, rho, axes, columns, grand)


def _kernel_axes(gram: Array, cutoff: int, name: str) -> tuple[Array, Array, float]:
    """Return β of the leading axes, (I, O_c), and the Gram matrix' column and grand means.

    Eigenvalues below the rounding of the largest belong to copies of patterns and are no axes.
    """
    columns, grand = gram.mean(axis=0), float(gram.mean())
    centred = gram - columns - columns[:, None] + grand
    values, vectors = eigh(centred)
    if values[0] < -1e-8 * max(values[-1], 1e-12):
        raise MotionStyleError(
            f"set {name}: the kernel matrix is not positive semidefinite (eigenvalue "
            f"{values[0]:.2g} beside {values[-1]:.2g}), so it has no principal axes"
        )
    if values[-1] <= 1e-12:
        raise MotionStyleError(f"set {name}: all patterns are equal, so there is nothing to learn")
    kept = np.flatnonzero(values > 1e-10 * values[-1])[::-1][:cutoff]
    values, vectors = values[kept], vectors[:, kept]
    signs = np.sign(vectors[np.abs(vectors).argmax(axis=0), np.arange(vectors.shape[1])])
    return vectors * signs / np.sqrt(values), columns, grand
