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
from dataclasses import dataclass, field, replace
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from motionstyle.spacetime.banded import (
    BandedHessian,
    assemble_gradient,
    assemble_hessian,
    solve,
    spread,
)
from motionstyle.spacetime.spacetime_problem import COUNT, POINTS, Evaluator, Slopes, Values

Array = NDArray[np.float64]
FORCE_UNIT = 100.0  # N; coefficients are scaled by it
METRIC = np.repeat([1.0, 1e-2, 1e-4], COUNT)  # of q, q̇, q̈ where curvature must be added


@dataclass(frozen=True)
class SolverSettings:
    """Tolerances and limits; `tolerance` is on the scaled optimality error."""

    tolerance: float = 1e-6
    iterations: int = 300
    seconds: float = 120.0
    barrier: float = 1e-1
    barrier_shrink: float = 0.2
    barrier_power: float = 1.5
    barrier_gate: float = 10.0


@dataclass(frozen=True)
class Point:
    """Unknowns: controls (K, 35), λ/100 N (F, 32), elastic parts and slacks of inequalities (F, R).

    lift, foot_lift : copies (and multipliers) of residuals. dual, row_dual : of λ and slacks.
    """

    controls: Array
    coefficients: Array
    lift: Array
    foot_lift: Array
    elastic: Array
    slack: Array
    dual: Array
    row_dual: Array

    def moved(self, step: Point, primal: float, dual: float) -> Point:
        """Return the point after a step of two lengths."""
        lengths = {"dual": dual, "row_dual": dual}
        return Point(
            **{
                name: getattr(self, name) + lengths.get(name, primal) * getattr(step, name)
                for name in self.__dataclass_fields__
            }
        )


@dataclass(frozen=True)
class Trace:
    """One iteration as recorded."""

    iteration: int
    seconds: float
    energy: float
    objective: float
    infeasibility: float
    optimality: float
    barrier: float
    step: float
    regularisation: float


@dataclass(frozen=True)
class InteriorPointResult:
    """What the solver ends with; `status` is `converged` or the reason why not."""

    status: str
    point: Point
    values: Values
    optimality: float
    iterations: int
    seconds: float
    trace: list[Trace] = field(default_factory=list)


