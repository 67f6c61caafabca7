"""What an adapted motion is measured by: contacts, penetration, skate, style, pose and speed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from motionstyle.body.kinematics import contact_points, forward_kinematics
from motionstyle.errors import MotionStyleError
from motionstyle.mocap.fitting.floor import runs
from motionstyle.motion.motion import Motion
from motionstyle.similarity.adapt_terms import MOVED
from motionstyle.similarity.alignment import SETS, SIDE_OF_SET
from motionstyle.similarity.bank import Bank
from motionstyle.similarity.features import (
    LEG_COORDINATES,
    LEG_DOF,
    SAMPLES,
    leg_vector,
    pair_vector,
    whole_body_vector,
)
from motionstyle.similarity.footholds import Example, Footholds
from motionstyle.similarity.leg_space import LegSpace
from motionstyle.similarity.models import StyleModel
from motionstyle.similarity.patterns import paper_set
from motionstyle.similarity.study import mismatched_of
from motionstyle.similarity.validation import final_model

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StyleModels:
    """The three models and leg subspaces that a task may use, with the number of patterns."""

    models: Mapping[str, StyleModel]
    spaces: Mapping[str, LegSpace]
    patterns: int


def models_without(bank: Bank, settings: Mapping[str, Any], clips: set[str]) -> StyleModels:
    """Return models and subspaces that have not seen these clips nor their mirrored copies."""
    patterns, spaces, _ = paper_set(bank, settings, without=clips)
    models = {}
    for name in SETS:
        outside = mismatched_of(bank, spaces, patterns[name], settings)
        models[name], _ = final_model(patterns[name], outside, settings)
    return StyleModels(models, spaces, sum(len(p) for p in patterns.values()))


def measure(
    motion: Motion,
    example: Example,
    holds: Footholds,
    style: StyleModels,
    bank: Bank,
    settings: Mapping[str, Any],
) -> dict[str, Any]:
    """Return contact error, penetration, skate, scores, leakage, pose outlier and speed ratio."""
    points = contact_points(motion.body, forward_kinematics(motion.body, motion.coordinates))
    misses = np.linalg.norm(points - holds.targets, axis=-1)[holds.bearing]
    sunk = np.maximum(holds.surface.heights(points) - points[..., 1], 0.0)
    skates = [0.0]
    for p in range(points.shape[1]):
        for first, last in runs(holds.bearing[:, p]):
            own = points[first : last + 1, p][:, [0, 2]]
            skates.append(float(np.linalg.norm(own - own.mean(axis=0), axis=1).max()))
    scores, leaks = pair_scores(motion, example, style, settings["leg_space"]["features"])
    legs = MOVED[6:]
    speed = np.abs(np.diff(motion.coordinates[:, legs], axis=0)).max()
    usual = np.abs(np.diff(example.motion.coordinates[:, legs], axis=0)).max()
    every = np.concatenate(list(leaks.values()))
    return {
        "contact_error_cm": 100 * misses.max(initial=0.0),
        "contact_rms_cm": 100 * float(np.sqrt(np.mean(misses**2))) if len(misses) else 0.0,
        "penetration_cm": 100 * sunk.max(),
        "skate_cm": 100 * max(skates),
        "min_svm_score": float(min(s.min() for s in scores.values() if len(s))),
        "relative_leakage": float(every.mean()),
        **{f"{n}_leakage": float(v.mean()) if len(v) else None for n, v in leaks.items()},
        "pose_outlier": pose_outlier(motion, bank, {motion.id, example.motion.id}),
        "speed_ratio": float(speed / max(usual, 1e-9)),
    }


def pair_scores(
    motion: Motion, example: Example, style: StyleModels, features: int
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Return f_s and relative leakage of each pair (new segment, example's segment), by set."""
    scores, leaks = {}, {}
    for name in SETS:
        own = [s for s in example.segments if s.set == name]
        if not own:
            scores[name] = leaks[name] = np.zeros(0)
            continue
        pairs = []
        for segment in own:
            if name == "whole_body":
                halves = [whole_body_vector(m, segment) for m in (motion, example.motion)]
            else:
                halves = [
                    style.spaces[name].standardise(leg_vector(m, segment), features)
                    for m in (motion, example.motion)
                ]
            pairs.append(pair_vector(*halves))
        model = style.models[name]
        scores[name] = model.svm_scores(np.array(pairs))
        leaks[name] = model.leakages(np.array(pairs))[1]
    return scores, leaks


def pose_outlier(motion: Motion, bank: Bank, without: set[str]) -> float:
    """Return the largest distance of a leg's pose from the nearest captured one of this action.

    Joint angles are counted in standard deviations of the captured poses.

    Raises
    ------
    MotionStyleError
        If the bank holds no pose of this action.
    """
    largest = 0.0
    action = motion.provenance.get("action")
    excluded = without | {str(motion.provenance.get("example"))}
    for name, side in SIDE_OF_SET.items():
        kept = [
            k
            for k, owner in enumerate(bank.owners[name])
            if bank.clips[owner].action == action and bank.clips[owner].base not in excluded
        ]
        if not kept:
            raise MotionStyleError(f"motion {motion.id}: no captured pose of action {action}")
        poses = bank.vectors[name][kept].reshape(-1, LEG_DOF, SAMPLES)
        poses = poses.transpose(0, 2, 1).reshape(-1, LEG_DOF)
        spread = np.maximum(poses.std(axis=0), np.radians(0.5))
        distances, _ = cKDTree(poses / spread).query(
            motion.coordinates[:, LEG_COORDINATES[side]] / spread
        )
        largest = max(largest, float(distances.max()))
    return largest
