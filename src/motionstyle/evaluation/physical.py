"""The table of physical motions: how near their markers, and how well they obey Newton."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

PHYSICAL_COLUMNS = (
    *("id", "dataset", "config", "action", "surface", "frames", "rate_hz"),
    *("mass_kg", "mass_source"),
    *("marker_rms_cm", "root_force_rms_n", "root_moment_rms_nm", "root_force_rms_pctbw"),
    *("root_share_of_E_pct", "foot_slip_mm", "penetration_mm", "range_excess_deg"),
    *("shoe_stiffness_npm", "shoe_rest_mm"),
    *("vertical_mean_bw", "vertical_peak_bw", "markers", "used_by_nio"),
    *("iterations", "optimality", "seconds", "succeeded", "status", "reason"),
)


def physical_row(report: Mapping[str, Any], config_name: str) -> dict[str, object]:
    """Return a motion's row with `PHYSICAL_COLUMNS` from the report of its fit."""
    row: dict[str, object] = {name: report.get(name, "") for name in PHYSICAL_COLUMNS}
    succeeded = report["status"] == "converged"
    return row | {"config": config_name, "succeeded": succeeded}
