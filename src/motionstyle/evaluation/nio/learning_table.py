"""`tables/nio_learning.csv`, `tables/resynthesis.csv`: rows of learning and judging, put together.

Jobs write records: what style they were of, whether they came to their end, and their rows.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from motionstyle.nio.styles_sheet import StyleRow

STYLE_COLUMNS = ("style", "clip", "data", "set", "action", "mood")
LEARNING_COLUMNS = (
    *("config", *STYLE_COLUMNS, "algorithm", "inner", "iteration", "last", "last_step"),
    *("step_10", "accepted"),
    *("G", "G_over_E_target", "E_target", "E_synth", "muscle_target", "root_target"),
    *("muscle_synth", "root_synth", "muscle_gap_over_E_target", "root_gap_over_E_target"),
    *(
        "objective",
        "not_rising",
        "joint_error_deg",
        "status",
        "optimality",
        "inner_iterations",
        "optima",
    ),
    *("inner_solves", "closeness", "gain", "step", "effective_joints_in_alpha"),
    *("effective_joints_in_E", "alpha_on_idle_joints", "passive_over_muscle", "seconds", "reason"),
)
RESYNTHESIS_COLUMNS = (
    *("config", *STYLE_COLUMNS, "algorithm", "variant", "ends", "start", "seed", "status"),
    *("joint_rms_deg", "joint_error_middle_deg", "captured_error_deg", "root_path_rms_cm"),
    *("ground_reaction_rms_pctbw", "high_frequency_rms_deg", "target_high_frequency_rms_deg"),
    *("E_target", "E_synth", "total", "G", "G_over_E_target", "root_share_of_E_pct"),
    *("foot_error_mm", "effective_joints_in_alpha", "synth_passive_over_muscle", "above_best_pct"),
    *(
        "from_first_start_deg",
        "paper_status",
        "beats_paper",
        "optimality",
        "iterations",
        "solver_seconds",
    ),
    *("projection_status", "projection_angle_rms_deg", "projection_root_n", "reason"),
)
_RISE = 1e-9  # relative: rounding
EARLY = 10  # steps; a learner that stopped before counts where it stopped


def style_cells(row: StyleRow) -> dict[str, Any]:
    """Return the columns that tell which style a table's row is of."""
    return {
        "style": row.id,
        "clip": row.clip,
        "data": "captured",
        "set": row.set,
        "action": row.action,
        "mood": row.mood,
    }


def learning_rows(
    learnt: Iterable[Mapping[str, Any]], judged: Iterable[Mapping[str, Any]], config: str
) -> list[dict[str, Any]]:
    """Return all steps of learning, and of each style a last row: its converged final solve.

    `inner` tells truncated from converged inner solves. The last row is the deepest optimum found
    from all starts of judging, the same for every algorithm.

    Parameters
    ----------
    learnt, judged : records of the jobs.
    """
    finals = {
        (one["cells"]["style"], one["algorithm"]): one
        for one in judged
        if one["kind"] == one["algorithm"]
    }
    rows: list[dict[str, Any]] = []
    for one in learnt:
        common = {"config": config, **one["cells"], "algorithm": one["algorithm"]}
        if one["status"] == "failed":
            rows.append({**common, "status": "failed", "reason": one["reason"], "last": False})
            continue
        truncated = one["algorithm"] != "ours"
        before = None
        for step in one["rows"]:
            inner = "converged" if step["status"] == "converged" else "truncated"
            row = {**common, **step, "last": False, "inner": "truncated" if truncated else inner}
            if one["algorithm"] == "paper":
                if before is not None:
                    row["not_rising"] = step["objective"] <= before * (1 + _RISE)
                before = step["objective"]
            rows.append(row)
        taken = [row for row in rows[len(rows) - len(one["rows"]) :] if row["accepted"]]
        if taken:
            taken[-1]["last_step"] = True
            early = [row for row in taken if row["iteration"] <= EARLY]
            early[-1]["step_10"] = True
        final = finals.get((one["cells"]["style"], one["algorithm"]))
        if final is not None and final["status"] != "failed":
            rows.append({**common, **_final(one["rows"], final["rows"])})
    return rows


def _final(steps: list[Mapping[str, Any]], judged: list[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the last row of a style: the deepest converged optimum of its final solves.

    What X_T alone decides is that of the last step taken.
    """
    taken = [step for step in steps if step["accepted"]] or steps
    done = [row for row in judged if row["status"] == "converged" and row["ends"] == "free"]
    deepest = min(done or judged, key=lambda row: row["total"])
    return {
        **{k: deepest[k] for k in ("G", "G_over_E_target", "E_target", "E_synth", "status")},
        **{k: deepest[k] for k in ("optimality", "effective_joints_in_alpha")},
        "inner": "converged" if done else "truncated",
        "iteration": steps[-1]["iteration"],
        "last": True,
        "accepted": True,
        "joint_error_deg": deepest["joint_rms_deg"],
        "inner_iterations": deepest["iterations"],
        **{k: taken[-1][k] for k in ("passive_over_muscle", "alpha_on_idle_joints")},
        "closeness": 0.0,
        "seconds": steps[-1]["seconds"],
    }


def resynthesis_rows(judged: Iterable[Mapping[str, Any]], config: str) -> list[dict[str, Any]]:
    """Return every final solve; ours from X_T with free ends says whether it beats the paper's.

    A solve that did not converge beats nothing, and is not counted where the paper's did not.
    """
    rows: list[dict[str, Any]] = []
    for one in judged:
        common = {"config": config, **one["cells"]}
        if one["status"] == "failed":
            kind = {k: one[k] for k in ("algorithm", "variant", "ends")}
            rows.append({**common, **kind, "status": "failed", "reason": one["reason"]})
            continue
        rows += [{**common, **one["projection"], **row} for row in one["rows"]]
    paper = {row["style"]: row for row in rows if _first(row, "paper")}
    for row in rows:
        other = paper.get(row["style"])
        if _first(row, "ours") and other is not None:
            row["paper_status"] = other["status"]
        if row.get("paper_status") == "converged":
            nearer = row.get("joint_rms_deg", float("inf")) < other["joint_rms_deg"]
            row["beats_paper"] = row["status"] == "converged" and nearer
    return rows


def _first(row: Mapping[str, Any], algorithm: str) -> bool:
    """Tell whether a row is an algorithm's own solve from X_T with free ends."""
    wanted = {"algorithm": algorithm, "variant": "full", "ends": "free", "start": "target"}
    return all(row.get(name) == value for name, value in wanted.items())
