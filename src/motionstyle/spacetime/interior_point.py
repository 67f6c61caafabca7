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

from motionstyle.spacetime.barrier_problem import BarrierProblem, Errors
from motionstyle.spacetime.newton_step import (
    Blocks,
    Factor,
    factorise,
    newton_blocks,
    newton_step,
)
from motionstyle.spacetime.solver_point import (
    FORCE_UNIT,
    Excess,
    InteriorPointResult,
    Point,
    SolverSettings,
    Trace,
)
from motionstyle.spacetime.spacetime_problem import Evaluator, Slopes, Values
from motionstyle.spacetime.starting_point import starting_point
from motionstyle.spacetime.step_filter import StepFilter

Array = NDArray[np.float64]


MOST_NONLINEAR = 10.0  # a step that errs by more than ten times its gain is not taken
LEAST_DELTA, FIRST_DELTA = 1e-4, 1e-2  # below the first δ counts as 0
UP, DOWN = 4.0, 10.0  # of δ after a step that was not taken, and between good steps
STIFFEST = 1e8  # the δ at which a search is given up
PACE_OVER, PACE_BELOW = 10, 1e3  # iterations over which E's fall is judged; not if far off


@dataclass(frozen=True)
class _Trial:
    """A point that was accepted, and length and nonlinearity of the step that led to it.

    slopes : there, where accepting it needed them.
    """

    point: Point
    values: Values
    length: float
    nonlinearity: float = 0.0
    slopes: Slopes | None = None


@dataclass(frozen=True)
class _Here:
    """Where a step starts from: the point, its errors, objective and their limits."""

    point: Point
    errors: Errors
    excess: Excess
    phi: float
    theta: float
    barrier: float
    limits: tuple[float, float]


