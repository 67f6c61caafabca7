"""`tables/known_truth.csv`: every test whose answer was known beforehand, one row a solve."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from motionstyle.files import read_json

# Part 1 is the solver's: known optima and twins' motions; part 2 the learner's: twins' styles.
KNOWN_TRUTH_COLUMNS = (
    *("config", "test", "part", "data", "problem", "seed", "start", "noise", "status", "E"),
    *("E_gap_to_best_pct", "joint_rms_deg", "start_rms_deg", "target_status", "target_E"),
    "objective_error_pct",
    *("G_over_E_target", "new_constraints_rms_deg", "log_alpha_correlation"),
    *("optimality", "iterations", "seconds", "reason"),
)


def known_truth_rows(files: Iterable[str | Path], config: str) -> list[dict[str, Any]]:
    """Return the rows of JSON files that hold a list `rows` each; all count as planted."""
    common = {"config": config, "data": "planted"}
    return [{**common, **row} for file in files for row in read_json(Path(file))["rows"]]


def optimum_row(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a row of `tables/known_optima.csv` is in the table of known truths."""
    kept = ("problem", "status", "objective_error_pct", "optimality", "iterations", "seconds")
    return {
        "test": "analytic_optimum",
        "part": 1,
        "E": row["E_solver"],
        "target_E": row["E_analytic"],
        **{name: row[name] for name in kept},
    }
