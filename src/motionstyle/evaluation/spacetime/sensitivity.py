"""What each choice of the learning problem does to E and to the gap G.

One motion X_T, one style; the problem is solved from X_T under one choice changed at a time. E(X_T)
is the energy of X_T's splines under the least λ, E(X_S) that of the optimum reached, both of the
same problem. Energies under other root weights or knots are other energies: compare ratios.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.kinematics import contact_points
from motionstyle.body.layout import JOINT_COORDINATES
from motionstyle.dynamics.codegen import FrameFunction
from motionstyle.errors import MotionStyleError
from motionstyle.motion.motion import Motion
from motionstyle.spacetime.continuation import solve_spacetime
from motionstyle.spacetime.diagnosis import checked_solve
from motionstyle.spacetime.learning_problem import (
    best_coefficients,
    learning_problem,
)
from motionstyle.spacetime.outcome import outcome_of
from motionstyle.spacetime.solver_point import SolverSettings
from motionstyle.spacetime.spacetime_problem import (
    Evaluator,
    SpacetimeProblem,
    SpacetimeSettings,
    Values,
)
from motionstyle.spacetime.style import Style

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

    what, value : for the table. weights : changed `SpacetimeSettings`. problem : changed arguments
    of `learning_problem`.
    """

    what: str
    value: str
    weights: Mapping[str, float] = field(default_factory=dict)
    problem: Mapping[str, Any] = field(default_factory=dict)
    fit_shoes: bool = False
    fit_forces: bool = False


BASE = "base"
CHOICES: dict[str, Choice] = {
    BASE: Choice("as in docs/spacetime.md", ""),
    "ends_kept": Choice("control points kept at each end", "3", problem={"keep_ends": 3}),
    "feet_1e6": Choice("foot weight, 1/m²", "1e6", {"foot_weight": 1e6}),
    "feet_1e8": Choice("foot weight, 1/m²", "1e8", {"foot_weight": 1e8}),
    "no_clearance": Choice("swinging feet above the ground", "no", problem={"clearance": False}),
    "no_ranges": Choice("joint ranges", "no", problem={"ranges": False}),
    "root_10": Choice("root weight w_r", "10", {"root_weight": 10.0}),
    "root_1000": Choice("root weight w_r", "1000", {"root_weight": 1000.0}),
    "friction_0.5": Choice("friction", "0.5", problem={"friction": 0.5}),
    "friction_1.0": Choice("friction", "1.0", problem={"friction": 1.0}),
    "knots_3": Choice("frames per knot", "3", {"frames_per_knot": 3.0}),
    "shoes_of_fit": Choice("shoes", "of the physics fit", fit_shoes=True),
    "forces_of_fit": Choice(
        "shoes, and where feet push", "of the physics fit", fit_shoes=True, fit_forces=True
    ),
}
LEAST_FORCE_N = 0.5  # of the physics fit that counts as pushing


@dataclass(frozen=True)
class Solved:
    """A learning problem's row, and the control points of X_T and of the optimum, (K, 35)."""

    row: dict[str, Any]
    target: Array
    optimum: Array


def root_share_pct(values: Values) -> float:
    """Return the share of the root residual in E, %: of X_T it is a floor that no style lowers."""
    return 100 * float((values.residuals[:, :6] ** 2).sum()) / values.energy


def choice_problem(
    motion: Motion, style: Style, functions: Mapping[str, FrameFunction], choice: Choice
) -> SpacetimeProblem:
    """Return the learning problem of a motion under one choice.

    Raises
    ------
    MotionStyleError
        If the choice needs what the physics fit did not leave with the motion.
    """
    if choice.fit_shoes:
        shoes = motion.provenance.get("shoes")
        if not shoes:
            raise MotionStyleError(f"{motion.id}: its physics fit knows no shoes")
        style = replace(
            style,
            shoe_stiffness=float(shoes["stiffness"]),
            shoe_rest_length=float(shoes["rest_length"]),
        )
    settings = SpacetimeSettings(**choice.weights)
    problem = learning_problem(motion, style, functions, settings=settings, **choice.problem)
    if not choice.fit_forces:
        return problem
    if motion.contact_forces is None:
        raise MotionStyleError(f"{motion.id}: its contact forces are unknown")
    feet = problem.feet
    held = feet.held | (np.linalg.norm(motion.contact_forces, axis=-1) > LEAST_FORCE_N)
    paths = contact_points(motion.body, motion.pose())
    more = (held & ~feet.held)[..., None]
    feet = replace(
        feet,
        held=held,
        targets=np.where(more, paths, feet.targets),
        ground=np.where(more, paths, feet.ground),
        clearance=np.where(held, 0.0, feet.clearance),
    )
    return replace(problem, feet=feet)


def solve_choice(
    motion: Motion,
    style: Style,
    functions: Mapping[str, FrameFunction],
    choice: str,
    settings: SolverSettings | None = None,
    log: Callable[[str], None] = print,
) -> Solved:
    """Solve the learning problem of one of `CHOICES` from X_T; return its row of the table."""
    chosen = CHOICES[choice]
    problem = choice_problem(motion, style, functions, chosen)
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
        return Solved(row, target, target)
    # λ of the least objective, so that E(X_T) and E(X_S) are the same function of the motion.
    end = found.point.controls
    values = evaluator.values(end, best_coefficients(evaluator, end))
    away = (values.coordinates - start.coordinates)[:, JOINT_COORDINATES]
    gap = start.energy - values.energy
    row |= {
        "E_optimum": values.energy,
        "G": gap,
        "G_over_E_target": gap / start.energy,
        "root_share_of_E_pct": root_share_pct(values),
        "foot_error_mm": 1000
        * float(np.abs(values.foot_residuals).max())
        / np.sqrt(problem.settings.foot_weight),
        "joint_rms_deg": float(np.degrees(np.sqrt((away**2).mean()))),
    }
    return Solved(row, target, end)
