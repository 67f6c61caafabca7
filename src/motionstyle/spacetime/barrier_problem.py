"""The barrier problem of a spacetime problem: its objective φ, constraint errors and optimality."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.spacetime.banded import assemble_gradient
from motionstyle.spacetime.frame_sums import FrameSums
from motionstyle.spacetime.solver_point import FORCE_UNIT, Excess, Point
from motionstyle.spacetime.spacetime_problem import COUNT, Evaluator, Slopes, Values
from motionstyle.spacetime.splines import SplineBasis

Array = NDArray[np.float64]


METRIC = np.array([1.0, 1e-2, 1e-4])  # of q, q̇, q̈ where curvature must be added


class BarrierProblem:
    """What the solver minimises, given an evaluator: φ with the log barrier, and its constraints.

    Attributes
    ----------
    bearing : coefficients λ that may push, (F, 32). sums : over frames, for Newton's matrix.
    metric : Σ_t Φᵀ M Φ of the metric in which curvature is added, by pairs of control points
        (K, 4), the same for every coordinate.
    active : inequality rows that count, (F, R).
    weight : ρ of each row's elastic part, (R,). force_weight : w_λ per (λ/100 N)².
    fixed : control points that must not move, (K, 35).
    """

    def __init__(self, evaluator: Evaluator) -> None:
        self.evaluator = evaluator
        self.bearing = evaluator.bearing
        self.sums = FrameSums(evaluator.basis, self.bearing)
        self.metric = _metric(evaluator.basis)
        self.active = evaluator.row_active
        self.weight = evaluator.row_weight
        self.force_weight = evaluator.problem.settings.force_weight * FORCE_UNIT**2
        keep = evaluator.problem.keep_ends
        self.fixed = np.zeros((evaluator.basis.controls, COUNT), dtype=bool)
        if keep:
            self.fixed[:keep] = self.fixed[-keep:] = True

    def objective(self, point: Point, barrier: float) -> float:
        """Return φ: half the squares of the copies, of λ and of elastic parts, and the barrier."""
        logs = np.log(point.coefficients[self.bearing]).sum()
        logs += np.log(point.slack[self.active]).sum()
        half = (point.lift**2).sum() + (point.foot_lift**2).sum()
        half += self.force_weight * (point.coefficients[self.bearing] ** 2).sum()
        half += (self.weight * point.elastic**2)[self.active].sum()
        tracking = self.evaluator.problem.tracking
        if tracking is not None:
            away = self.evaluator.basis.evaluate(point.controls)[0] - tracking.coordinates
            half += (tracking.weights * away**2).sum()
        return float(0.5 * half - barrier * logs)

    def settled(self, point: Point, values: Values, barrier: float) -> Point:
        """Return the point with slacks and elastic parts that are best for its inequalities.

        The least ½ρp² − μ log s under g + p = s has a closed form, so that rows never limit a step.
        """
        rows, weight = values.inequalities, self.weight
        root = np.sqrt(rows**2 + 4 * barrier / weight)
        slack = np.where(
            rows > 0, (rows + root) / 2, 2 * barrier / weight / (root - np.minimum(rows, 0.0))
        )
        slack = np.where(self.active, slack, 1.0)
        return replace(
            point, slack=slack, elastic=np.where(self.active, barrier / weight / slack, 0.0)
        )

    def excess(self, point: Point, values: Values) -> Excess:
        """Return by how much each constraint is missed at a point."""
        rows = np.where(self.active, values.inequalities + point.elastic - point.slack, 0.0)
        return Excess(values.residuals - point.lift, values.foot_residuals - point.foot_lift, rows)

    def pull(self, slopes: Slopes, lift: Array, foot_lift: Array, rows: Array) -> Array:
        """Return Jᵀy summed over all rows, by u, (F, 105)."""
        gradient = np.vecmat(lift, slopes.by_state)
        gradient[:, :COUNT] += np.vecmat(foot_lift, slopes.feet)
        gradient[:, :COUNT] -= self.row_pull(slopes, rows)
        return gradient

    def row_pull(self, slopes: Slopes, rows: Array) -> Array:
        """Return ∂(rows)ᵀ·multipliers by q, (F, 35)."""
        evaluator = self.evaluator
        n = len(evaluator.limited)
        scaled = rows * evaluator.row_scale
        pull = np.vecmat(scaled[:, 2 * n :], slopes.heights)
        pull[:, evaluator.limited] += scaled[:, :n] - scaled[:, n : 2 * n]
        return pull

    def errors(self, point: Point, values: Values, slopes: Slopes) -> Errors:
        """Return the scaled optimality errors at a point, Wächter & Biegler eq. (5)."""
        gradient = self.pull(slopes, point.multiplier, point.foot_multiplier, point.row_dual)
        gradient[:, :COUNT] += self.evaluator.tracking_pull(values.coordinates)
        by_controls = assemble_gradient(self.evaluator.basis, gradient)
        by_controls[self.fixed] = 0.0
        by_force = FORCE_UNIT * np.vecmat(point.multiplier, slopes.by_coefficients)
        by_force += self.force_weight * point.coefficients - point.dual
        by_elastic = (self.weight * point.elastic - point.row_dual)[self.active]
        duals = np.concatenate([point.dual[self.bearing], point.row_dual[self.active]])
        every = np.abs(duals).sum() + np.abs(point.multiplier).sum()
        every += np.abs(point.foot_multiplier).sum()
        count = len(duals) + point.lift.size + point.foot_lift.size
        scale_dual = max(100.0, every / count) / 100
        scale_gap = max(100.0, np.abs(duals).sum() / max(1, len(duals))) / 100
        gaps = np.concatenate(
            [
                (point.coefficients * point.dual)[self.bearing],
                (point.slack * point.row_dual)[self.active],
            ]
        )
        parts = [
            np.abs(by_controls).max() / scale_dual,
            np.abs(by_force[self.bearing]).max(initial=0.0) / scale_dual,
            np.abs(by_elastic).max(initial=0.0) / scale_dual,
            np.abs(point.lift - point.multiplier).max() / scale_dual,
            np.abs(point.foot_lift - point.foot_multiplier).max() / scale_dual,
            np.abs(values.residuals - point.lift).max(),
            np.abs(values.foot_residuals - point.foot_lift).max(),
            np.abs(values.inequalities + point.elastic - point.slack)[self.active].max(initial=0.0),
        ]
        return Errors(float(max(parts)), gaps, scale_gap)


@dataclass(frozen=True)
class Errors:
    """The optimality errors of a point: the largest that no barrier changes, and the gaps.

    gaps : primal times dual of λ and rows, which should be μ. scale : what they are divided by.
    """

    largest: float
    gaps: Array
    scale: float

    def at(self, barrier: float) -> float:
        """Return the scaled error of the barrier problem."""
        return max(self.largest, float(np.abs(self.gaps - barrier).max(initial=0.0) / self.scale))


def _metric(basis: SplineBasis) -> Array:
    found = np.zeros((basis.controls, 4))
    for c, e, products in basis.pairs():
        np.add.at(found[:, e], basis.first + c, products @ METRIC)
    return found
