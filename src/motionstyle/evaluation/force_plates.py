"""Ground reaction forces estimated from markers alone, against force plates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.mocap.fitting.floor import runs
from motionstyle.motion.motion import Motion
from motionstyle.motion.resample import lowpass

Array = NDArray[np.float64]
GRAVITY = 9.81
LOADED_N = 20.0  # a plate bears a foot above this
CARRIED = 0.5  # share of the weight
FEWEST_FRAMES = 5
PLATE_CUTOFF_HZ = 20.0
COMPONENTS = {"vertical": 1, "fore_aft": 0, "lateral": 2}
FORCE_PLATE_COLUMNS = (
    *("id", "dataset", "config", "action", "style", "surface", "foot", "component", "mass_kg"),
    *("mass_source", "rms_pctbw", "correlation", "peak_estimated_pctbw", "peak_plate_pctbw"),
    *("rms_n", "plate_over_estimate", "rms_own_pctbw"),
    *("impulse_estimated_bws", "impulse_plate_bws", "seconds_compared", "status", "reason"),
)


@dataclass(frozen=True)
class FootForce:
    """A foot's force on the person over time, in the motion's axes: times (T,) s, (T, 3) N."""

    times: Array
    force: Array

    def at(self, times: Array) -> Array:
        """Return the force at other times, low-passed first; NaN outside the record."""
        rate = (len(self.times) - 1) / (self.times[-1] - self.times[0])
        smooth = lowpass(np.nan_to_num(self.force), rate, PLATE_CUTOFF_HZ)
        columns = [
            np.interp(times, self.times, smooth[:, a], left=np.nan, right=np.nan) for a in range(3)
        ]
        return np.stack(columns, axis=1)


def compared_frames(
    plate: Array, estimated: Array, both: Array, weight: float
) -> NDArray[np.bool_]:
    """Return the frames in which a foot is judged, (F,).

    Where its plate bears it, and where the estimate does: in a stance that its plate saw, or in
    one all along which the plates carry the person, so that a load made up in swing counts and a
    step beside the plates does not.

    Parameters
    ----------
    plate, estimated : vertical force of the foot, (F,), N. both : of all plates together, (F,).
    weight : of the person, N; plates that bear half of it carry the person.
    """
    known = np.isfinite(plate)
    seen = known & (np.nan_to_num(plate) > LOADED_N)
    judged = seen.copy()
    carried = known & (both > CARRIED * weight)
    for first, last in runs(known & (estimated > LOADED_N)):
        stance = slice(first, last + 1)
        if seen[stance].any() or carried[stance].all():
            judged[stance] = True
    return judged


def force_plate_rows(
    motion: Motion, plates: Mapping[str, FootForce], config_name: str
) -> list[dict[str, object]]:
    """Return one row per foot and component with `FORCE_PLATE_COLUMNS`.

    Parameters
    ----------
    motion : physical, with contact forces; no plate value entered them.
    plates : measured forces by foot, "r" and "l", on the motion's clock and in its axes.
    """
    known = motion.provenance
    shared = {
        "id": known.get("example", motion.id),
        "dataset": known.get("dataset", ""),
        "config": config_name,
        **{name: known.get(name, "") for name in ("action", "style", "surface")},
        "mass_kg": motion.body.mass,
        "mass_source": motion.body.mass_source,
    }
    weight = motion.body.mass * GRAVITY
    feet = {foot: judged_foot(motion, plates, foot) for foot in plates}
    ratio = weight_ratio(list(feet.values()))
    rows = []
    for foot, (estimated, plate, judged) in feet.items():
        for component, axis in COMPONENTS.items():
            row: dict[str, object] = {**shared, "foot": foot, "component": component}
            if judged.sum() < FEWEST_FRAMES:
                reason = f"the plate saw this foot in fewer than {FEWEST_FRAMES} frames"
                rows.append({**row, "status": "not compared", "reason": reason})
                continue
            ours, theirs = estimated[judged, axis] / weight, plate[judged, axis] / weight
            spread = ours.std() * theirs.std()
            rms = float(np.sqrt(((ours - theirs) ** 2).mean()))
            rows.append(
                row
                | {
                    "rms_pctbw": 100 * rms,
                    "rms_n": rms * weight,
                    "plate_over_estimate": ratio,
                    "rms_own_pctbw": 100 * float(np.sqrt(((ours - theirs / ratio) ** 2).mean())),
                    "correlation": float(np.corrcoef(ours, theirs)[0, 1]) if spread else np.nan,
                    "peak_estimated_pctbw": 100 * float(ours[np.argmax(np.abs(ours))]),
                    "peak_plate_pctbw": 100 * float(theirs[np.argmax(np.abs(theirs))]),
                    "impulse_estimated_bws": float(ours.sum() / motion.rate_hz),
                    "impulse_plate_bws": float(theirs.sum() / motion.rate_hz),
                    "seconds_compared": float(judged.sum() / motion.rate_hz),
                    "status": "ok",
                }
            )
    return rows


def judged_foot(
    motion: Motion, plates: Mapping[str, FootForce], foot: str
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return a foot's estimated and measured force (F, 3), N, and the frames to be judged (F,)."""
    measured = {name: record.at(motion.times) for name, record in plates.items()}
    both = np.nansum([force[:, 1] for force in measured.values()], axis=0)
    points = slice(0, 4) if foot == "r" else slice(4, 8)
    estimated = motion.contact_forces[:, points].sum(axis=1)
    weight = motion.body.mass * GRAVITY
    judged = compared_frames(measured[foot][:, 1], estimated[:, 1], both, weight)
    return estimated, measured[foot], judged


def weight_ratio(feet: Sequence[tuple[Array, Array, NDArray[np.bool_]]]) -> float:
    """Return by what the estimate has to be multiplied to be as heavy as the plates.

    Least squares over the vertical forces of all judged frames: 1 but for the mass, which is the
    sheet's or a default. The estimate does not know it; it only tells errors of mass from others.
    """
    ours = np.concatenate([estimated[judged, 1] for estimated, _plate, judged in feet])
    theirs = np.concatenate([plate[judged, 1] for _estimated, plate, judged in feet])
    squared = float((ours**2).sum())
    return float((ours * theirs).sum()) / squared if squared else float("nan")


def force_curves(motion: Motion, plates: Mapping[str, FootForce]) -> list[dict[str, Any]]:
    """Return, per foot, times (s) and estimated and measured force in body weights, for figures.

    Lists of three components in the order of `COMPONENTS`; None where the plates say nothing.
    """
    weight = motion.body.mass * GRAVITY
    curves = []
    for foot, record in plates.items():
        points = slice(0, 4) if foot == "r" else slice(4, 8)
        estimated = motion.contact_forces[:, points].sum(axis=1) / weight
        measured = record.at(motion.times) / weight
        curves.append(
            {
                "foot": foot,
                "times": motion.times.tolist(),
                "estimated": [estimated[:, axis].tolist() for axis in COMPONENTS.values()],
                "measured": [
                    [float(v) if np.isfinite(v) else None for v in measured[:, axis]]
                    for axis in COMPONENTS.values()
                ],
            }
        )
    return curves
