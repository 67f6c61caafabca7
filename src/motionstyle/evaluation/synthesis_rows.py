"""Whether synthesised motions are sound, and the rows of `tables/syntheses.csv`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.kinematics import contact_points
from motionstyle.body.layout import JOINT_COORDINATES
from motionstyle.evaluation.syntheses import (
    MEASURES,
    closer_to_own,
    joint_rms_deg,
    style_distance_deg,
)
from motionstyle.motion.motion import Motion
from motionstyle.spacetime.foot_constraints import FootConstraints
from motionstyle.spacetime.synthesis_plan import Plan
from motionstyle.spacetime.synthesis_sheet import SynthesisRow

Array = NDArray[np.float64]

CONE_TOLERANCE_N = 0.5
RANGE_TOLERANCE_DEG = 0.1
SYNTHESIS_COLUMNS = (
    *("config", "id", "kind", "experiment", "task", "example", "style", "mood", "action"),
    *("subject", "data", "status", "reason", "frames", "rate_hz", "seconds", "iterations"),
    *("E", "optimality", "root_share_of_E_pct"),
    *("foot_error_mm", "foot_rms_mm", "penetration_mm", "penetration_beyond_clearance_mm"),
    *("cone_excess_n", "cone_kept", "joint_range_excess_deg", "joint_ranges_kept"),
    *MEASURES,
    *("style_distance_own_deg", "closer_to_own_style", "closer_to_own_subject"),
    *("joint_rms_to_captured_deg", "style_warning"),
)


def foot_errors_mm(motion: Motion, feet: FootConstraints) -> Array:
    """Return how far each held point is from its target, or a sliding one from its surface."""
    away = contact_points(motion.body, motion.pose()) - feet.targets
    normal = np.abs((away * feet.normals).sum(axis=-1))
    error = np.where(feet.sliding, normal, np.linalg.norm(away, axis=-1))
    return 1000 * error[feet.held]


def foot_error_mm(motion: Motion, feet: FootConstraints) -> float:
    """Return the largest distance of a held point from its target."""
    errors = foot_errors_mm(motion, feet)
    return float(errors.max()) if len(errors) else 0.0


def depth_mm(motion: Motion, feet: FootConstraints, *, allowed: bool = False) -> float:
    """Return how deep the deepest foot point lies below its surface; 0 if none does.

    allowed : count only what is deeper than the clearance allows (a captured motion's own sinking).
    """
    above = (contact_points(motion.body, motion.pose()) - feet.ground) * feet.normals
    heights = above.sum(axis=-1)
    if allowed:
        heights = heights - np.where(feet.held, 0.0, np.minimum(feet.clearance, 0.0))
    return 1000 * max(0.0, -float(heights.min()))


def cone_excess_n(motion: Motion, feet: FootConstraints) -> float:
    """Return by how much the worst contact force leaves its friction cone, N; nan without forces.

    Pulling on the ground and pushing with a point that is not held count in full.
    """
    return (
        float("nan") if motion.contact_forces is None else feet.cone_excess(motion.contact_forces)
    )


def range_excess_deg(motion: Motion, ranges: Array) -> float:
    """Return by how much the worst joint angle leaves its range (35, 2)."""
    q = motion.coordinates
    excess = np.maximum(ranges[:, 0] - q, q - ranges[:, 1])[:, JOINT_COORDINATES]
    return float(np.degrees(max(0.0, float(excess.max()))))


def synthesis_measures(
    motion: Motion,
    feet: FootConstraints,
    ranges: Array,
    *,
    own: Motion | None = None,
    others: Sequence[Motion] = (),
    captured: Motion | None = None,
) -> dict[str, object]:
    """Return the measured columns of a row of `tables/syntheses.csv`.

    Parameters
    ----------
    feet, ranges : what the motion was made under.
    own : the captured motion of the style's clip. others : captured motions of other styles, or of
        the same style by other subjects.
    captured : the captured motion with the same footprints, if there is one.
    """
    errors = foot_errors_mm(motion, feet)
    cone, excess = cone_excess_n(motion, feet), range_excess_deg(motion, ranges)
    row: dict[str, object] = {
        "frames": motion.frames,
        "rate_hz": motion.rate_hz,
        "foot_error_mm": foot_error_mm(motion, feet),
        "foot_rms_mm": float(np.sqrt((errors**2).mean())) if len(errors) else 0.0,
        "penetration_mm": depth_mm(motion, feet),
        "penetration_beyond_clearance_mm": depth_mm(motion, feet, allowed=True),
        "cone_excess_n": cone,
        "cone_kept": None if np.isnan(cone) else cone <= CONE_TOLERANCE_N,
        "joint_range_excess_deg": excess,
        "joint_ranges_kept": excess <= RANGE_TOLERANCE_DEG,
        **{name: measure(motion) for name, measure in MEASURES.items()},
    }
    if captured is not None:
        row["joint_rms_to_captured_deg"] = joint_rms_deg(motion, captured)
    if own is None:
        return row
    row["style_distance_own_deg"] = style_distance_deg(motion, own)
    subject = own.provenance.get("subject")
    same = [one for one in others if one.provenance.get("subject") == subject]
    foreign = [one for one in others if one.provenance.get("subject") != subject]
    row["closer_to_own_style"] = closer_to_own(motion, own, same)
    row["closer_to_own_subject"] = closer_to_own(motion, own, foreign)
    return row


def synthesis_rows(
    row: SynthesisRow,
    plan: Plan | None,
    motions: Mapping[str, Motion],
    reports: Mapping[str, Mapping[str, Any]],
    config: str,
    *,
    own: Motion | None,
    others: Sequence[Motion],
    captured: Motion | None,
) -> list[dict[str, object]]:
    """Return the rows of one synthesis: the motion itself (`nio`), `warp` and `copied`.

    Parameters
    ----------
    plan : None where the footprints have failed; the rows then give the reason.
    motions : by kind, those that could be made. reports : of the solvers, by kind.
    own, others, captured : see `synthesis_measures`.
    """
    about = own.provenance if own is not None else {}
    rows = []
    for kind in ("nio", "warp", "copied"):
        report = reports.get(kind, reports["warp"] if kind == "copied" else {})
        result: dict[str, object] = {
            "config": config,
            "id": row.id,
            "kind": kind,
            "experiment": row.experiment,
            "task": row.task,
            "example": row.example,
            "style": row.style,
            "mood": row.mood,
            "action": about.get("action"),
            "subject": about.get("subject"),
            "data": "planted" if row.recipe == "twin" else "captured",
        }
        if plan is not None and kind in motions:
            result |= synthesis_measures(
                motions[kind], plan.feet, plan.ranges, own=own, others=others, captured=captured
            )
        if kind != "copied":
            known = {name: report[name] for name in SYNTHESIS_COLUMNS if name in report}
            result |= known
        elif kind in motions:
            result["status"] = "ok"
        else:
            result |= {"status": "failed", "reason": report.get("reason")}
        if result.get("reason"):
            result["reason"] = "; ".join(str(result["reason"]).splitlines())
        if "cone_excess_n" in report:
            result["cone_kept"] = report["cone_excess_n"] <= CONE_TOLERANCE_N
        rows.append({k: None if _is_nan(v) else v for k, v in result.items()})
    return rows


def _is_nan(value: object) -> bool:
    return isinstance(value, float) and np.isnan(value)
