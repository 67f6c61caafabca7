"""What each choice of the learning problem does to E and to the gap G.

One motion X_T, projected on the constraints as for learning, and the style that learning starts
from; the problem is solved from X_T under one choice changed at a time. E(X_T) is the energy of
X_T's splines under the least λ, E(X_S) that of the optimum reached, both of the same problem.
Energies under other root weights or knots are other energies: compare ratios.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.motion.difference import joint_rms_deg
from motionstyle.nio.learning_problem import LearningProblem
from motionstyle.spacetime.continuation import solve_spacetime
from motionstyle.spacetime.diagnosis import checked_solve
from motionstyle.spacetime.objective import best_coefficients
from motionstyle.spacetime.outcome import outcome_of
from motionstyle.spacetime.solver_point import SolverSettings
from motionstyle.spacetime.spacetime_problem import (
    Evaluator,
    SpacetimeProblem,
    Values,
)

Array = NDArray[np.float64]
COLUMNS = (
    *("config", "motion", "frames", "choice", "what", "value", "status", "E_target", "E_optimum"),
    "root_share_of_E_target_pct",
    *("G", "G_over_E_target", "root_share_of_E_pct", "foot_error_mm", "joint_rms_deg"),
    *("optimality", "iterations", "seconds", "reason"),
)


@dataclass(frozen=True)
class Choice:
    """One way to pose the learning problem.

    what, value : for the table. weights : changed `SpacetimeSettings`. keep_ends : control points
    kept at both ends. friction : of the ground. ranges, clearance : whether joints keep to their
    ranges and swinging feet off the ground. projected : whether X_T is the feasible motion next to
    the captured one, or the captured one.
    """

    what: str
    value: str
    weights: Mapping[str, float] = field(default_factory=dict)
    keep_ends: int = 0
    friction: float | None = None
    ranges: bool = True
    clearance: bool = True
    projected: bool = True


BASE = "base"
CHOICES: dict[str, Choice] = {
    BASE: Choice("as in docs/spacetime.md", ""),
    "not_projected": Choice("X_T projected on the constraints", "no", projected=False),
    "ends_kept": Choice("control points kept at each end", "3", keep_ends=3),
    "feet_1e6": Choice("foot weight, 1/m²", "1e6", {"foot_weight": 1e6}),
    "feet_1e8": Choice("foot weight, 1/m²", "1e8", {"foot_weight": 1e8}),
    "no_clearance": Choice("swinging feet above the ground", "no", clearance=False),
    "no_ranges": Choice("joint ranges", "no", ranges=False),
    "root_10": Choice("root weight w_r", "10", {"root_weight": 10.0}),
    "root_1000": Choice("root weight w_r", "1000", {"root_weight": 1000.0}),
    "friction_0.5": Choice("friction", "0.5", friction=0.5),
    "friction_1.0": Choice("friction", "1.0", friction=1.0),
    "knots_3": Choice("frames per knot", "3", {"frames_per_knot": 3.0}),
}
DEEP_M = 1e3  # a clearance this far below the ground is none


@dataclass(frozen=True)
class Solved:
    """A row, its problem, and the control points of X_T and of the optimum, (K, 35)."""

    row: dict[str, Any]
    problem: SpacetimeProblem
    target: Array
    optimum: Array


def root_share_pct(values: Values) -> float:
    """Return the share of the root residual in E, %: of X_T it is a floor that no style lowers."""
    return 100 * float((values.residuals[:, :6] ** 2).sum()) / values.energy


def choice_problem(learning: LearningProblem, choice: Choice) -> SpacetimeProblem:
    """Return the learning problem under one choice, for the style that learning starts from."""
    problem = learning.problem(learning.start)
    feet, ranges = problem.feet, problem.ranges
    if choice.friction is not None:
        feet = replace(feet, friction=np.full_like(feet.friction, choice.friction))
    if not choice.clearance:
        feet = replace(feet, clearance=np.where(feet.held, 0.0, -DEEP_M))
    if not choice.ranges:
        ranges = np.full_like(ranges, np.inf) * [-1, 1]
    settings = replace(problem.settings, **choice.weights)
    return replace(problem, feet=feet, ranges=ranges, settings=settings, keep_ends=choice.keep_ends)


def solve_choice(
    learning: LearningProblem,
    choice: str,
    settings: SolverSettings | None = None,
    log: Callable[[str], None] = print,
) -> Solved:
    """Solve the learning problem under one of `CHOICES` from X_T; return its row of the table."""
    chosen = CHOICES[choice]
    problem = choice_problem(learning, chosen)
    motion = learning.target if chosen.projected else learning.captured
    evaluator = Evaluator(problem)
    target = evaluator.basis.fit(motion.coordinates)
    coefficients = best_coefficients(evaluator, target)
    start = evaluator.values(target, coefficients)
    row: dict[str, Any] = {
        "motion": motion.id,
        "frames": motion.frames,
        "choice": choice,
        "what": chosen.what,
        "value": chosen.value,
        "E_target": start.energy,
        "root_share_of_E_target_pct": root_share_pct(start),
    }
    found, record, _diagnosis = checked_solve(
        lambda: outcome_of(problem, solve_spacetime(problem, target, settings=settings, log=log)),
        log,
    )
    row |= {k: getattr(record, k) for k in ("status", "optimality", "iterations", "seconds")}
    row["reason"] = record.reason
    if found is None:
        return Solved(row, problem, target, target)
    # λ of the least objective, so that E(X_T) and E(X_S) are the same function of the motion.
    end = found.point.controls
    values = evaluator.values(end, best_coefficients(evaluator, end))
    gap = start.energy - values.energy
    row |= {
        "E_optimum": values.energy,
        "G": gap,
        "G_over_E_target": gap / start.energy,
        "root_share_of_E_pct": root_share_pct(values),
        "foot_error_mm": 1000
        * float(np.abs(values.foot_residuals).max())
        / np.sqrt(problem.settings.foot_weight),
        "joint_rms_deg": joint_rms_deg(values.coordinates, start.coordinates),
    }
    return Solved(row, problem, target, end)