class InteriorPoint:
    """Solves one problem by steps along which a filter searches."""

    def __init__(self, evaluator: Evaluator, settings: SolverSettings) -> None:
        self.evaluator = evaluator
        self.settings = settings
        self.system = BarrierProblem(evaluator)
        self.filter = StepFilter()  # of the present μ

    def start(
        self, controls: Array, coefficients: Array | None = None, *, near: bool = False
    ) -> Point:
        """Return a point to start from; λ (N) is found from the motion if it is not given.

        near : whether it is close to an optimum, so that its residuals serve as multipliers.
        """
        return starting_point(self.system, controls, coefficients, self.settings.barrier, near=near)

    def solve(self, point: Point, log: Callable[[str], None] | None = None) -> InteriorPointResult:
        """Return the optimum reached from a point, or the last point and why it is none.

        Parameters
        ----------
        log : told one line per iteration.
        """
        system, began = self.system, perf_counter()
        barrier, wanted, last = self.settings.barrier, FIRST_DELTA, 0.0
        trace: list[Trace] = []
        values = self._values(point)
        if self.settings.whole_steps:
            point = system.settled(point, values, barrier)
        theta = system.excess(point, values).total()
        limits = (1e4 * max(1.0, theta), 1e-4 * max(1.0, theta))
        self.filter = StepFilter()
        length, delta, bent, slopes = 0.0, 0.0, 0.0, None
        while True:
            slopes = slopes or self.evaluator.slopes(values)
            errors = system.errors(point, values, slopes)
            error = errors.at(0.0)
            excess, phi = system.excess(point, values), system.objective(point, barrier)
            spent = perf_counter() - began
            trace.append(
                Trace(
                    len(trace), spent, values.energy, phi, excess.total(), error, barrier, length,
                    delta, bent,
                )
            )  # fmt: skip
            if log:
                log(str(trace[-1]))
            status = self._verdict(trace)
            if status:
                break
            lower = self._lowered(barrier, errors)
            if lower < barrier:
                barrier, self.filter = lower, StepFilter()
                if self.settings.whole_steps:
                    point = system.settled(point, values, barrier)
                    errors = system.errors(point, values, slopes)
                excess, phi = system.excess(point, values), system.objective(point, barrier)
            self.filter.note(errors.at(barrier), phi)
            here = _Here(point, errors, excess, phi, excess.total(), barrier, limits)
            blocks = newton_blocks(system, point, values, slopes, barrier)
            try:
                accepted, delta = self._stepped(here, blocks, wanted, last)
            except FloatingPointError:
                status = "not a number"
                break
            if accepted is None:
                if here.theta <= 1e-9 * max(1.0, abs(phi)):
                    status = "no step found"
                    break
                # Restoration is exact here: the copies take the residuals' own values.
                point, length = self._closed(point, values, barrier), 0.0
                self.filter.entries.clear()
                continue
            length, values, bent = accepted.length, accepted.values, accepted.nonlinearity
            slopes = accepted.slopes
            point = self._safe_duals(accepted.point, barrier)
            last, wanted = delta or last, self._next_delta(delta, bent)
        spent = perf_counter() - began
        return InteriorPointResult(status, point, values, error, len(trace) - 1, spent, trace)

    def _stepped(
        self, here: _Here, blocks: Blocks, wanted: float, last: float
    ) -> tuple[_Trial | None, float]:
        """Return the step that is taken, or None, and its δ, raised until a step is accepted."""
        first = True
        # Steps without concave springs may hop to and fro over the bend of one.
        straighten = not self.filter.stalled
        while True:
            factor = factorise(self.system, blocks, wanted, last, straighten=straighten)
            step, slope = newton_step(self.system, here.point, blocks, factor, here.excess)
            found = self._search(here, blocks, factor, step, slope)
            if found is None and first:
                found = self._restored(here, step)
            if found is not None or factor.delta > STIFFEST:
                return found, factor.delta
            first, wanted = False, max(UP * factor.delta, 1e-3)

    def _next_delta(self, delta: float, nonlinearity: float) -> float:
        """Return the δ to begin the next step with."""
        if nonlinearity > self.settings.wild:
            return max(3 * delta, 1e-3)
        if nonlinearity < self.settings.loose:
            delta /= DOWN
        return delta if delta >= LEAST_DELTA else 0.0

    def _values(self, point: Point) -> Values:
        return self.evaluator.values(point.controls, point.coefficients * FORCE_UNIT)

    def _verdict(self, trace: list[Trace]) -> str | None:
        """Return the status to end with, or None to go on."""
        entry, pace = trace[-1], self.settings.pace
        if not np.isfinite([entry.objective, entry.energy, entry.optimality]).all():
            return "not a number"
        if entry.optimality <= self.settings.tolerance:
            return "converged"
        if entry.iteration >= self.settings.iterations:
            return "iteration limit"
        if entry.seconds > self.settings.seconds:
            return "time limit"
        if pace and len(trace) > 2 * PACE_OVER and entry.optimality < PACE_BELOW:
            energies = [t.energy for t in trace]
            if min(energies[-PACE_OVER:]) > (1 - pace) * min(energies[:-PACE_OVER]):
                return "slow"
        return None

    def _lowered(self, barrier: float, errors: Errors) -> float:
        """Return the barrier for the next step: lower where its problem is solved well enough."""
        settings = self.settings
        least = settings.tolerance / (settings.barrier_gate + 1)
        while barrier > least and errors.at(barrier) <= settings.barrier_gate * barrier:
            barrier = max(
                least, min(settings.barrier_shrink * barrier, barrier**settings.barrier_power)
            )
        return barrier

    def _search(
        self, here: _Here, blocks: Blocks, factor: Factor, step: Point, slope: float
    ) -> _Trial | None:
        """Return the step, or the step with corrections, if the filter accepts it, or None."""
        settings, total, this, before = self.settings, here.excess, step, np.inf
        noise = 1e-9 * abs(here.phi)
        for corrections in range(settings.corrections + 1):
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # a wild trial
                moved, values, length = self._moved(here, this)
                miss = self.system.excess(moved, values)
                missed = miss.plus(here.excess, length - 1).energy()
            if not np.isfinite(missed):
                return None
            gain = max(-slope * length + here.excess.energy(), 1e-300)
            more = corrections < settings.corrections
            bent = missed > max(settings.loose * gain, noise) and missed < 0.5 * before
            tame = missed <= max(MOST_NONLINEAR * gain, noise)
            if tame and not (more and bent) and self._accepts(here, moved, miss, slope * length):
                return _Trial(moved, values, length, missed / gain)
            if more:
                total = miss.plus(here.excess, length) if corrections == 0 else total.plus(miss)
                before = missed
                this, _slope = newton_step(self.system, here.point, blocks, factor, total)
        return None

    def _accepts(self, here: _Here, moved: Point, miss: Excess, slope: float) -> bool:
        """Say whether the filter takes a trial point."""
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            after = miss.total(), self.system.objective(moved, here.barrier)
        return self.filter.takes((here.theta, here.phi), after, slope, here.limits)

    def _restored(self, here: _Here, step: Point) -> _Trial | None:
        """Return the whole step if it lowers the barrier problem's error, or None.

        The soft restoration of Wächter & Biegler §3.3: near an optimum φ and θ change by less
        than rounding, but the error of the optimality conditions still tells steps apart.
        """
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # a wild trial
            moved, found, length = self._moved(here, step)
        if not np.isfinite(found.residuals).all() or np.abs(found.residuals).max() > 1e100:
            return None
        slopes = self.evaluator.slopes(found)
        after = self.system.errors(moved, found, slopes).at(here.barrier)
        if not self.filter.takes_restoration(here.errors.at(here.barrier), after):
            return None
        return _Trial(moved, found, length, slopes=slopes)

    def _moved(self, here: _Here, step: Point) -> tuple[Point, Values, float]:
        """Return the point a step away, its values, and the step's length."""
        point, system = here.point, self.system
        kept, whole = min(0.01, here.barrier), self.settings.whole_steps
        primal = 1.0 if whole else self._longest(
            [(point.coefficients, step.coefficients, system.bearing),
             (point.slack, step.slack, system.active)], 1 - kept
        )  # fmt: skip
        dual = self._longest(
            [(point.dual, step.dual, system.bearing),
             (point.row_dual, step.row_dual, system.active)], 1 - kept
        )  # fmt: skip
        moved = point.moved(step, primal, dual)
        if whole:
            forces = np.maximum(moved.coefficients, kept * point.coefficients)
            moved = replace(moved, coefficients=np.where(system.bearing, forces, 0.0))
        values = self._values(moved)
        return system.settled(moved, values, here.barrier) if whole else moved, values, primal

    def _closed(self, point: Point, values: Values, barrier: float) -> Point:
        """Return the point with copies, slacks and elastic parts that miss no constraint."""
        closed = replace(
            point,
            lift=values.residuals,
            foot_lift=values.foot_residuals,
            multiplier=values.residuals,
            foot_multiplier=values.foot_residuals,
        )
        return self.system.settled(closed, values, barrier)

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
            with np.errstate(divide="ignore", invalid="ignore"):  # where nothing falls
                lengths = fraction * value / -step
            length = lengths.min(where=where & (step < 0), initial=length)
        return float(length)
