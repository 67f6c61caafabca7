"""Inner solves min E(X; θ) of learning, and what each step of learning is judged by."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.nio.learning_problem import Cost, LearningProblem, cost_of_point
from motionstyle.spacetime.interior_point import InteriorPoint
from motionstyle.spacetime.solver_point import (
    FORCE_UNIT,
    InteriorPointResult,
    Point,
    SolverSettings,
)
from motionstyle.spacetime.spacetime_problem import Evaluator, SpacetimeProblem
from motionstyle.spacetime.style import Style

Array = NDArray[np.float64]
WARM_ITERATIONS, WARM_BARRIER = 40, 1e-5  # from all multipliers; most small steps need 5 to 15
IDLE_SHARE = 0.002  # a joint with less of Σ Q_m² than this is idle; an even share is 0.034


@dataclass(frozen=True)
class InnerSettings:
    """How an inner solve is done.

    closeness : pull towards X_T, per rad². gain : of the springs' sigmoid, 1/rad.
    iterations, tolerance, barrier : of the solver. whole : start from all of a neighbour's
        multipliers first, which halves the iterations of small steps; where that does not lead to
        an optimum soon, they are dropped.
    """

    closeness: float
    gain: float
    iterations: int
    tolerance: float
    barrier: float
    whole: bool = False


@dataclass(frozen=True)
class Inner:
    """One inner solve: its problem, the solver's result, and the cost with tracking left out."""

    problem: SpacetimeProblem
    result: InteriorPointResult
    cost: Cost


@dataclass(frozen=True)
class Learnt:
    """A learnt style and how it came about: one row per step of θ (`tables/nio_learning.csv`)."""

    style: Style
    rows: list[dict[str, Any]]


def learnt(
    learning: LearningProblem,
    recipe: str,
    style: Style,
    inner: Inner,
    rows: list[dict[str, Any]],
) -> Learnt:
    """Return a learnt style that says where it comes from.

    Parameters
    ----------
    inner : the last solve at this style. rows : of all steps.
    """
    about = dict(learning.start.about) | {
        "recipe": recipe,
        "solver_status": inner.result.status,
        "optimality": inner.result.optimality,
    }
    return Learnt(replace(style, about=about), rows)


def inner_solve(
    learning: LearningProblem,
    style: Style,
    settings: InnerSettings,
    controls: Array | None = None,
    before: Point | None = None,
) -> Inner:
    """Return X_S of a style.

    Parameters
    ----------
    controls : control points to start from (K, 35); by default those of `before`, X_T's if
        there is none. before : a neighbouring optimum, whose contact forces are taken over.
    """
    problem = learning.problem(style, closeness=settings.closeness, gain=settings.gain)
    evaluator, result, spent = Evaluator(problem), None, 0
    forces = None if before is None else before.coefficients * FORCE_UNIT
    if controls is None:
        controls = learning.controls if before is None else before.controls
    if settings.whole and before is not None:
        solver = _solver(evaluator, settings, WARM_ITERATIONS, WARM_BARRIER)
        result = solver.solve(replace(before, controls=controls))
        spent = result.iterations
    if result is None or result.status != "converged":
        solver = _solver(evaluator, settings, settings.iterations, settings.barrier)
        result = solver.solve(solver.start(controls, forces, near=True))
        result = replace(result, iterations=result.iterations + spent)
    return Inner(problem, result, cost_of_point(replace(problem, tracking=None), result.point))


def _solver(
    evaluator: Evaluator, settings: InnerSettings, iterations: int, barrier: float
) -> InteriorPoint:
    return InteriorPoint(evaluator, SolverSettings(settings.tolerance, iterations, barrier=barrier))


def effective_number(shares: Array) -> float:
    """Return the exponential of the entropy of shares: 29 if all are even, 1 if one has all."""
    positive = shares[shares > 0] / shares[shares > 0].sum()
    return float(np.exp(-(positive * np.log(positive)).sum()))


def learning_row(
    learning: LearningProblem, style: Style, target: Cost, inner: Inner
) -> dict[str, Any]:
    """Return the columns of `tables/nio_learning.csv` that one θ and its X_S fill.

    G is of all that is minimised (E and the prices of constraints), as its gradient is; its ratio
    is by E(X_T). `alpha_on_idle_joints` tells a fall of E by sliding α onto joints that do nothing.
    """
    synth = inner.cost
    gap = target.total - synth.total
    torque = target.values.muscle
    square = (torque**2).sum(axis=0)
    passive = target.values.passive
    idle = square < IDLE_SHARE * square.sum()
    return {
        "G": gap,
        "G_over_E_target": gap / target.energy,
        "E_target": target.energy,
        "E_synth": synth.energy,
        "muscle_target": target.muscle,
        "root_target": target.root,
        "muscle_synth": synth.muscle,
        "root_synth": synth.root,
        "muscle_gap_over_E_target": (target.muscle - synth.muscle) / target.energy,
        "root_gap_over_E_target": (target.root - synth.root) / target.energy,
        "joint_error_deg": learning.joint_error_deg(synth.values.coordinates),
        "status": inner.result.status,
        "optimality": inner.result.optimality,
        "inner_iterations": inner.result.iterations,
        "effective_joints_in_alpha": effective_number(style.preferences),
        "effective_joints_in_E": effective_number(style.preferences * square),
        "alpha_on_idle_joints": float(style.preferences[idle].sum()),
        "passive_over_muscle": float((passive**2).sum() / max(square.sum(), 1e-12)),
    }
