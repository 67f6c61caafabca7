"""Sagittal joint moments of physical motions, against published bands and against force plates.

Internal net moments per kg of body mass, positive for hip flexors, knee flexors and ankle
dorsiflexors (biomechanics.md §4.4).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.layout import CONTACT_POINTS
from motionstyle.dynamics.codegen import FrameFunction
from motionstyle.evaluation.force_plates import GRAVITY, LOADED_N, PLATE_CUTOFF_HZ
from motionstyle.evaluation.gait import Cycle, gait_cycles, normalised_cycles
from motionstyle.evaluation.joint_loads import JointLoads, Wrench, joint_loads
from motionstyle.evaluation.normative import Normative, is_level_walk
from motionstyle.mocap.formats.marker_clip import ForceRecord
from motionstyle.motion.motion import Motion
from motionstyle.motion.resample import lowpass

Array = NDArray[np.float64]
# OpenSim's coordinate of each joint's sagittal moment, without the side.
SAGITTAL = {"hip": "hip_flexion", "knee": "knee_angle", "ankle": "ankle_angle"}
INSTANTS = (0, 25, 50)  # percent of the cycle
SEEN_SHARE = 0.8  # of a cycle's stance that its plate must bear for the cycle to be compared
FEWEST_FRAMES = 5
_SHARED = ("id", "dataset", "config", "action", "style", "surface", "side", "joint")
_MASS = ("mass_kg", "mass_source")
JOINT_MOMENT_COLUMNS = (
    *_SHARED,
    *("cycle_pct", "moment_nm_per_kg", "low", "midpoint", "high", "inside_band"),
    *("measured_nm_per_kg", "measured_inside_band", "has_band", "has_cycle", "cycles"),
    *("plate_cycles", "root_force_rms_pctbw", *_MASS),
)
PLATE_MOMENT_COLUMNS = (
    *_SHARED,
    *("rms_difference_nm_per_kg", "correlation", "peak_estimated_nm_per_kg"),
    *("peak_measured_nm_per_kg", "seconds_compared", *_MASS, "status", "reason"),
)


@dataclass(frozen=True)
class MeasuredFoot:
    """What a plate did to one foot, on a motion's frames.

    force : (F, 3), N. moment : about the world's origin, (F, 3), N·m. loaded : whether the plate
    bears the foot, (F,).
    """

    force: Array
    moment: Array
    loaded: NDArray[np.bool_]


def measured_foot(
    times: Array, force: Array, centre: Array, moment: Array, frames: Array
) -> MeasuredFoot:
    """Bring a plate's record of one foot to a motion's frames.

    Force and moment about the origin are low-passed, not the centre of pressure, which is not
    defined where the plate is unloaded.

    Parameters
    ----------
    times : (T,), s. force, centre, moment : (T, 3), N, m (NaN where unloaded) and N·m about the
    centre. frames : times of the motion's frames, s, (F,); outside the record nothing is loaded.
    """
    rate = (len(times) - 1) / (times[-1] - times[0])
    whole = np.nan_to_num(moment) + np.cross(np.nan_to_num(centre), np.nan_to_num(force))
    both = lowpass(np.concatenate([np.nan_to_num(force), whole], axis=1), rate, PLATE_CUTOFF_HZ)
    values = np.stack([np.interp(frames, times, c, left=0.0, right=0.0) for c in both.T], axis=1)
    return MeasuredFoot(values[:, :3], values[:, 3:], values[:, 1] > LOADED_N)


def measured_feet(motion: Motion, record: ForceRecord) -> dict[str, MeasuredFoot]:
    """Return the plates' record by foot (`markers.plate_feet`) on a motion's frames, by side."""
    each = zip(record.names, record.force, record.centre, record.moment, strict=True)
    return {
        name[0]: measured_foot(record.times, force, centre, moment, motion.times)
        for name, force, centre, moment in each
    }


def measured_loads(
    motion: Motion, functions: Mapping[str, FrameFunction], feet: Mapping[str, MeasuredFoot]
) -> JointLoads:
    """Return joint moments with the measured forces in place of the estimated ones.

    feet : by side. A leg's moments hold where its own plate bears the foot, or the foot swings.
    """
    wrenches = [Wrench(f"foot_{s}", foot.force, foot.moment) for s, foot in feet.items()]
    return joint_loads(motion, functions, wrenches)


def _stands(motion: Motion, side: str) -> NDArray[np.bool_]:
    own = [i for i, name in enumerate(CONTACT_POINTS) if name.endswith(f"_{side}")]
    return motion.contacts[:, own].any(axis=1)


def seen_cycles(motion: Motion, side: str, foot: MeasuredFoot) -> list[Cycle]:
    """Return the cycles of a foot through whose stance its plate bears it."""
    stands = _stands(motion, side)

    def seen(cycle: Cycle) -> bool:
        stance = np.flatnonzero(stands[cycle[0] : cycle[1]]) + cycle[0]
        return len(stance) > 0 and foot.loaded[stance].mean() >= SEEN_SHARE

    return [cycle for cycle in gait_cycles(motion, side) if seen(cycle)]


def _shared(motion: Motion, config_name: str) -> dict[str, object]:
    known = motion.provenance
    return {
        "id": known.get("example", motion.id),
        "config": config_name,
        **{name: known.get(name, "") for name in ("dataset", "action", "style", "surface")},
        "mass_kg": motion.body.mass,
        "mass_source": motion.body.mass_source,
    }


def mean_cycle(loads: JointLoads, motion: Motion, side: str, joint: str, cycles: list) -> Array:
    """Return a joint's mean moment over cycles, (101,), N·m/kg; NaN without a cycle."""
    signal = loads.moments[f"{SAGITTAL[joint]}_{side}"] / motion.body.mass
    found = normalised_cycles(signal, cycles, 101)
    return found.mean(axis=0) if len(found) else np.full(101, np.nan)


