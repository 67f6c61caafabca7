"""The study of both models on the paper's set and on all pairs: rows of the stage's tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError
from motionstyle.similarity.alignment import SETS
from motionstyle.similarity.bank import Bank
from motionstyle.similarity.features import LEG_DIMENSION
from motionstyle.similarity.leg_space import LegSpace
from motionstyle.similarity.models import fit_model
from motionstyle.similarity.patterns import (
    Patterns,
    halves,
    mismatched,
    paper_set,
)
from motionstyle.similarity.validation import (
    Fold,
    HeldOut,
    Mismatched,
    auc,
    group_folds,
    held_out,
    pattern_folds,
    subject_folds,
)

Array = NDArray[np.float64]
Row = dict[str, object]

SETS_COLUMNS = (
    *("set", "size", "type", "features", "patterns", "pairs", "clips", "mirrored_clips"),
    *("paper_patterns", "data", "status", "reason", "config"),
)
SUBSPACE_COLUMNS = (
    *("leg", "components", "dimension", "cumulative_variance_pct", "segments", "clips"),
    *("actions", "paper_actions_absent", "data", "config"),
)
LEAKAGE_COLUMNS = (
    *("set", "size", "folds", "width", "relative_width", "patterns", "fold_count"),
    *("mean_relative_leakage", "median_relative_leakage", "share_below_0_1", "share_below_0_2"),
    *("mean_root_leakage", "share_root_below_0_2", "mismatched_mean_relative_leakage", "auc"),
    *("paper_mean", "paper_share_below_0_2", "data", "status", "reason", "config"),
)
SVM_COLUMNS = (
    *("set", "size", "margin", "nu", "folds", "patterns", "relative_width"),
    *("training_inside_share", "held_out_accepted_share", "mismatched_rejected_share"),
    *("shuffled_rejected_share", "cross_type_rejected_share", "auc", "data", "status", "reason"),
    "config",
)
# The paper's subspaces were of "climbing, jumping, running, walking etc." (§4.1).
PAPER_ACTIONS = {"climbing": ("stairs", "step-up", "uneven"), "jumping": ("jump",)}
PAPER_ACTIONS |= {"running": ("run", "jog", "dash"), "walking": ("walk",)}
PAPER_MEAN, PAPER_SHARE = 0.1, 0.9
SIZES = ("paper", "all_pairs")


@dataclass(frozen=True)
class Study:
    """All rows, and what the figures need: held-out leakages by (set, size, folds)."""

    sets: list[Row]
    subspaces: list[Row]
    leakage: list[Row]
    svm: list[Row]
    held_out: Mapping[str, Array]


def data_of(bank: Bank) -> str:
    """Return whether a bank's clips are captured or planted."""
    return "planted" if all(clip.planted for clip in bank.clips) else "captured"


def subspace_rows(
    bank: Bank, spaces: Mapping[str, LegSpace], features: int, kept: int, config: str
) -> list[Row]:
    """Return the cumulative variance of both legs at each number of components (T1)."""
    rows = []
    for name, space in spaces.items():
        unmirrored = [bank.clips[k].id == bank.clips[k].base for k in bank.owners[name]]
        owners = {bank.clips[k] for k in bank.owners[name][np.array(unmirrored)]}
        actions = sorted({clip.action for clip in owners})
        absent = [
            word
            for word, parts in PAPER_ACTIONS.items()
            if not any(part in action for action in actions for part in parts)
        ]
        share = space.cumulative_variance()
        for count in sorted({1, 2, 5, 10, features, 20, 30, 40, 50, kept, 80, 100, LEG_DIMENSION}):
            rows.append(
                {
                    "leg": name,
                    "components": count,
                    "dimension": len(share),
                    "cumulative_variance_pct": 100 * share[count - 1],
                    "segments": int(np.sum(unmirrored)),
                    "clips": len(owners),
                    "actions": " ".join(actions),
                    "paper_actions_absent": " ".join(absent) or "none",
                    "data": data_of(bank),
                    "config": config,
                }
            )
    return rows


def set_rows(
    bank: Bank,
    patterns: Mapping[str, Patterns],
    reasons: Mapping[str, str],
    size: str,
    settings: Mapping[str, Any],
    config: str,
) -> list[Row]:
    """Return the sizes of the three sets by type (T2), types that are left out included."""
    rows = []
    for name in SETS:
        one = patterns[name]
        counts = Counter(one.types.tolist())
        for kind in settings["sets"]["types"]:
            own = one.types == kind
            owners = {bank.clips[bank.owners[name][k]] for k in one.halves[own].ravel()}
            rows.append(
                {
                    "set": name,
                    "size": size,
                    "type": kind,
                    "features": one.vectors.shape[1] if len(one) else None,
                    "patterns": counts.get(kind, 0),
                    "pairs": len(set(one.groups[own])),
                    "clips": len({clip.base for clip in owners}),
                    "mirrored_clips": sum(clip.id != clip.base for clip in owners),
                    "paper_patterns": settings["sets"]["paper_size"][kind],
                    "data": data_of(bank),
                    "status": "left out" if kind in reasons else "ok",
                    "reason": reasons.get(kind),
                    "config": config,
                }
            )
    return rows


def folds_of(patterns: Patterns, settings: Mapping[str, Any]) -> dict[str, list[Fold] | str]:
    """Return the folds of each way of dividing, or why there are none."""
    part = settings["validation"]
    ways = {
        "pattern": lambda: pattern_folds(len(patterns), part["folds"], part["seed"]),
        "pair": lambda: group_folds(list(patterns.groups), part["folds"], part["seed"]),
        "subject": lambda: subject_folds(patterns.subjects, part["fewest_subjects"]),
    }
    found: dict[str, list[Fold] | str] = {}
    for way, make in ways.items():
        try:
            found[way] = make()
        except MotionStyleError as error:
            found[way] = str(error)
    return found


