"""Where the error of estimated forces comes from: the total, its sharing, and each setting.

The total over both feet is Newton's alone; how two feet share it is an assumption. Held against
plates one at a time, on a few clips on which the settings were chosen.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.force_plates import (
    GRAVITY,
    LOADED_N,
    FootForce,
    judged_foot,
    weight_ratio,
)
from motionstyle.motion.motion import Motion

Array = NDArray[np.float64]
STUDY_COLUMNS = (
    *("variant", "changed", "id", "vertical_correlation", "vertical_rms_pctbw"),
    *("vertical_rms_own_pctbw", "fore_aft_correlation", "lateral_rms_pctbw"),
    *("total_correlation", "total_rms_own_pctbw", "share_rms_pct", "marker_rms_cm"),
    *("foot_slip_mm", "iterations", "seconds", "status"),
)


def study_row(motion: Motion, plates: Mapping[str, FootForce]) -> dict[str, float]:
    """Return the errors of a physical motion's forces, feet averaged.

    total_* : of the sum over both feet, in frames in which every foot the estimate loads is on a
    plate. share_rms_pct : of the right foot's share of the total, where both plates are loaded.
    *_own_* : both sides in their own body weight, see `force_plates.weight_ratio`.
    """
    weight = motion.body.mass * GRAVITY
    feet = [judged_foot(motion, plates, foot) for foot in ("r", "l")]
    ratio = weight_ratio(feet)
    found: dict[str, list[float]] = {}
    for estimated, plate, judged in feet:
        if not judged.any():
            continue
        ours, theirs = estimated[judged] / weight, plate[judged] / weight
        values = {
            "vertical_correlation": np.corrcoef(ours[:, 1], theirs[:, 1])[0, 1],
            "vertical_rms_pctbw": 100 * _rms(ours[:, 1] - theirs[:, 1]),
            "vertical_rms_own_pctbw": 100 * _rms(ours[:, 1] - theirs[:, 1] / ratio),
            "fore_aft_correlation": np.corrcoef(ours[:, 0], theirs[:, 0])[0, 1],
            "lateral_rms_pctbw": 100 * _rms(ours[:, 2] - theirs[:, 2]),
        }
        for name, value in values.items():
            found.setdefault(name, []).append(float(value))
    row = {name: float(np.mean(values)) for name, values in found.items()}
    return row | _total_and_share(feet, ratio, weight)


def _total_and_share(
    feet: list[tuple[Array, Array, NDArray[np.bool_]]], ratio: float, weight: float
) -> dict[str, float]:
    ours = np.stack([estimated[:, 1] for estimated, _plate, _judged in feet], axis=1)
    theirs = np.stack([plate[:, 1] for _estimated, plate, _judged in feet], axis=1)
    known = np.isfinite(theirs).all(axis=1)
    theirs = np.nan_to_num(theirs)
    whole = known & ((ours < LOADED_N) | (theirs > LOADED_N)).all(axis=1)
    whole &= (ours > LOADED_N).any(axis=1)
    row: dict[str, float] = {}
    if whole.sum() > 2:
        a, b = ours[whole].sum(axis=1), theirs[whole].sum(axis=1)
        row["total_correlation"] = float(np.corrcoef(a, b)[0, 1])
        row["total_rms_own_pctbw"] = 100 * _rms(a - b / ratio) / weight
    double = known & (theirs > LOADED_N).all(axis=1) & (ours.sum(axis=1) > LOADED_N)
    if double.any():
        away = ours[double, 0] / ours[double].sum(axis=1)
        away -= theirs[double, 0] / theirs[double].sum(axis=1)
        row["share_rms_pct"] = 100 * _rms(away)
    return row


def _rms(values: Array) -> float:
    return float(np.sqrt((values**2).mean()))


def read_study(path: str | Path) -> dict[str, Any]:
    """Read `config/force_study.yaml`: development clips and variants of the settings.

    Raises
    ------
    MotionStyleError
        If the file cannot be read or lacks a part.
    """
    import yaml  # noqa: PLC0415 - few who import this module read the file

    try:
        study = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise MotionStyleError(f"{path}: not readable as YAML ({error})") from error
    found = study if isinstance(study, dict) else {}
    if set(found) != {"development", "variants"}:
        raise MotionStyleError(f"{path}: needs the keys development and variants, and no other")
    for one in found["variants"]:
        if not isinstance(one, dict) or set(one) != {"name", "changes"}:
            raise MotionStyleError(f"{path}: each variant needs name and changes, found {one}")
    return found


def variants(study: Mapping[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    """Return (name, changed settings) of each variant of a study, the configured one first."""
    return [("as configured", {}), *((one["name"], one["changes"]) for one in study["variants"])]
