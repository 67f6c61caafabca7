"""Dose and response: whether leakage and SVM score follow a planted change of known size.

Pairs of an unchanged planted motion and one changed by a dose are scored by models that have seen
neither of the two, nor any other dose of that series. A leg must not respond to what leaves it as
it is: those rows are controls and are named so.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.stats import spearmanr

from motionstyle.errors import MotionStyleError
from motionstyle.similarity.alignment import SETS
from motionstyle.similarity.bank import Bank, Clip
from motionstyle.similarity.patterns import halves, make_patterns, paper_set
from motionstyle.similarity.study import mismatched_of
from motionstyle.similarity.validation import final_model

UNDOSED = "dose0"
# What a series changes that the legs show; the rest moves the trunk or the arms alone.
LEG_SERIES = ("step", "length")
COLUMNS = (
    *("series", "action", "set", "score", "rank_correlation", "doses", "pairs", "data"),
    *("status", "reason", "config"),
)
POINT_COLUMNS = (
    *("series", "action", "set", "dose", "pair", "relative_leakage", "svm_score", "data", "config"),
)
Row = dict[str, object]


def _take(clip: Clip) -> str:
    return clip.base.rsplit("-", 1)[-1]


def dose_rows(bank: Bank, settings: Mapping[str, Any], config: str) -> tuple[list[Row], list[Row]]:
    """Return the rank correlations and the points behind them; none without planted doses."""
    rows: list[Row] = []
    points: list[Row] = []
    series = sorted({c.series for c in bank.clips if c.dose is not None and c.series != UNDOSED})
    for name in series:
        action = next(c.action for c in bank.clips if c.series == name)
        common = {"series": name, "action": action, "data": "planted", "config": config}
        try:
            found = _series_points(bank, settings, name, action)
        except MotionStyleError as error:
            rows += [
                {**common, "set": s, "score": score, "status": "n/a", "reason": str(error)}
                for s in SETS
                for score in ("leakage", "one_class_svm")
            ]
            continue
        points += [{**common, **point} for point in found]
        for set_name in SETS:
            own = [p for p in found if p["set"] == set_name]
            doses = np.array([p["dose"] for p in own])
            shown = set_name == "whole_body" or any(w in name for w in LEG_SERIES)
            for score, column in (
                ("leakage", "relative_leakage"),
                ("one_class_svm", "svm_score"),
            ):
                values = np.array([p[column] for p in own])
                constant = len(set(doses)) < 3 or np.ptp(values) == 0
                rows.append(
                    {
                        **common,
                        "set": set_name,
                        "score": score if shown else f"{score}_control",
                        "rank_correlation": None
                        if constant
                        else float(spearmanr(doses, values).statistic),
                        "doses": len(set(doses)),
                        "pairs": len(own),
                        "status": "n/a" if constant else "ok",
                        "reason": "fewer than three doses or no change" if constant else None,
                    }
                )
    return rows, points


def _series_points(bank: Bank, settings: Mapping[str, Any], series: str, action: str) -> list[Row]:
    """Return leakage and score of each pair (unchanged, dosed) of different takes."""
    undosed = {c.base for c in bank.clips if c.series == UNDOSED and c.action == action}
    if not undosed:
        raise MotionStyleError(f"no unchanged motion of action {action} to hold the doses against")
    changed = {c.base for c in bank.clips if c.series == series}
    patterns, spaces, _ = paper_set(bank, settings, without=undosed | changed)
    if action not in patterns["whole_body"].types:
        raise MotionStyleError(
            f"without the unchanged motions no similar pair of action {action} is left"
        )
    parts = halves(bank, spaces, settings["leg_space"]["features"])
    chosen = []
    for pair in bank.pairs:
        one, two = bank.clips[pair.first], bank.clips[pair.second]
        if one.id != one.base or two.id != two.base or one.action != action:
            continue
        of_series = [c for c in (one, two) if c.series in {series, UNDOSED}]
        if len(of_series) == 2 and {one.base, two.base} & undosed and _take(one) != _take(two):
            # the changed motion comes first, as the new motion does in adaptation
            chosen.append((pair, one.base in undosed and two.base not in undosed))
    found: list[Row] = []
    for name in SETS:
        outside = mismatched_of(bank, spaces, patterns[name], settings)
        model, _ = final_model(patterns[name], outside, settings)
        for pair, swapped in chosen:
            own = make_patterns(bank, parts, [(pair, swapped)])[name]
            if not len(own):
                continue
            clips = [bank.clips[pair.first], bank.clips[pair.second]]
            dose = max(c.dose or 0.0 for c in clips)
            found.append(
                {
                    "set": name,
                    "dose": dose,
                    "pair": " ".join(c.id for c in clips),
                    "relative_leakage": float(model.leakages(own.vectors)[1].mean()),
                    "svm_score": float(model.svm_scores(own.vectors).mean()),
                }
            )
    return found
