"""Gait against published values: `tables/gait.csv` and `tables/gait_angles.csv`.

The values and their sources stand in `config/normative_gait.yaml` (biomechanics.md §4).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.gait import (
    cadence,
    double_support,
    gait_cycles,
    joint_cycles,
    mean_speed,
    speed_error_pct,
    stance_fraction,
    step_lengths,
    step_widths,
)
from motionstyle.motion.motion import Motion

JOINT_ANGLES = ("hip_flexion", "knee_flexion", "ankle_dorsiflexion")
JOINT_MOMENTS = ("hip", "knee", "ankle")
BAND_COLUMNS: tuple[str, ...] = (
    "id",
    "dataset",
    "config",
    "action",
    "surface",
    "joint",
    "cycle_pct",
    "mean_deg",
    "low_deg",
    "midpoint_deg",
    "high_deg",
    "inside_band",
    "has_cycle",
    "cycles",
)
GAIT_COLUMNS: tuple[str, ...] = (
    "id",
    "dataset",
    "config",
    "kind",
    "action",
    "style",
    "mood",
    "surface",
    "cycles",
    "speed_mps",
    "step_length_m",
    "cadence_spm",
    "step_width_cm",
    "stance_pct",
    "double_support_pct",
    "speed_error_pct",
    "within_bands",
    "has_cycle",
)
_ACCEPTANCE = ("step_width_cm", "stance_pct", "double_support_pct", "speed_error_pct")


@dataclass(frozen=True)
class Band:
    """A published range at one instant of the cycle: of an angle, deg, or a moment, N·m/kg."""

    low: float
    midpoint: float
    high: float

    def holds(self, value: float) -> bool:
        """Return whether a value lies in the band."""
        return self.low <= value <= self.high


@dataclass(frozen=True)
class Normative:
    """Published values of level walking.

    angles : joint angle → percent of cycle → band, deg. moments : joint → percent of cycle → band,
    N·m/kg. acceptance : column of `GAIT_COLUMNS` → (low,
    high). neutral_styles : styles of the sheets that mean ordinary walking. source : of the angles.
    """

    angles: Mapping[str, Mapping[int, Band]]
    moments: Mapping[str, Mapping[int, Band]]
    acceptance: Mapping[str, tuple[float, float]]
    neutral_styles: frozenset[str]
    source: str


def read_normative(path: str | Path) -> Normative:
    """Read `config/normative_gait.yaml`.

    Raises
    ------
    MotionStyleError
        If a joint, an instant or a band is missing or out of order.
    """
    try:
        data = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
        angles, moments = (
            {
                joint: {int(pct): Band(*map(float, row)) for pct, row in data[kind][joint].items()}
                for joint in joints
            }
            for kind, joints in (("angles", JOINT_ANGLES), ("moments", JOINT_MOMENTS))
        )
        acceptance = {
            name: (float(band[0]), float(band[1]))
            for name in _ACCEPTANCE
            for band in [data["spatiotemporal"][name]["band"]]
        }
        neutral = frozenset(map(str, data["neutral_styles"]))
        source = str(data["source"]).strip()
    except (OSError, yaml.YAMLError, KeyError, IndexError, TypeError, ValueError) as error:
        raise MotionStyleError(
            f"{path}: not a file of normative gait values ({error!r}); compare it with the one "
            "in the repository"
        ) from error
    for joint, bands in [*angles.items(), *moments.items()]:
        for percent, band in bands.items():
            if not band.low <= band.midpoint <= band.high or not 0 <= percent <= 100:
                raise MotionStyleError(
                    f"{path}: {joint} at {percent} %: expected low ≤ midpoint ≤ high within "
                    f"0–100 % of the cycle, found {band.low}, {band.midpoint}, {band.high}"
                )
    return Normative(angles, moments, acceptance, neutral, source)


def mood(motion: Motion, normative: Normative) -> str:
    """Return "neutral" for styles that mean ordinary movement, otherwise the style."""
    style = str(motion.provenance.get("style", ""))
    return "neutral" if style in normative.neutral_styles else style


def is_level_walk(motion: Motion, normative: Normative) -> bool:
    """Return whether a motion is captured ordinary walking on level ground."""
    return (
        motion.kind == "captured"
        and motion.provenance.get("action") == "walk"
        and motion.provenance.get("surface") == "level"
        and mood(motion, normative) == "neutral"
    )


def band_table(
    motions: Iterable[Motion], normative: Normative, config_name: str
) -> list[dict[str, object]]:
    """Return the mean joint angles of both legs against the bands, with `BAND_COLUMNS`.

    A motion without a complete cycle has rows with nan means and 0 cycles.
    """
    rows: list[dict[str, object]] = []
    for motion in motions:
        known = motion.provenance
        for joint, bands in normative.angles.items():
            cycles = joint_cycles(motion, joint, 101)
            for percent, band in bands.items():
                mean = float(cycles[:, percent].mean()) if len(cycles) else float("nan")
                inside = ("yes" if band.holds(mean) else "no") if len(cycles) else ""
                values = (
                    motion.id,
                    known.get("dataset", ""),
                    config_name,
                    known.get("action", ""),
                    known.get("surface", ""),
                    joint.split("_")[0],
                    percent,
                    mean,
                    band.low,
                    band.midpoint,
                    band.high,
                    inside,
                    "yes" if len(cycles) else "no",
                    len(cycles),
                )
                rows.append(dict(zip(BAND_COLUMNS, values, strict=True)))
    return rows


def gait_row(motion: Motion, normative: Normative, config_name: str) -> dict[str, object]:
    """Return a motion's row of `tables/gait.csv`, with `GAIT_COLUMNS`; unknown numbers are nan.

    within_bands is yes, no, or empty when one of the banded numbers is unknown.
    """
    known = motion.provenance
    lengths, widths = step_lengths(motion), step_widths(motion)
    numbers = {
        "speed_mps": mean_speed(motion),
        "step_length_m": float(np.mean(lengths)) if len(lengths) else float("nan"),
        "cadence_spm": cadence(motion),
        "step_width_cm": 100 * float(np.mean(widths)) if len(widths) else float("nan"),
        "stance_pct": 100 * stance_fraction(motion),
        "double_support_pct": 100 * double_support(motion),
        "speed_error_pct": speed_error_pct(motion),
    }
    banded = [numbers[name] for name in normative.acceptance]
    within = all(low <= numbers[name] <= high for name, (low, high) in normative.acceptance.items())
    row: dict[str, object] = {
        "id": motion.id,
        "dataset": known.get("dataset", ""),
        "config": config_name,
        "kind": motion.kind,
        "action": known.get("action", ""),
        "style": known.get("style", ""),
        "mood": mood(motion, normative),
        "surface": known.get("surface", ""),
        "cycles": sum(len(gait_cycles(motion, side)) for side in "rl"),
        **numbers,
        "within_bands": "" if np.isnan(banded).any() else ("yes" if within else "no"),
        "has_cycle": "no" if np.isnan(banded).any() else "yes",
    }
    return {name: row[name] for name in GAIT_COLUMNS}
