"""A structured interior-point method for spacetime problems.

Lifted Newton: the residuals r(x) have copies z with r(x) = z as constraints, whose multipliers y
equal z after each step, so that one array serves for both. Eliminating it leaves, over control
points x and cone coefficients λ, the Gauss–Newton matrix JᵀJ plus Σ y·∇²r; the step is the same
as Newton's but y moves with the step length, which carries the method through the long flat
valleys of E where the unlifted method crawls. λ and inequalities have a primal–dual log barrier
(with an elastic part p, so that no start is infeasible); λ is eliminated frame by frame, and what
is left is banded over the splines. Steps are accepted by a filter of infeasibility against
barrier objective, as in Wächter & Biegler 2006, whose symbols μ, θ, φ, δ, α are used here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from motionstyle.spacetime.barrier_problem import BarrierProblem
from motionstyle.spacetime.newton_step import factorise, newton_blocks, newton_step
from motionstyle.spacetime.solver_point import (
    FORCE_UNIT,
    InteriorPointResult,
    Point,
    SolverSettings,
    Trace,
)
from motionstyle.spacetime.spacetime_problem import Evaluator, Slopes, Values
from motionstyle.spacetime.starting_point import starting_point

Array = NDArray[np.float64]


@dataclass(frozen=True)
class _Trial:
    """A point that was accepted, and the step length that led to it."""

    point: Point
    values: Values
    length: float


class InteriorPoint:
    """Solves one problem by steps along which a filter searches."""

    def __init__(self, evaluator: Evaluator, settings: SolverSettings) -> None:
        self.evaluator = evaluator
        self.settings = settings
        self.system = BarrierProblem(evaluator)

    def start(self, controls: Array, coefficients: Array | None = None) -> Point:
        """Return a point to start from; λ (N) is found from the motion if it is not given."""
        return starting_point(self.system, controls, coefficients, self.settings.barrier)

    def solve(self, point: Point, log: Callable[[str], None] | None = None) -> InteriorPointResult:
        """Return the optimum reached from a point, or the last point and why it is none.

        Parameters
        ----------
        log : told one line per iteration.
        """
        system, began = self.system, perf_counter()
        barrier, last = self.settings.barrier, 0.0
        trace: list[Trace] = []
        values = self._values(point)
        theta = system.excess(point, values).total()
        limits = (1e4 * max(1.0, theta), 1e-4 * max(1.0, theta))
        filter_: list[tuple[float, float]] = []
        length = delta = 0.0
        while True:
            slopes = self.evaluator.slopes(values)
            error = system.error(point, values, slopes, 0.0)
            excess, phi = system.excess(point, values), system.objective(point, barrier)
            theta, spent = excess.total(), perf_counter() - began
            trace.append(
                Trace(len(trace), spent, values.energy, phi, theta, error, barrier, length, delta)
            )
            if log:
                log(str(trace[-1]))
            status = self._verdict(trace[-1])
            if status:
                break
            lower = self._lowered(barrier, point, values, slopes)
            if lower < barrier:
                barrier, filter_, phi = lower, [], system.objective(point, lower)
            blocks = newton_blocks(system, point, values, slopes, barrier)
            try:
                factor = factorise(system, blocks, last)
            except FloatingPointError:
                status = "not a number"
                break
            delta = factor.delta
            last = delta or last
            step, slope = newton_step(system, point, blocks, factor, excess)
            accepted = self._search(point, step, slope, phi, theta, barrier, filter_, limits)
            if accepted is None:
                accepted = self._restored(point, values, slopes, step, barrier)
                filter_ = []
            if accepted is None:
                if theta <= 1e-9 * max(1.0, abs(phi)):
                    status = "no step found"
                    break
                # Restoration is exact here: the copies take the residuals' own values.
                point, length = self._closed(point, values), 0.0
                continue
            length, values = accepted.length, accepted.values
            point = self._safe_duals(accepted.point, barrier)
        spent = perf_counter() - began
        return InteriorPointResult(status, point, values, error, len(trace) - 1, spent, trace)

    def _values(self, point: Point) -> Values:
        return self.evaluator.values(point.controls, point.coefficients * FORCE_UNIT)

    def _verdict(self, entry: Trace) -> str | None:
        """Return the status to end with, or None to go on."""
        if not np.isfinite([entry.objective, entry.energy, entry.optimality]).all():
            return "not a number"
        if entry.optimality <= self.settings.tolerance:
            return "converged"
        if entry.iteration >= self.settings.iterations:
            return "iteration limit"
        if entry.seconds > self.settings.seconds:
            return "time limit"
        return None

    def _lowered(self, barrier: float, point: Point, values: Values, slopes: Slopes) -> float:
        """Return the barrier for the next step: lower where its problem is solved well enough."""
        settings = self.settings
        least = settings.tolerance / (settings.barrier_gate + 1)
        while (
            barrier > least
            and self.system.error(point, values, slopes, barrier) <= settings.barrier_gate * barrier
        ):
            barrier = max(
                least, min(settings.barrier_shrink * barrier, barrier**settings.barrier_power)
            )
        return barrier

    def _search(
        self,
        point: Point,
        step: Point,
        slope: float,
        phi: float,
        theta: float,
        barrier: float,
        filter_: list[tuple[float, float]],
        limits: tuple[float, float],
    ) -> _Trial | None:
        """Return the first trial point along the step that the filter accepts, or None."""
        primal, dual = self._lengths(point, step, barrier)
        noise = 10 * np.finfo(float).eps * abs(phi)
        length = primal
        for _ in range(25):
            moved = point.moved(step, length, dual)
            values = self._values(moved)
            new_theta = self.system.excess(moved, values).total()
            new_phi = self.system.objective(moved, barrier)
            blocked = not np.isfinite(new_phi + new_theta) or new_theta > limits[0]
            blocked = blocked or any(
                new_theta >= (1 - 1e-5) * t and new_phi >= p - 1e-5 * t for t, p in filter_
            )
            if not blocked:
                steep = slope < 0 and length * (-slope) ** 2.3 > theta**1.1
                if steep and theta <= limits[1]:
                    if new_phi - phi - noise <= 1e-8 * length * slope:
                        return _Trial(moved, values, length)
                elif new_theta <= (1 - 1e-5) * theta or new_phi - noise <= phi - 1e-5 * theta:
                    filter_.append(((1 - 1e-5) * theta, phi - 1e-5 * theta))
                    return _Trial(moved, values, length)
            length *= 0.5
        return None

    def _restored(
        self, point: Point, values: Values, slopes: Slopes, step: Point, barrier: float
    ) -> _Trial | None:
        """Return the whole step if it lowers the barrier problem's error, or None.

        The soft restoration of Wächter & Biegler §3.3: near an optimum φ and θ change by less
        than rounding, but the error of the optimality conditions still tells steps apart.
        """
        primal, dual = self._lengths(point, step, barrier)
        moved = point.moved(step, primal, dual)
        found = self._values(moved)
        before = self.system.error(point, values, slopes, barrier)
        after = self.system.error(moved, found, self.evaluator.slopes(found), barrier)
        return _Trial(moved, found, primal) if after <= 0.9 * before else None

    def _lengths(self, point: Point, step: Point, barrier: float) -> tuple[float, float]:
        """Return how far a step may go in primal and in dual unknowns."""
        fraction = max(0.99, 1 - barrier)
        primal = self._longest(
            [(point.coefficients, step.coefficients, self.system.bearing),
             (point.slack, step.slack, self.system.active)], fraction
        )  # fmt: skip
        dual = self._longest(
            [(point.dual, step.dual, self.system.bearing),
             (point.row_dual, step.row_dual, self.system.active)], fraction
        )  # fmt: skip
        return primal, dual

    def _closed(self, point: Point, values: Values) -> Point:
        """Return the point with copies, slacks and elastic parts that miss no constraint."""
        slack = np.where(self.system.active, np.maximum(values.inequalities, 1e-8), 1.0)
        elastic = np.where(self.system.active, slack - values.inequalities, 0.0)
        return replace(
            point,
            lift=values.residuals,
            foot_lift=values.foot_residuals,
            multiplier=values.residuals,
            foot_multiplier=values.foot_residuals,
            slack=slack,
            elastic=elastic,
        )

    def _safe_duals(self, point: Point, barrier: float) -> Point:
        """Keep duals within 1e10 of their central values, as Wächter & Biegler eq. (16)."""
        new = {}
        for name, primal, where in (
            ("dual", point.coefficients, self.system.bearing),
            ("row_dual", point.slack, self.system.active),
        ):
            centre = barrier / np.where(where, primal, 1.0)
            kept = np.clip(getattr(point, name), centre / 1e10, centre * 1e10)
            new[name] = np.where(where, kept, 0.0)
        return replace(point, **new)

    @staticmethod
    def _longest(pairs: list[tuple[Array, Array, Array]], fraction: float) -> float:
        """Return the longest step, at most 1, that keeps `fraction` of each value's way to 0."""
        length = 1.0
        for value, step, where in pairs:
            falling = where & (step < 0)
            if falling.any():
                length = min(length, float((fraction * value[falling] / -step[falling]).min()))
        return length
