"""Do the models reject what is not similar? ROC at three levels, against three distances (T8).

type: similar pairs against pairs of two types; style: pairs of one style against pairs of two
styles of the same type and source; subject: pairs of one subject against pairs of two subjects
in the same type and style. One-class SVM, leakage and Mahalanobis learn from the similar pairs of
the other folds; Euclid and DTW learn nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.covariance import LedoitWolf

from motionstyle.errors import MotionStyleError
from motionstyle.similarity.alignment import SETS
from motionstyle.similarity.bank import Bank, Clip
from motionstyle.similarity.features import LEG_DOF, POSTURES, SAMPLES, pair_vector
from motionstyle.similarity.leg_space import LegSpace
from motionstyle.similarity.models import fit_model
from motionstyle.similarity.patterns import (
    Patterns,
    halves,
    leg_spaces,
    make_patterns,
    paper_set,
    select_pairs,
    similar,
)
from motionstyle.similarity.study import data_of, mismatched_of
from motionstyle.similarity.validation import Mismatched, auc, group_folds, widths_for

Array = NDArray[np.float64]
METHODS = ("one_class_svm", "leakage", "euclidean", "dtw", "mahalanobis")
LEVELS = ("type", "style", "subject")
COLUMNS = (
    *("level", "set", "method", "auc", "ci_low", "ci_high", "similar_pairs", "other_pairs"),
    *("similar_groups", "other_groups", "folds", "data", "status", "reason", "config"),
)
FOLDS = 5
PER_TYPE = 150


def dtw_distances(first: Array, second: Array) -> Array:
    """Return the dynamic-time-warping distance of pairs of sequences (J, T, D), (J,).

    Steps are right, down and diagonal; the cost is the Euclidean distance of frames.
    """
    cost = np.linalg.norm(first[:, :, None] - second[:, None], axis=-1)
    total = np.full((len(cost), cost.shape[1] + 1, cost.shape[2] + 1), np.inf)
    total[:, 0, 0] = 0.0
    for i in range(cost.shape[1]):
        for j in range(cost.shape[2]):
            best = np.minimum(np.minimum(total[:, i, j], total[:, i, j + 1]), total[:, i + 1, j])
            total[:, i + 1, j + 1] = cost[:, i, j] + best
    return total[:, -1, -1]


def sequences(name: str, vectors: Array) -> Array:
    """Return segments (N, 54) or (N, 175) as sequences in time (N, T, D)."""
    if name == "whole_body":
        return vectors.reshape(-1, POSTURES, vectors.shape[1] // POSTURES)
    return vectors.reshape(-1, LEG_DOF, SAMPLES).transpose(0, 2, 1)


def _level_sets(
    bank: Bank, level: str, settings: Mapping[str, Any]
) -> tuple[dict[str, Patterns], dict[str, Patterns] | None, dict[str, LegSpace]]:
    """Return similar pairs and other pairs of a level; None where the others are made later."""
    sets = settings["sets"]
    spaces = leg_spaces(bank)
    parts = halves(bank, spaces, settings["leg_space"]["features"])
    if level == "type":
        patterns, spaces, _ = paper_set(bank, settings)
        return patterns, None, spaces

    def known_style(a: Clip, b: Clip) -> bool:
        plain = {a.source, b.source} & set(sets["labelled_by_type"])
        return a.source == b.source and not plain and bool(a.style) and bool(b.style)

    def one_subject(a: Clip, b: Clip) -> bool:
        return bool(a.subject) and a.subject == b.subject

    rules = {
        "style": (
            lambda a, b: known_style(a, b) and a.subject == b.subject and a.style == b.style,
            lambda a, b: known_style(a, b) and a.subject == b.subject and a.style != b.style,
        ),
        "subject": (
            lambda a, b: similar(a, b, sets) and a.source == b.source and one_subject(a, b),
            lambda a, b: (
                similar(a, b, sets)
                and a.source == b.source
                and bool(a.subject and b.subject)
                and a.subject != b.subject
            ),
        ),
    }
    found = []
    for number, rule in enumerate(rules[level]):
        pairs, _ = select_pairs(
            bank, rule, sets["types"], PER_TYPE, sets["fewest_pairs"], sets["seed"] + 10 + number
        )
        if not pairs:
            which = "similar" if number == 0 else "other"
            raise MotionStyleError(
                f"fewer than {sets['fewest_pairs']} {which} pairs of clips of any type at level "
                f"{level}"
            )
        found.append(make_patterns(bank, parts, pairs))
    return found[0], found[1], spaces


def discrimination_rows(
    bank: Bank, settings: Mapping[str, Any], config: str
) -> list[dict[str, object]]:
    """Return one row a level, set and method: area under the ROC curve with its 95 % interval."""
    rows: list[dict[str, object]] = []
    for level in LEVELS:
        common: dict[str, object] = {"level": level, "data": data_of(bank), "config": config}
        try:
            similar_pairs, others, spaces = _level_sets(bank, level, settings)
        except MotionStyleError as error:
            rows += [
                common | {"set": name, "method": method, "status": "n/a", "reason": str(error)}
                for name in SETS
                for method in METHODS
            ]
            continue
        for name in SETS:
            one = similar_pairs[name]
            other = _cross_type(bank, one, settings, spaces) if others is None else others[name]
            rows += _rows_of_set(bank, one, other, spaces, settings, common)
    return rows


def _cross_type(
    bank: Bank,
    patterns: Patterns,
    settings: Mapping[str, Any],
    spaces: Mapping[str, LegSpace],
) -> Patterns:
    """Return pairs of two types made from the patterns' segments, one for each pattern."""
    part = halves(bank, spaces, settings["leg_space"]["features"])[patterns.name]
    generator = np.random.default_rng(settings["sets"]["seed"] + 2)
    vectors, numbers, groups = [], [], []
    for i in range(len(patterns)):
        cross = patterns.types != patterns.types[i]
        same = np.flatnonzero(cross & (patterns.labels == patterns.labels[i]))
        choice = same if len(same) else np.flatnonzero(cross)
        if not len(choice):
            continue
        partner = patterns.halves[generator.choice(choice), 1]
        vectors.append(pair_vector(part[patterns.halves[i, 0]], part[partner]))
        numbers.append((patterns.halves[i, 0], partner))
        groups.append(patterns.groups[i])
    kept = np.arange(len(vectors))
    return Patterns(
        patterns.name,
        np.array(vectors).reshape(len(vectors), -1),
        np.array(groups, dtype=str),
        patterns.types[kept],
        patterns.labels[kept],
        patterns.subjects[kept],
        np.array(numbers, dtype=np.int64).reshape(-1, 2),
    )