def _leakage_row(scores: HeldOut) -> Row:
    relative = scores.relative
    return {
        "relative_width": float(np.median(scores.width)),
        "mean_relative_leakage": relative.mean(),
        "median_relative_leakage": float(np.median(relative)),
        "share_below_0_1": np.mean(relative < 0.1),
        "share_below_0_2": np.mean(relative < 0.2),
        "mean_root_leakage": np.sqrt(relative).mean(),
        "share_root_below_0_2": np.mean(np.sqrt(relative) < 0.2),
        "mismatched_mean_relative_leakage": scores.mismatched_relative.mean()
        if len(scores.mismatched_relative)
        else None,
        "auc": auc_or_none(-relative, -scores.mismatched_relative),
    }


def auc_or_none(inside: Array, outside: Array) -> float | None:
    """Return the area under the ROC curve, or None without one of the two."""
    return auc(inside, outside) if len(inside) and len(outside) else None


def _svm_row(scores: HeldOut, inside: float) -> Row:
    def rejected(kind: str | None) -> float | None:
        own = scores.mismatched_svm
        if kind is not None:
            own = own[scores.mismatched_kinds == kind]
        return float(np.mean(own < 0)) if len(own) else None

    return {
        "relative_width": float(np.median(scores.svm_width)),
        "training_inside_share": inside,
        "held_out_accepted_share": np.mean(scores.svm >= 0),
        "mismatched_rejected_share": rejected(None),
        "shuffled_rejected_share": rejected("shuffled"),
        "cross_type_rejected_share": rejected("cross_type"),
        "auc": auc_or_none(scores.svm, scores.mismatched_svm),
    }


def mismatched_of(
    bank: Bank, spaces: Mapping[str, LegSpace], patterns: Patterns, settings: Mapping[str, Any]
) -> Mismatched:
    """Return the mismatched pairs of a set of patterns."""
    parts = halves(bank, spaces, settings["leg_space"]["features"])
    return Mismatched(*mismatched(bank, parts, patterns, settings["sets"]["seed"] + 1))


def inside_share(patterns: Patterns, width: float, nu: float | None, cutoff: int) -> float:
    """Return the share of training patterns with f_s ≥ 0, to the rounding of the scores."""
    model = fit_model(
        patterns.vectors,
        patterns.name,
        relative_width=width,
        cutoff=cutoff,
        nu=None if nu is None else max(nu, 1 / len(patterns)),
    )
    return float(np.mean(model.svm_scores(patterns.vectors) > -1e-9))


def run_study(bank: Bank, settings: Mapping[str, Any], config: str) -> Study:
    """Validate both models on the paper's set and on all pairs (T1–T4, F3)."""
    study = Study([], [], [], [], {})
    kept: dict[str, Array] = {}
    for size in SIZES:
        limit = None if size == "paper" else settings["sets"]["all_pairs_limit"]
        patterns, spaces, reasons = paper_set(bank, settings, limit=limit)
        study.sets.extend(set_rows(bank, patterns, reasons, size, settings, config))
        if size == "paper":
            part = settings["leg_space"]
            study.subspaces.extend(
                subspace_rows(bank, spaces, part["features"], part["components"], config)
            )
        for name in SETS:
            common = {"set": name, "size": size, "data": data_of(bank), "config": config}
            common["patterns"] = len(patterns[name])
            outside = mismatched_of(bank, spaces, patterns[name], settings)
            _validate(patterns[name], outside, settings, common, study, kept)
    return Study(study.sets, study.subspaces, study.leakage, study.svm, kept)


def _validate(
    patterns: Patterns,
    outside: Mismatched,
    settings: Mapping[str, Any],
    common: Row,
    study: Study,
    kept: dict[str, Array],
) -> None:
    """Add the rows of one set: three ways of folds; of the paper's also widths and margins."""
    models = settings["models"]
    cutoff = models["cutoff"][patterns.name]
    paper = {"paper_mean": PAPER_MEAN, "paper_share_below_0_2": PAPER_SHARE}
    folds = folds_of(patterns, settings)
    for way, found in folds.items():
        leakage = common | paper | {"folds": way, "width": "chosen"}
        svm = common | {"folds": way, "margin": "hard", "nu": 1 / max(len(patterns), 1)}
        if isinstance(found, str):
            study.leakage.append(leakage | {"status": "n/a", "reason": found})
            inside = inside_share(patterns, float(np.median(models["widths"])), None, cutoff)
            study.svm.append(
                svm | {"status": "n/a", "reason": found, "training_inside_share": inside}
            )
            continue
        scores = held_out(patterns, outside, found, settings)
        leakage |= {"fold_count": len(found), "status": "ok"}
        study.leakage.append(leakage | _leakage_row(scores))
        kept[f"{patterns.name}.{common['size']}.{way}"] = scores.relative
        width = float(np.median(scores.svm_width))
        inside = inside_share(patterns, width, None, cutoff)
        study.svm.append(svm | {"status": "ok"} | _svm_row(scores, inside))
        if way != "pattern" or common["size"] != "paper":
            continue
        for nu in models["nu"]:
            inside = inside_share(patterns, width, nu, cutoff)
            soft = held_out(patterns, outside, found, settings, width=width, nu=nu)
            study.svm.append(
                svm | {"margin": f"nu {nu:g}", "nu": nu, "status": "ok"} | _svm_row(soft, inside)
            )
        for fixed in models["widths"]:
            scores = held_out(patterns, outside, found, settings, width=fixed)
            study.leakage.append(leakage | {"width": f"{fixed:g}"} | _leakage_row(scores))
