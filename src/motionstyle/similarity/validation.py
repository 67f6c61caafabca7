"""Validation of the two models: folds, the choice of kernel width, held-out scores (spec. §6.4–5).

Widths are chosen in folds inside the training patterns, by how well held-out similar pairs are
told from mismatched ones. Kernel PCA takes the width with the largest area under the ROC curve,
which knows the order of the leakages but never their level, so that the level found is no choice
of ours. The SVM, which has a threshold, takes the largest mean of acceptance and rejection.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist
from scipy.stats import rankdata
from sklearn.svm import OneClassSVM

from motionstyle.errors import MotionStyleError
from motionstyle.similarity.models import (
    StyleModel,
    fit_model,
    fit_scaling,
    kernel_axes,
    kernel_leakages,
)
from motionstyle.similarity.models import median_squared_distance as median_distance
from motionstyle.similarity.patterns import Patterns

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class Fold:
    """Training and test patterns of one fold, as indices."""

    train: Index
    test: Index


@dataclass(frozen=True)
class Mismatched:
    """Pairs that are not similar: features (J, n), the pattern each is made from, its kind."""

    vectors: Array
    origins: Index
    kinds: NDArray[np.str_]


@dataclass(frozen=True)
class Widths:
    """Relative widths of kernel PCA and SVM, and the inner measure of each width of the grid."""

    leakage: float
    svm: float
    auc: Array
    balance: Array


@dataclass(frozen=True)
class HeldOut:
    """Scores of held-out patterns and of mismatched pairs made from them, over all folds."""

    width: Array
    svm_width: Array
    relative: Array
    svm: Array
    mismatched_svm: Array
    mismatched_relative: Array
    mismatched_kinds: NDArray[np.str_]


def auc(inside: Array, outside: Array) -> float:
    """Return the area under the ROC curve of scores that should be larger for `inside`."""
    if not len(inside) or not len(outside):
        return float("nan")
    ranks = rankdata(np.concatenate([inside, outside]))
    count = len(inside)
    return float((ranks[:count].sum() - count * (count + 1) / 2) / (count * len(outside)))


def pattern_folds(count: int, folds: int, seed: int) -> list[Fold]:
    """Return folds over patterns, as in the paper.

    Raises
    ------
    MotionStyleError
        If there are fewer patterns than folds.
    """
    if count < folds:
        raise MotionStyleError(
            f"{count} patterns cannot be divided into {folds} folds; lower `validation: folds` in "
            "config/similarity.yaml or mark more clips as `similarity`"
        )
    order = np.random.default_rng(seed).permutation(count)
    return _folds(np.array([order[k::folds] for k in range(folds)], dtype=object), count)


def group_folds(groups: Sequence[str], folds: int, seed: int) -> list[Fold]:
    """Return folds that keep each group together; with few groups, one fold a group."""
    names = np.unique(groups)
    folds = min(folds, len(names))
    if folds < 2:
        raise MotionStyleError(
            f"all {len(groups)} patterns are of one pair of clips, which cannot be divided into "
            "folds; mark more clips as `similarity`"
        )
    order = np.random.default_rng(seed).permutation(names)
    parts = [np.flatnonzero(np.isin(groups, order[k::folds])) for k in range(folds)]
    found = _folds(parts, len(groups))
    for fold in found:
        check_disjoint(np.asarray(groups), fold)
    return found


def subject_folds(subjects: NDArray[np.str_], fewest: int) -> list[Fold]:
    """Return one fold a subject: tested on all pairs with it, trained on all pairs without.

    Raises
    ------
    MotionStyleError
        If fewer than `fewest` subjects are known, or one subject is in nearly every pair.
    """
    names = sorted({name for name in subjects.ravel() if name})
    if len(names) < fewest:
        raise MotionStyleError(f"{len(names)} known subjects, {fewest} are needed")
    found = []
    for name in names:
        has = (subjects == name).any(axis=1)
        if has.any() and (~has).sum() >= len(subjects) // 4:
            found.append(Fold(np.flatnonzero(~has), np.flatnonzero(has)))
    if len(found) < fewest:
        raise MotionStyleError(
            f"only {len(found)} subjects can be held out with a quarter of the pairs left to learn"
        )
    return found


def _folds(parts: Sequence[Index] | NDArray[Any], count: int) -> list[Fold]:
    every = np.arange(count)
    tests = [np.sort(np.asarray(part, dtype=np.int64)) for part in parts]
    return [Fold(np.setdiff1d(every, test), test) for test in tests]


def check_disjoint(groups: NDArray[np.str_], fold: Fold) -> None:
    """Refuse a fold that trains and tests on one group.

    Raises
    ------
    MotionStyleError
        If a group, say a pair of clips or a clip, is on both sides.
    """
    if both := sorted(set(groups[fold.train]) & set(groups[fold.test])):
        raise MotionStyleError(
            f"{both[0]} is in the training and in the test part of one fold ({len(both)} such); "
            "keep all patterns of it, mirrored copies included, on one side"
        )


def choose_widths(
    patterns: Array,
    groups: Sequence[str],
    mismatched: Mismatched,
    widths: Sequence[float],
    cutoff: int,
    folds: int,
    seed: int,
) -> Widths:
    """Return the relative widths of both models, chosen in folds inside the training patterns.

    Parameters
    ----------
    patterns, groups : training patterns (I, n) and their pairs of clips.
    mismatched : pairs made from these patterns; `origins` index into `patterns`.
    cutoff : O_c.
    """
    try:
        inner = group_folds(groups, folds, seed)
    except MotionStyleError:
        inner = pattern_folds(len(patterns), min(folds, len(patterns)), seed)
    by_leakage = np.full((len(inner), len(widths)), np.nan)
    by_svm = by_leakage.copy()
    for row, fold in enumerate(inner):
        outside = mismatched.vectors[np.isin(mismatched.origins, fold.test)]
        if not len(outside) or not len(fold.test):
            continue
        scaling = fit_scaling(patterns[fold.train], "inner fold")
        train, test = (scaling.apply(patterns[part]) for part in (fold.train, fold.test))
        unit = median_distance(train)
        own = cdist(train, train, "sqeuclidean") / unit
        both = np.concatenate([test, scaling.apply(outside)])
        others = cdist(both, train, "sqeuclidean") / unit
        count = len(test)
        for column, width in enumerate(widths):
            gram, kernel = np.exp(-width * own), np.exp(-width * others)
            _, relative = kernel_leakages(kernel, *kernel_axes(gram, cutoff, "inner fold"))
            by_leakage[row, column] = auc(-relative[:count], -relative[count:])
            svm = OneClassSVM(kernel="precomputed", nu=1 / len(train), tol=1e-6).fit(gram)
            coefficients = svm.dual_coef_[0]
            scores = kernel[:, svm.support_] @ coefficients
            inside = scores >= (gram[:, svm.support_] @ coefficients).min()
            by_svm[row, column] = (inside[:count].mean() + 1 - inside[count:].mean()) / 2
    if np.isnan(by_leakage).all():
        middle = float(widths[len(widths) // 2])
        return Widths(middle, middle, by_leakage[0], by_svm[0])
    mean, balance = np.nanmean(by_leakage, axis=0), np.nanmean(by_svm, axis=0)
    return Widths(
        float(widths[int(np.argmax(mean))]), float(widths[int(np.argmax(balance))]), mean, balance
    )


def widths_for(
    patterns: Patterns, mismatched: Mismatched, settings: Mapping[str, Any], seed: int
) -> Widths:
    """Return the widths chosen inside a set of training patterns."""
    models = settings["models"]
    return choose_widths(
        patterns.vectors,
        list(patterns.groups),
        mismatched,
        models["widths"],
        models["cutoff"][patterns.name],
        models["inner_folds"],
        seed,
    )


def _of_training(mismatched: Mismatched, count: int, train: Index) -> Mismatched:
    """Return the mismatched pairs made from training patterns, counted among these."""
    position = np.full(count, -1)
    position[train] = np.arange(len(train))
    inside = position[mismatched.origins] >= 0
    return Mismatched(
        mismatched.vectors[inside], position[mismatched.origins[inside]], mismatched.kinds[inside]
    )


def held_out(
    patterns: Patterns,
    mismatched: Mismatched,
    folds: Sequence[Fold],
    settings: Mapping[str, Any],
    *,
    width: float | None = None,
    nu: float | None = None,
) -> HeldOut:
    """Return the scores of held-out patterns; widths are chosen anew in every fold or given."""
    models, seed = settings["models"], settings["validation"]["seed"]
    parts: dict[str, list[Array]] = {f.name: [] for f in fields(HeldOut)}
    for number, fold in enumerate(folds):
        train = patterns.take(fold.train)
        kernel_width = svm_width = width
        if width is None:
            inner = _of_training(mismatched, len(patterns), fold.train)
            chosen = widths_for(train, inner, settings, seed + number)
            kernel_width, svm_width = chosen.leakage, chosen.svm
        model = fit_model(
            train.vectors,
            patterns.name,
            relative_width=kernel_width,
            svm_width=svm_width,
            cutoff=models["cutoff"][patterns.name],
            nu=None if nu is None else max(nu, 1 / len(train)),
        )
        test = patterns.vectors[fold.test]
        outside = np.isin(mismatched.origins, fold.test)
        others = mismatched.vectors[outside].reshape(-1, test.shape[1])
        parts["width"].append(np.array([kernel_width]))
        parts["svm_width"].append(np.array([svm_width]))
        parts["relative"].append(model.leakages(test)[1])
        parts["svm"].append(model.svm_scores(test))
        parts["mismatched_kinds"].append(mismatched.kinds[outside])
        parts["mismatched_svm"].append(model.svm_scores(others))
        parts["mismatched_relative"].append(model.leakages(others)[1])
    return HeldOut(**{name: np.concatenate(values) for name, values in parts.items()})


def final_model(
    patterns: Patterns, mismatched: Mismatched, settings: Mapping[str, Any]
) -> tuple[StyleModel, Widths]:
    """Return the model of all patterns of a set, and its relative widths, chosen inside them."""
    models = settings["models"]
    widths = widths_for(patterns, mismatched, settings, settings["validation"]["seed"])
    model = fit_model(
        patterns.vectors,
        patterns.name,
        relative_width=widths.leakage,
        svm_width=widths.svm,
        cutoff=models["cutoff"][patterns.name],
    )
    return model, widths