def _rows_of_set(
    bank: Bank,
    one: Patterns,
    other: Patterns,
    spaces: Mapping[str, LegSpace],
    settings: Mapping[str, Any],
    common: Mapping[str, object],
) -> list[dict[str, object]]:
    """Return the rows of all methods for one set."""
    seed = settings["validation"]["seed"]
    if not len(other) or len(set(one.groups)) < FOLDS:
        reason = "no pairs of two kinds" if not len(other) else "fewer groups of pairs than folds"
        return [
            {**common, "set": one.name, "method": m, "status": "n/a", "reason": reason}
            for m in METHODS
        ]
    inside = {m: np.zeros(len(one)) for m in METHODS}
    outside = {m: np.zeros(len(other)) for m in METHODS}
    raw = bank.vectors[one.name]
    for scores, patterns in ((inside, one), (outside, other)):
        a, b = raw[patterns.halves[:, 0]], raw[patterns.halves[:, 1]]
        scores["euclidean"] = -np.linalg.norm(a - b, axis=1)
        scores["dtw"] = -dtw_distances(sequences(one.name, a), sequences(one.name, b))
    parts = halves(bank, spaces, settings["leg_space"]["features"])[one.name]
    folds = group_folds(list(one.groups), FOLDS, seed)
    names = np.unique(other.groups)
    place = np.random.default_rng(seed).integers(0, len(folds), len(names))
    of_fold = place[np.searchsorted(names, other.groups)]
    outer = mismatched_of(bank, spaces, one, settings)
    for number, fold in enumerate(folds):
        train = one.take(fold.train)
        position = np.full(len(one), -1)
        position[fold.train] = np.arange(len(fold.train))
        own = position[outer.origins] >= 0
        inner = Mismatched(outer.vectors[own], position[outer.origins[own]], outer.kinds[own])
        widths = widths_for(train, inner, settings, seed + number)
        model = fit_model(
            train.vectors,
            one.name,
            relative_width=widths.leakage,
            svm_width=widths.svm,
            cutoff=settings["models"]["cutoff"][one.name],
        )
        differences = parts[train.halves[:, 0]] - parts[train.halves[:, 1]]
        precision = LedoitWolf(assume_centered=True).fit(differences).precision_
        test = np.flatnonzero(of_fold == number)
        for scores, patterns, index in ((inside, one, fold.test), (outside, other, test)):
            if not len(index):
                continue
            scores["one_class_svm"][index] = model.svm_scores(patterns.vectors[index])
            scores["leakage"][index] = -model.leakages(patterns.vectors[index])[1]
            d = parts[patterns.halves[index, 0]] - parts[patterns.halves[index, 1]]
            scores["mahalanobis"][index] = -np.einsum("ia,ab,ib->i", d, precision, d)
    rows = []
    for method in METHODS:
        low, high = interval(
            inside[method],
            one.groups,
            outside[method],
            other.groups,
            settings["validation"]["bootstraps"],
            seed,
        )
        rows.append(
            {
                **common,
                "set": one.name,
                "method": method,
                "auc": auc(inside[method], outside[method]),
                "ci_low": low,
                "ci_high": high,
                "similar_pairs": len(one),
                "other_pairs": len(other),
                "similar_groups": len(set(one.groups)),
                "other_groups": len(set(other.groups)),
                "folds": len(folds),
                "status": "ok",
            }
        )
    return rows


def interval(
    inside: Array,
    inside_groups: NDArray[np.str_],
    outside: Array,
    outside_groups: NDArray[np.str_],
    count: int,
    seed: int,
) -> tuple[float, float]:
    """Return the 95 % bootstrap interval of an AUC, drawing whole pairs of clips."""
    generator = np.random.default_rng(seed)

    def members(groups: NDArray[np.str_]) -> list[NDArray[np.int64]]:
        _, place = np.unique(groups, return_inverse=True)
        order = np.argsort(place, kind="stable")
        return np.split(order, np.cumsum(np.bincount(place))[:-1])

    first, second = members(inside_groups), members(outside_groups)
    values = []
    for _ in range(count):
        a = np.concatenate([first[k] for k in generator.integers(0, len(first), len(first))])
        b = np.concatenate([second[k] for k in generator.integers(0, len(second), len(second))])
        values.append(auc(inside[a], outside[b]))
    return float(np.quantile(values, 0.025)), float(np.quantile(values, 0.975))