def joint_moment_rows(
    motion: Motion,
    estimated: JointLoads,
    normative: Normative,
    config_name: str,
    measured: JointLoads | None = None,
    feet: Mapping[str, MeasuredFoot] | None = None,
) -> list[dict[str, object]]:
    """Return a row with `JOINT_MOMENT_COLUMNS` per side, joint and instant of the cycle.

    Bands belong to ordinary level walking; other movements have values alone. A motion without
    a complete cycle of a side has rows without values there.

    Parameters
    ----------
    estimated : moments under the motion's own forces. measured, feet : those under the plates'.
    """
    shared = _shared(motion, config_name)
    level = is_level_walk(motion, normative)
    weight = motion.body.mass * GRAVITY
    root = float(np.sqrt((estimated.root_force**2).sum(axis=1).mean()))
    rows = []
    for side in "rl":
        cycles = gait_cycles(motion, side)
        foot = (feet or {}).get(side)
        seen = seen_cycles(motion, side, foot) if foot is not None else []
        for joint in SAGITTAL:
            ours = mean_cycle(estimated, motion, side, joint, cycles)
            theirs = mean_cycle(measured or estimated, motion, side, joint, seen)
            for percent in INSTANTS:
                band = normative.moments[joint].get(percent) if level else None
                value, other = float(ours[percent]), float(theirs[percent])
                judged = band is not None and bool(cycles)
                rows.append(
                    shared
                    | {"side": side, "joint": joint, "cycle_pct": percent}
                    | {"moment_nm_per_kg": value, "measured_nm_per_kg": other}
                    | ({n: getattr(band, n) for n in ("low", "midpoint", "high")} if band else {})
                    | {
                        "inside_band": band.holds(value) if judged else "",
                        "measured_inside_band": band.holds(other) if judged and seen else "",
                        "has_band": band is not None,
                        "has_cycle": bool(cycles),
                        "cycles": len(cycles),
                        "plate_cycles": len(seen),
                        "root_force_rms_pctbw": 100 * root / weight,
                    }
                )
    return rows


def plate_moment_rows(
    motion: Motion,
    estimated: JointLoads,
    measured: JointLoads,
    feet: Mapping[str, MeasuredFoot],
    config_name: str,
) -> list[dict[str, object]]:
    """Return a row with `PLATE_MOMENT_COLUMNS` per foot and joint, over the frames it is borne."""
    shared = _shared(motion, config_name)
    rows = []
    for side, foot in feet.items():
        for joint, name in SAGITTAL.items():
            row: dict[str, object] = {**shared, "side": side, "joint": joint}
            if foot.loaded.sum() < FEWEST_FRAMES:
                reason = f"the plate saw this foot in fewer than {FEWEST_FRAMES} frames"
                rows.append({**row, "status": "not compared", "reason": reason})
                continue
            ours, theirs = (
                loads.moments[f"{name}_{side}"][foot.loaded] / motion.body.mass
                for loads in (estimated, measured)
            )
            spread = ours.std() * theirs.std()
            rows.append(
                row
                | {
                    "rms_difference_nm_per_kg": float(np.sqrt(((ours - theirs) ** 2).mean())),
                    "correlation": float(np.corrcoef(ours, theirs)[0, 1]) if spread else np.nan,
                    "peak_estimated_nm_per_kg": float(ours[np.abs(ours).argmax()]),
                    "peak_measured_nm_per_kg": float(theirs[np.abs(theirs).argmax()]),
                    "seconds_compared": float(foot.loaded.sum() / motion.rate_hz),
                    "status": "ok",
                }
            )
    return rows


def cycle_curves(
    motion: Motion,
    estimated: JointLoads,
    normative: Normative,
    measured: JointLoads | None = None,
    feet: Mapping[str, MeasuredFoot] | None = None,
) -> dict[str, Any]:
    """Return a motion's mean cycles for the figure: by source of force, joint and side.

    Sides without a complete (for plates: seen) cycle are left out.
    """
    curves: dict[str, Any] = {
        source: {joint: {} for joint in SAGITTAL} for source in ("estimated", "measured")
    }
    for side in "rl":
        foot = (feet or {}).get(side)
        seen = seen_cycles(motion, side, foot) if foot is not None else []
        sources = [
            ("estimated", estimated, gait_cycles(motion, side)),
            ("measured", measured, seen),
        ]
        for source, loads, cycles in sources:
            if loads is not None and cycles:
                for joint in SAGITTAL:
                    found = mean_cycle(loads, motion, side, joint, cycles)
                    curves[source][joint][side] = found.tolist()
    return {
        "action": str(motion.provenance.get("action", "")),
        "level_walk": is_level_walk(motion, normative),
        **curves,
    }


def plate_curves(
    motion: Motion,
    estimated: JointLoads,
    measured: JointLoads,
    feet: Mapping[str, MeasuredFoot],
) -> list[dict[str, Any]]:
    """Return moments over time per foot, for the figure; None where the plate bears nothing."""
    curves = []
    for side, foot in feet.items():
        ours, theirs = (
            [loads.moments[f"{name}_{side}"] / motion.body.mass for name in SAGITTAL.values()]
            for loads in (estimated, measured)
        )
        hidden = [
            [float(v) if on else None for v, on in zip(one, foot.loaded, strict=True)]
            for one in theirs
        ]
        curves.append(
            {
                "foot": side,
                "times": motion.times.tolist(),
                "estimated": [one.tolist() for one in ours],
                "measured": hidden,
            }
        )
    return curves