class InteriorPoint:
    """Solves one problem from a start; keeps what two solves share."""

    def __init__(self, evaluator: Evaluator, settings: SolverSettings) -> None:
        self.evaluator = evaluator
        self.settings = settings
        self.bearing = evaluator.bearing
        self.active = evaluator.row_active
        self.weight = evaluator.row_weight
        self.force_weight = evaluator.problem.settings.force_weight * FORCE_UNIT**2
        keep = evaluator.problem.keep_ends
        self.fixed = np.zeros((evaluator.basis.controls, COUNT), dtype=bool)
        if keep:
            self.fixed[:keep] = self.fixed[-keep:] = True
        frames = evaluator.problem.frames
        metric = np.broadcast_to(np.diag(METRIC), (frames, 3 * COUNT, 3 * COUNT))
        self.metric = assemble_hessian(evaluator.basis, metric)

    def start(self, controls: Array, coefficients: Array | None = None) -> Point:
        """Return a point to start from; λ (N) is found from the motion if it is not given."""
        barrier = self.settings.barrier
        evaluator = self.evaluator
        if coefficients is None:
            coefficients = self._first_coefficients(controls)
        scaled = np.where(self.bearing, np.maximum(coefficients / FORCE_UNIT, 1e-2), 0.0)
        values = evaluator.values(controls, scaled * FORCE_UNIT)
        slack = np.where(self.active, np.maximum(values.inequalities, 1e-2), 1.0)
        row_dual = np.where(self.active, np.minimum(barrier / slack, self.weight * slack), 0.0)
        return Point(
            controls=controls,
            coefficients=scaled,
            lift=values.residuals,
            foot_lift=values.foot_residuals,
            elastic=row_dual / self.weight,
            slack=slack,
            dual=np.where(self.bearing, barrier / np.maximum(scaled, 1e-2), 0.0),
            row_dual=row_dual,
        )

    def _first_coefficients(self, controls: Array) -> Array:
        """Return λ that nearly balances the root, by ridge regression and clipping."""
        empty = np.zeros((self.evaluator.problem.frames, 4 * POINTS))
        values = self.evaluator.values(controls, empty)
        columns = self.evaluator.slopes(values).by_coefficients[:, :6]
        inner = columns @ np.swapaxes(columns, 1, 2)
        size = np.trace(inner, axis1=1, axis2=2)[:, None, None]
        inner = inner + (1e-6 * size + 1e-12) * np.eye(6)
        pull = np.linalg.solve(inner, -values.residuals[:, :6, None])
        return (np.swapaxes(columns, 1, 2) @ pull)[..., 0]

    def solve(self, point: Point, log: Callable[[str], None] | None = None) -> InteriorPointResult:
        """Return the optimum reached from a point."""
        settings = self.settings
        began = perf_counter()
        barrier, last_regularisation = settings.barrier, 0.0
        least = settings.tolerance / (settings.barrier_gate + 1)
        trace: list[Trace] = []
        values = self.evaluator.values(point.controls, point.coefficients * FORCE_UNIT)
        theta = self._infeasibility(point, values)
        theta_max, theta_min = 1e4 * max(1.0, theta), 1e-4 * max(1.0, theta)
        filter_: list[tuple[float, float]] = []
        status, error = "iteration limit", np.inf
        step_length = regularisation = 0.0
        for iteration in range(settings.iterations + 1):
            slopes = self.evaluator.slopes(values)
            error = self._error(point, values, slopes, 0.0)
            energy, phi = values.energy, self._objective(point, barrier)
            theta = self._infeasibility(point, values)
            trace.append(
                Trace(
                    iteration, perf_counter() - began, energy, phi, theta, error, barrier,
                    step_length, regularisation,
                )  # fmt: skip
            )
            if log:
                log(
                    f"{iteration:4d} E {energy:12.5f} θ {theta:9.2e} opt {error:9.2e} "
                    f"μ {barrier:8.1e} α {step_length:7.1e} δ {regularisation:7.1e}"
                )
            if not np.isfinite(phi) or not np.isfinite(energy):
                status = "not a number"
                break
            if error <= settings.tolerance:
                status = "converged"
                break
            if iteration == settings.iterations:
                break
            if perf_counter() - began > settings.seconds:
                status = "time limit"
                break
            while (
                barrier > least
                and self._error(point, values, slopes, barrier) <= settings.barrier_gate * barrier
            ):
                barrier = max(
                    least, min(settings.barrier_shrink * barrier, barrier**settings.barrier_power)
                )
                filter_ = []
                phi = self._objective(point, barrier)
            step, regularisation, slope = self._direction(
                point, values, slopes, barrier, last_regularisation
            )
            if regularisation > 0:
                last_regularisation = regularisation
            fraction = max(0.99, 1 - barrier)
            primal = self._longest(
                [(point.coefficients, step.coefficients, self.bearing),
                 (point.slack, step.slack, self.active)], fraction
            )  # fmt: skip
            dual = self._longest(
                [(point.dual, step.dual, self.bearing),
                 (point.row_dual, step.row_dual, self.active)], fraction
            )  # fmt: skip
            length, accepted = primal, None
            for _ in range(25):
                trial = point.moved(step, length, dual)
                trial_values = self.evaluator.values(
                    trial.controls, trial.coefficients * FORCE_UNIT
                )
                trial_theta = self._infeasibility(trial, trial_values)
                trial_phi = self._objective(trial, barrier)
                if np.isfinite(trial_phi) and trial_theta <= theta_max:
                    blocked = any(
                        trial_theta >= (1 - 1e-5) * t and trial_phi >= p - 1e-5 * t
                        for t, p in filter_
                    )
                    descent = slope < 0 and length * (-slope) ** 2.3 > theta**1.1
                    if not blocked:
                        slackness = 10 * np.finfo(float).eps * abs(phi)
                        if descent and theta <= theta_min:
                            if trial_phi - phi - slackness <= 1e-8 * length * slope:
                                accepted = (trial, trial_values)
                                break
                        elif (
                            trial_theta <= (1 - 1e-5) * theta
                            or trial_phi - slackness <= phi - 1e-5 * theta
                        ):
                            accepted = (trial, trial_values)
                            filter_.append(((1 - 1e-5) * theta, phi - 1e-5 * theta))
                            break
                length *= 0.5
            if accepted is None:
                if theta <= 1e-9 * max(1.0, abs(phi)):
                    status = "no step found"
                    break
                # Restoration is exact here: the copies take the residuals' own values.
                point = self._closed(point, values)
                filter_, step_length = [], 0.0
                continue
            step_length = length
            point, values = accepted
            point = self._safe_duals(point, barrier)
        return InteriorPointResult(
            status, point, values, float(error), len(trace) - 1, perf_counter() - began, trace
        )

    def _closed(self, point: Point, values: Values) -> Point:
        slack = np.where(self.active, np.maximum(values.inequalities, 1e-8), 1.0)
        elastic = np.where(self.active, slack - values.inequalities, 0.0)
        return replace(
            point,
            lift=values.residuals,
            foot_lift=values.foot_residuals,
            slack=slack,
            elastic=elastic,
        )

    def _safe_duals(self, point: Point, barrier: float) -> Point:
        """Keep duals within 1e10 of their central values, as Wächter & Biegler eq. (16)."""
        new = {}
        for name, primal, where in (
            ("dual", point.coefficients, self.bearing),
            ("row_dual", point.slack, self.active),
        ):
            centre = barrier / np.where(where, primal, 1.0)
            kept = np.clip(getattr(point, name), centre / 1e10, centre * 1e10)
            new[name] = np.where(where, kept, 0.0)
        return replace(point, **new)

    @staticmethod
    def _longest(pairs: list[tuple[Array, Array, Array]], fraction: float) -> float:
        length = 1.0
        for value, step, where in pairs:
            falling = where & (step < 0)
            if falling.any():
                length = min(length, float((fraction * value[falling] / -step[falling]).min()))
        return length

    def _objective(self, point: Point, barrier: float) -> float:
        logs = np.log(point.coefficients[self.bearing]).sum()
        logs += np.log(point.slack[self.active]).sum()
        half = (point.lift**2).sum() + (point.foot_lift**2).sum()
        half += self.force_weight * (point.coefficients[self.bearing] ** 2).sum()
        half += (self.weight * point.elastic**2)[self.active].sum()
        return float(0.5 * half - barrier * logs)

    def _infeasibility(self, point: Point, values: Values) -> float:
        rows = np.abs(values.inequalities + point.elastic - point.slack)[self.active].sum()
        lifted = np.abs(values.residuals - point.lift).sum()
        return float(lifted + np.abs(values.foot_residuals - point.foot_lift).sum() + rows)

    def _gradients(self, slopes: Slopes, lift: Array, foot_lift: Array, rows: Array) -> Array:
        """Return Jᵀy summed over all rows, by u, (F, 105)."""
        gradient = np.einsum("fru,fr->fu", slopes.by_state, lift)
        gradient[:, :COUNT] += np.einsum("fru,fr->fu", slopes.feet, foot_lift)
        gradient[:, :COUNT] -= self._row_pull(slopes, rows)
        return gradient

    def _row_pull(self, slopes: Slopes, rows: Array) -> Array:
        """Return ∂(rows)ᵀ·multipliers by q, (F, 35)."""
        evaluator = self.evaluator
        n = len(evaluator.limited)
        scaled = rows * evaluator.row_scale
        pull = np.einsum("fpq,fp->fq", slopes.heights, scaled[:, 2 * n :])
        pull[:, evaluator.limited] += scaled[:, :n] - scaled[:, n : 2 * n]
        return pull

    def _error(self, point: Point, values: Values, slopes: Slopes, barrier: float) -> float:
        """Return the scaled optimality error, Wächter & Biegler eq. (5)."""
        gradient = self._gradients(slopes, point.lift, point.foot_lift, point.row_dual)
        by_controls = assemble_gradient(self.evaluator.basis, gradient)
        by_controls[self.fixed] = 0.0
        by_force = FORCE_UNIT * np.einsum("fru,fr->fu", slopes.by_coefficients, point.lift)
        by_force += self.force_weight * point.coefficients - point.dual
        by_elastic = (self.weight * point.elastic - point.row_dual)[self.active]
        duals = np.concatenate([point.dual[self.bearing], point.row_dual[self.active]])
        every = np.abs(duals).sum() + np.abs(point.lift).sum() + np.abs(point.foot_lift).sum()
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
            np.abs(values.residuals - point.lift).max(),
            np.abs(values.foot_residuals - point.foot_lift).max(),
            np.abs(values.inequalities + point.elastic - point.slack)[self.active].max(initial=0.0),
            np.abs(gaps - barrier).max(initial=0.0) / scale_gap,
        ]
        return float(max(parts))

    def _direction(
        self, point: Point, values: Values, slopes: Slopes, barrier: float, last: float
    ) -> tuple[Point, float, float]:
        """Return the Newton step, the curvature δ added, and the slope of φ along the step."""
        evaluator = self.evaluator
        n = len(evaluator.limited)
        by_state = slopes.by_state
        by_force = FORCE_UNIT * slopes.by_coefficients
        pushes = -point.row_dual[:, 2 * n :] * evaluator.row_scale[2 * n :]
        bend, mixed = evaluator.curvature(values, slopes, point.lift, point.foot_lift, pushes)
        turned = np.swapaxes(by_state, 1, 2)
        hessian = bend + turned @ by_state
        q = slice(0, COUNT)
        hessian[:, q, q] += np.swapaxes(slopes.feet, 1, 2) @ slopes.feet
        # Inequalities: stiffness w/(s + w/ρ) and the multiplier's part that does not move.
        firm = point.slack + point.row_dual / self.weight
        stiff = np.where(self.active, point.row_dual / firm, 0.0)
        target = barrier + point.row_dual * (point.slack - values.inequalities)
        wanted = np.where(self.active, target / firm, 0.0)
        stiff_scaled = stiff * evaluator.row_scale**2
        up = slopes.heights * stiff_scaled[:, 2 * n :, None]
        hessian[:, q, q] += np.swapaxes(slopes.heights, 1, 2) @ up
        at = evaluator.limited
        hessian[:, at, at] += stiff_scaled[:, :n] + stiff_scaled[:, n : 2 * n]
        gradient = self._gradients(slopes, values.residuals, values.foot_residuals, wanted)
        # λ: eliminated frame by frame.
        safe = np.where(self.bearing, point.coefficients, 1.0)
        inner = np.swapaxes(by_force, 1, 2) @ by_force
        diagonal = np.where(self.bearing, point.dual / safe + self.force_weight, 1.0)
        index = np.arange(4 * POINTS)
        inner[:, index, index] += diagonal
        cross = turned @ by_force + FORCE_UNIT * mixed
        pull = np.einsum("fru,fr->fu", by_force, values.residuals)
        pull += self.force_weight * point.coefficients
        pull -= np.where(self.bearing, barrier / safe, 0.0)
        joined = np.concatenate([np.swapaxes(cross, 1, 2), pull[..., None]], axis=2)
        eliminated = np.linalg.solve(inner, joined)
        hessian -= cross @ eliminated[..., :-1]
        gradient -= (cross @ eliminated[..., -1:])[..., 0]
        right = -assemble_gradient(evaluator.basis, gradient)
        right[self.fixed] = 0.0
        whole = assemble_hessian(evaluator.basis, hessian)
        factor, delta = self._factor(whole, last)
        moved = solve(factor, right)
        moved[self.fixed] = 0.0
        state = spread(evaluator.basis, moved)
        forces = -(eliminated[..., -1] + (eliminated[..., :-1] @ state[..., None])[..., 0])
        forces = np.where(self.bearing, forces, 0.0)
        change = np.einsum("fru,fu->fr", by_state, state)
        change += np.einsum("fru,fu->fr", by_force, forces)
        lift = values.residuals + change - point.lift
        foot_change = np.einsum("fru,fu->fr", slopes.feet, state[:, q])
        foot_lift = values.foot_residuals + foot_change - point.foot_lift
        rows = np.empty_like(point.slack)
        rows[:, :n] = state[:, at]
        rows[:, n : 2 * n] = -state[:, at]
        rows[:, 2 * n :] = np.einsum("fpq,fq->fp", slopes.heights, state[:, q])
        rows *= evaluator.row_scale
        new_dual = np.where(self.active, wanted - stiff * rows, 0.0)
        elastic = np.where(self.active, new_dual / self.weight - point.elastic, 0.0)
        slack = values.inequalities + rows + point.elastic + elastic - point.slack
        slack = np.where(self.active, slack, 0.0)
        dual = np.where(self.bearing, barrier / safe - point.dual * (1 + forces / safe), 0.0)
        step = Point(
            controls=moved,
            coefficients=forces,
            lift=lift,
            foot_lift=foot_lift,
            elastic=elastic,
            slack=slack,
            dual=dual,
            row_dual=new_dual - point.row_dual,
        )
        slope = (point.lift * lift).sum() + (point.foot_lift * foot_lift).sum()
        slope += (self.force_weight * point.coefficients * forces)[self.bearing].sum()
        slope += (self.weight * point.elastic * elastic)[self.active].sum()
        slope -= barrier * (forces / safe)[self.bearing].sum()
        slope -= barrier * (slack / point.slack)[self.active].sum()
        return step, delta, float(slope)

    def _factor(self, whole: BandedHessian, last: float) -> tuple[Array, float]:
        """Return a Cholesky factor after adding as little of the metric as makes it positive."""
        fixed = np.where(self.fixed, 1e12, 0.0).ravel()
        factor = whole.factor(fixed)
        if factor is not None:
            return factor, 0.0
        delta = 1e-4 if last == 0 else max(1e-20, last / 3)
        while delta < 1e20:
            factor = whole.plus(self.metric, delta).factor(fixed + delta)
            if factor is not None:
                return factor, delta
            delta *= 100.0 if last == 0 else 8.0
        raise FloatingPointError("no curvature makes the matrix positive: its entries are not finite")
