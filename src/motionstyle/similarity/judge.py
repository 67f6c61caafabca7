"""One judge for all three papers: how similar in style a made motion is to its example.

The models of the paper's set, fitted without the example and its mirrored copy, score all aligned
segments of the motion and its example.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from motionstyle.errors import MotionStyleError
from motionstyle.motion.motion import Motion
from motionstyle.similarity.adapt_measures import StyleModels, models_without
from motionstyle.similarity.alignment import SETS, align
from motionstyle.similarity.bank import Bank
from motionstyle.similarity.events import clip_events
from motionstyle.similarity.features import leg_vector, pair_vector, whole_body_vector
from motionstyle.similarity.settings import event_rules
from motionstyle.similarity.study import data_of

COLUMNS = (
    *("motion", "kind", "example", "action", "style", "edit", "footprints", "events", "pairs"),
    *("relative_leakage", "whole_body_leakage", "left_leg_leakage", "right_leg_leakage"),
    *("least_svm_score", "share_inside", "training_type_seen", "data", "status", "reason"),
    "config",
)


def judge_motions(
    motions: Iterable[Motion],
    examples: Mapping[str, Motion],
    bank: Bank,
    settings: Mapping[str, Any],
    config: str,
) -> list[dict[str, object]]:
    """Return one row a motion; one that cannot be judged has a reason.

    Parameters
    ----------
    motions : made motions, each naming its example in its provenance.
    examples : captured or planted motions by id.
    """
    seen: dict[str, StyleModels] = {}
    rows = []
    for motion in motions:
        known = motion.provenance
        name = str(known.get("example") or "")
        row: dict[str, object] = {"motion": motion.id, "kind": motion.kind, "example": name}
        row |= {k: known.get(k) for k in ("action", "style", "edit", "footprints")}
        row |= {"data": data_of(bank), "config": config}
        try:
            if name not in examples:
                raise MotionStyleError(
                    f"its example {name or '(none named)'} is not among this run's motions"
                )
            example = examples[name]
            base = name.removesuffix("_mirror").removesuffix("_physical")
            if base not in seen:
                seen[base] = models_without(bank, settings, {base})
            row |= judge(motion, example, seen[base], settings)
            action = str(example.provenance.get("action"))
            row["training_type_seen"] = action in settings["sets"]["types"]
            row["status"] = "ok"
        except MotionStyleError as error:
            row |= {"status": "not judged", "reason": str(error)}
        rows.append(row)
    return rows


def judge(
    motion: Motion, example: Motion, style: StyleModels, settings: Mapping[str, Any]
) -> dict[str, object]:
    """Return leakage and scores of all aligned segments of a motion and its example.

    Raises
    ------
    MotionStyleError
        If one of them has no contacts or the two cannot be aligned.
    """
    rules = event_rules(settings)
    found = align(clip_events(motion, rules), clip_events(example, rules), rules)
    features = settings["leg_space"]["features"]
    leaks: dict[str, np.ndarray] = {}
    scores = []
    for name in SETS:
        pairs = []
        for own, other in found.segments:
            if own.set != name:
                continue
            if name == "whole_body":
                halves = [whole_body_vector(motion, own), whole_body_vector(example, other)]
            else:
                space = style.spaces[name]
                halves = [
                    space.standardise(leg_vector(m, s), features)
                    for m, s in ((motion, own), (example, other))
                ]
            pairs.append(pair_vector(*halves))
        if pairs:
            leaks[name] = style.models[name].leakages(np.array(pairs))[1]
            scores.append(style.models[name].svm_scores(np.array(pairs)))
    every = np.concatenate(list(leaks.values()))
    joined = np.concatenate(scores)
    return {
        "events": len(found.events),
        "pairs": len(every),
        "relative_leakage": float(every.mean()),
        **{f"{n}_leakage": float(v.mean()) for n, v in leaks.items()},
        "least_svm_score": float(joined.min()),
        "share_inside": float(np.mean(joined >= 0)),
    }


def failed_row(sidecar: Mapping[str, Any], config: str) -> dict[str, object]:
    """Return the row of a motion that could not be made, from its sidecar."""
    known = sidecar["provenance"]
    return {
        "motion": sidecar["id"],
        "kind": sidecar["kind"],
        "example": known.get("example"),
        "status": "not judged",
        "reason": sidecar["reason"],
        "config": config,
    }
