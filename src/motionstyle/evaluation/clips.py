"""`tables/clips.csv`: one row per clip of the sheet, whether it became a motion or not.

Numbers that a clip does not show are nan; `motionstyle.tables` writes them as empty cells.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from motionstyle.evaluation.gait import (
    cadence,
    foot_slip_mm,
    foot_stances,
    mean_speed,
    penetration_mm,
    step_lengths,
)
from motionstyle.motion.motion import Motion

CLIP_COLUMNS: tuple[str, ...] = (
    "id",
    "dataset",
    "config",
    "action",
    "style",
    "subject",
    "kind",
    "frames",
    "rate_hz",
    "marker_rms_cm",
    "speed_mps",
    "step_length_m",
    "cadence_spm",
    "contacts",
    "foot_slip_mm",
    "penetration_mm",
    "floor_tilt_deg",
    "rebranched_frames",
    "repaired_frames",
    "leg_length_m",
    "measured_on",
    "mass_kg",
    "mass_source",
    "warnings",
    "succeeded",
    "status",
    "reason",
)
_REPORTED = ("marker_rms_cm", "floor_tilt_deg", "rebranched_frames", "repaired_frames", "warnings")


def clip_row(motion: Motion, report: Mapping[str, Any], config_name: str) -> dict[str, object]:
    """Return the row of a clip that became a motion, with the columns `CLIP_COLUMNS`.

    Parameters
    ----------
    motion : the motion; its provenance gives dataset, action, style and subject.
    report : what ingestion found (`Ingested.report`); columns it lacks stay empty.
    config_name : name of the configuration that ran.
    """
    provenance = motion.provenance
    lengths = step_lengths(motion)
    row: dict[str, object] = dict.fromkeys(CLIP_COLUMNS, "")
    row |= {name: provenance.get(name, "") for name in ("dataset", "action", "style", "subject")}
    row |= {name: report.get(name, "") for name in _REPORTED}
    row |= {
        "id": motion.id,
        "config": config_name,
        "kind": motion.kind,
        "frames": motion.frames,
        "rate_hz": motion.rate_hz,
        "speed_mps": mean_speed(motion),
        "step_length_m": float(lengths.mean()) if len(lengths) else math.nan,
        "cadence_spm": cadence(motion),
        "contacts": len(foot_stances(motion)),
        "foot_slip_mm": foot_slip_mm(motion),
        "penetration_mm": penetration_mm(motion),
        "leg_length_m": motion.body.leg_length,
        "measured_on": provenance.get("measured_on", "the clip"),
        "mass_kg": motion.body.mass,
        "mass_source": motion.body.mass_source,
        "succeeded": "yes",
        "status": "ok",
    }
    return row


def failed_clip_row(sidecar: Mapping[str, Any], reason: str, config_name: str) -> dict[str, object]:
    """Return the row of a clip that did not become a motion: no numbers, but the reason.

    Parameters
    ----------
    sidecar : the failed motion's sidecar (`motion.storage.save_failure`), with id, kind and
        what is known of its provenance.
    """
    known = sidecar.get("provenance", {})
    row: dict[str, object] = dict.fromkeys(CLIP_COLUMNS, "")
    row |= {name: known.get(name, "") for name in ("dataset", "action", "style", "subject")}
    return row | {
        "id": sidecar["id"],
        "config": config_name,
        "kind": sidecar.get("kind", "captured"),
        "succeeded": "no",
        "status": "failed",
        "reason": reason,
    }
