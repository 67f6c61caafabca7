"""Which styles are judged, and how: every one of a captured window gets the same final solves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from motionstyle.nio.judging import Judged, ablated_styles, judge
from motionstyle.nio.learning_problem import LearningProblem
from motionstyle.spacetime.style import Style


@dataclass(frozen=True)
class Kind:
    """One way to be judged.

    algorithm, variant, ends : as in `tables/resynthesis.csv`. style : recipe of the learnt style
    it needs, or empty. perturbed : whether starts other than X_T count. title : for figures,
    where the kind's name is hard to read.
    """

    algorithm: str
    variant: str
    ends: str = "free"
    style: str = ""
    perturbed: bool = False
    title: str = ""


KINDS = {
    "ours": Kind("ours", "full", style="ours", perturbed=True),
    "paper": Kind("paper", "full", style="paper", perturbed=True),
    "ours_fixed": Kind("ours", "full", ends="fixed", style="ours"),
    "paper_fixed": Kind("paper", "full", ends="fixed", style="paper"),
    "initial": Kind("initial", "full"),
    "no_style_alpha_1": Kind("none", "no_style_alpha_1", title="no style, α = 1"),
    "no_style_alpha_1_29": Kind("none", "no_style_alpha_1_29", title="no style, α = 1/29"),
    "alpha_only": Kind("ours", "alpha_only", style="alpha_only"),
    "springs_left_out": Kind("ours", "springs_left_out", style="ours"),
    "least_squares": Kind("least_squares", "full", style="least_squares"),
    "no_cone": Kind("paper", "no_cone", style="no_cone"),
}


def without_springs(style: Style) -> Style:
    """Return a style of the same preferences without springs, dampers and shoes (E3)."""
    vector = np.zeros_like(style.vector())
    vector[: len(style.preferences)] = style.preferences
    return style.with_vector(vector)


def judged_style(name: str, learning: LearningProblem, learnt: Style | None) -> Style:
    """Return the style that a kind judges.

    Parameters
    ----------
    learnt : the style of the kind's recipe, where it has one.
    """
    ablated = ablated_styles(learning.start)
    if name in ablated:
        return ablated[name]
    if learnt is None:
        return learning.start
    return without_springs(learnt) if name == "springs_left_out" else learnt


def judge_kind(
    name: str, learning: LearningProblem, learnt: Style | None, perturbed: Sequence[int]
) -> Judged:
    """Return how a kind's style does.

    Parameters
    ----------
    perturbed : seeds of starts away from X_T, for kinds that take them, beside the one through
        gentler problems.
    """
    kind = KINDS[name]
    starts = ["target"]
    if kind.perturbed:
        starts += ["gentle", *(f"perturbed_{seed}" for seed in perturbed)]
    style = judged_style(name, learning, learnt)
    keep = learning.problem(style).basis().end_controls if kind.ends == "fixed" else 0
    judged = judge(learning, style, starts, keep_ends=keep)
    rows = [_renamed(kind, row) for row in judged.rows]
    provenance = {
        **judged.motion.provenance,
        "style": name,
        "solver_status": rows[0]["status"],
    }
    return replace(judged, rows=rows, motion=replace(judged.motion, provenance=provenance))


def _renamed(kind: Kind, row: dict[str, Any]) -> dict[str, Any]:
    """Return a judge's row under the table's names."""
    start, _, seed = str(row["start"]).partition("_")
    renamed = dict(row) | {
        "algorithm": kind.algorithm,
        "variant": kind.variant,
        "ends": kind.ends,
        "start": start,
        "seed": int(seed) if seed else None,
        "joint_rms_deg": row["joint_error_deg"],
        "high_frequency_rms_deg": row["loose_deg"],
        "target_high_frequency_rms_deg": row["target_loose_deg"],
    }
    for name in ("joint_error_deg", "loose_deg", "target_loose_deg"):
        del renamed[name]
    return renamed
