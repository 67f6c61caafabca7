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
    multiplier: Array
    foot_multiplier: Array
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
        scaled = self._central(controls, np.maximum(coefficients / FORCE_UNIT, 1e-2), barrier)
        values = evaluator.values(controls, scaled * FORCE_UNIT)
        slack = np.where(self.active, np.maximum(values.inequalities, 1e-2), 1.0)
        row_dual = np.where(self.active, np.minimum(barrier / slack, self.weight * slack), 0.0)
        return Point(
            controls=controls,
            coefficients=scaled,
            lift=values.residuals,
            foot_lift=values.foot_residuals,
            multiplier=values.residuals,
            foot_multiplier=values.foot_residuals,
            elastic=row_dual / self.weight,
            slack=slack,
            dual=np.where(self.bearing, barrier / np.where(self.bearing, scaled, 1.0), 0.0),
            row_dual=row_dual,
        )

    def _central(self, controls: Array, coefficients: Array, barrier: float) -> Array:
        """Return the λ/100 N that suit a motion best at this barrier: convex, frame by frame."""
        evaluator = self.evaluator
        values = evaluator.values(controls, np.zeros_like(coefficients))
        columns = FORCE_UNIT * evaluator.slopes(values).by_coefficients
        inner = np.swapaxes(columns, 1, 2) @ columns
        index = np.arange(4 * POINTS)
        inner[:, index, index] += np.where(self.bearing, self.force_weight, 1.0)
        pull = np.einsum("fru,fr->fu", columns, values.residuals)
        found = np.where(self.bearing, coefficients, 1.0)
        dual = np.where(self.bearing, barrier / found, 0.0)
        for _ in range(60):
            gradient = np.einsum("fuv,fv->fu", inner, np.where(self.bearing, found, 0.0)) + pull
            left = np.where(self.bearing, gradient - barrier / found, 0.0)
            matrix = inner.copy()
            matrix[:, index, index] += np.where(self.bearing, dual / found, 0.0)
            step = np.linalg.solve(matrix, -left[..., None])[..., 0]
            dual_step = np.where(self.bearing, barrier / found - dual * (1 + step / found), 0.0)
            primal_length, dual_length = (
                np.where(
                    self.bearing & (move < 0), 0.99 * value / np.maximum(-move, 1e-300), 1.0
                ).min(axis=1, keepdims=True, initial=1.0)
                for value, move in ((found, step), (dual, dual_step))
            )
            found = found + primal_length * step
            dual = dual + dual_length * dual_step
            if np.abs(np.where(self.bearing, gradient - dual, 0.0)).max() < barrier:
                break
        return np.where(self.bearing, found, 0.0)

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
        barrier, last = settings.barrier, 0.0
        least = settings.tolerance / (settings.barrier_gate + 1)
        trace: list[Trace] = []
        values = self.evaluator.values(point.controls, point.coefficients * FORCE_UNIT)
        theta = self._excess(point, values).total()
        limits = (1e4 * max(1.0, theta), 1e-4 * max(1.0, theta))
        filter_: list[tuple[float, float]] = []
        status, error = "iteration limit", np.inf
        step_length = regularisation = 0.0
        for iteration in range(settings.iterations + 1):
            slopes = self.evaluator.slopes(values)
            error = self._error(point, values, slopes, 0.0)
            energy, phi = values.energy, self._objective(point, barrier)
            theta = self._excess(point, values).total()
            trace.append(
                Trace(
                    iteration,
                    perf_counter() - began,
                    energy,
                    phi,
                    theta,
                    error,
                    barrier,
                    step_length,
                    regularisation,
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
            blocks = self._blocks(point, values, slopes, barrier)
            excess = self._excess(point, values)
            factor = self._factorise(blocks, last)
            regularisation = factor.delta
            last = regularisation or last
            step, slope = self._newton(point, values, blocks, factor, excess)
            accepted = self._search(point, step, slope, phi, theta, barrier, filter_, limits)
            if accepted is None:
                if theta <= 1e-9 * max(1.0, abs(phi)):
                    status = "no step found"
                    break
                # Restoration is exact here: the copies take the residuals' own values.
                point = self._closed(point, values)
                filter_, step_length = [], 0.0
                continue
            step_length = accepted.length
            point, values = accepted.point, accepted.values
            point = self._safe_duals(point, barrier)
        return InteriorPointResult(
            status, point, values, float(error), len(trace) - 1, perf_counter() - began, trace
        )

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
        fraction = max(0.99, 1 - barrier)
        primal = self._longest(
            [(point.coefficients, step.coefficients, self.bearing),
             (point.slack, step.slack, self.active)], fraction
        )  # fmt: skip
        dual = self._longest(
            [(point.dual, step.dual, self.bearing),
             (point.row_dual, step.row_dual, self.active)], fraction
        )  # fmt: skip
        noise = 10 * np.finfo(float).eps * abs(phi)
        length = primal
        for _ in range(25):
            moved = point.moved(step, length, dual)
            values = self.evaluator.values(moved.controls, moved.coefficients * FORCE_UNIT)
            new_theta = self._excess(moved, values).total()
            new_phi = self._objective(moved, barrier)
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

    def _closed(self, point: Point, values: Values) -> Point:
        slack = np.where(self.active, np.maximum(values.inequalities, 1e-8), 1.0)
        elastic = np.where(self.active, slack - values.inequalities, 0.0)
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

    def _excess(self, point: Point, values: Values) -> _Excess:
        rows = np.where(self.active, values.inequalities + point.elastic - point.slack, 0.0)
        return _Excess(values.residuals - point.lift, values.foot_residuals - point.foot_lift, rows)

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
        gradient = self._gradients(slopes, point.multiplier, point.foot_multiplier, point.row_dual)
        by_controls = assemble_gradient(self.evaluator.basis, gradient)
        by_controls[self.fixed] = 0.0
        by_force = FORCE_UNIT * np.einsum("fru,fr->fu", slopes.by_coefficients, point.multiplier)
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
            np.abs(gaps - barrier).max(initial=0.0) / scale_gap,
        ]
        return float(max(parts))

    def _factorise(self, blocks: _Blocks, last: float) -> _Factor:
        """Return the factored Newton matrix, regularised by as little δ as makes it convex."""
        delta = 0.0
        while True:
            found = self._eliminate(blocks, delta)
            if found is not None:
                return found
            if delta == 0:
                delta = 1e-4 if last == 0 else max(1e-20, last / 3)
            else:
                delta *= 100.0 if last == 0 else 8.0
            if not delta < 1e20:
                raise FloatingPointError("the Newton matrix has entries that are not finite")

    def _newton(
        self, point: Point, values: Values, blocks: _Blocks, factor: _Factor, excess: _Excess
    ) -> tuple[Point, float]:
        """Return the step for given constraint errors, and the slope of φ along it."""
        basis, more = self.evaluator.basis, 1 + factor.delta
        lift = point.lift + more * excess.residuals
        foot_lift = point.foot_lift + more * excess.feet
        firm = point.slack + point.row_dual / self.weight
        target = blocks.barrier + point.row_dual * (
            point.slack - (excess.rows + point.slack - point.elastic)
        )
        wanted = np.where(self.active, target / firm, 0.0)
        gradient = np.einsum("fru,fr->fu", blocks.slopes.by_state, lift)
        gradient[:, :COUNT] += np.einsum("fru,fr->fu", blocks.slopes.feet, foot_lift)
        gradient[:, :COUNT] -= self._row_pull(blocks.slopes, wanted)
        pull = np.einsum("fru,fr->fu", blocks.by_force, lift) + blocks.force_pull
        answer = (factor.inverse @ pull[..., None])[..., 0]
        gradient -= (factor.cross @ answer[..., None])[..., 0]
        right = -assemble_gradient(basis, gradient)
        right[self.fixed] = 0.0
        moved = solve(factor.factor, right)
        moved[self.fixed] = 0.0
        state = spread(basis, moved)
        forces = -answer - (factor.answer @ state[..., None])[..., 0]
        forces = np.where(self.bearing, forces, 0.0)
        return self._step(point, blocks, excess, wanted, moved, state, forces, factor.delta)

    def _blocks(self, point: Point, values: Values, slopes: Slopes, barrier: float) -> _Blocks:
        """Return the parts of the Newton system that do not depend on the regularisation."""
        evaluator = self.evaluator
        n = len(evaluator.limited)
        q, at = slice(0, COUNT), evaluator.limited
        by_state = slopes.by_state
        by_force = FORCE_UNIT * slopes.by_coefficients
        pushes = -point.row_dual[:, 2 * n :] * evaluator.row_scale[2 * n :]
        bend, mixed = evaluator.curvature(
            values, slopes, point.multiplier, point.foot_multiplier, pushes
        )
        turned = np.swapaxes(by_state, 1, 2)
        gauss = turned @ by_state
        gauss[:, q, q] += np.swapaxes(slopes.feet, 1, 2) @ slopes.feet
        # Inequalities have the stiffness w/(s + w/ρ).
        firm = point.slack + point.row_dual / self.weight
        stiff = np.where(self.active, point.row_dual / firm, 0.0)
        stiff_scaled = stiff * evaluator.row_scale**2
        up = slopes.heights * stiff_scaled[:, 2 * n :, None]
        bend[:, q, q] += np.swapaxes(slopes.heights, 1, 2) @ up
        bend[:, at, at] += stiff_scaled[:, :n] + stiff_scaled[:, n : 2 * n]
        safe = np.where(self.bearing, point.coefficients, 1.0)
        pull = np.where(self.bearing, self.force_weight * point.coefficients - barrier / safe, 0.0)
        return _Blocks(
            barrier=barrier,
            curved=bend,
            gauss=gauss,
            mixed_curved=FORCE_UNIT * mixed,
            mixed_gauss=turned @ by_force,
            inner_gauss=np.swapaxes(by_force, 1, 2) @ by_force,
            inner_diagonal=np.where(self.bearing, point.dual / safe + self.force_weight, 1.0),
            force_pull=pull,
            by_force=by_force,
            slopes=slopes,
            stiff=stiff,
        )

    def _eliminate(self, blocks: _Blocks, delta: float) -> _Factor | None:
        """Return the factored matrix with λ eliminated; None if it is not convex at δ.

        δ is added on all unknowns: on the copies of residuals it means (1 + δ) JᵀJ, a metric in
        which the valleys of E are not narrow.
        """
        more = 1 + delta
        index = np.arange(4 * POINTS)
        hessian = blocks.curved + more * blocks.gauss
        if delta:
            diagonal = np.arange(3 * COUNT)
            hessian[:, diagonal, diagonal] += delta * METRIC
        inner = more * blocks.inner_gauss
        inner[:, index, index] += blocks.inner_diagonal + delta
        cross = blocks.mixed_curved + more * blocks.mixed_gauss
        inverse = np.linalg.inv(inner)
        answer = inverse @ np.swapaxes(cross, 1, 2)
        hessian -= cross @ answer
        fixed = np.where(self.fixed, 1e12, 0.0).ravel()
        factor = assemble_hessian(self.evaluator.basis, hessian).factor(fixed + delta)
        return None if factor is None else _Factor(factor, inverse, cross, answer, delta)

    def _step(
        self,
        point: Point,
        blocks: _Blocks,
        excess: _Excess,
        wanted: Array,
        moved: Array,
        state: Array,
        forces: Array,
        delta: float,
    ) -> tuple[Point, float]:
        """Return the whole step and the slope of φ along it, from its part in (x, λ)."""
        evaluator, barrier, slopes = self.evaluator, blocks.barrier, blocks.slopes
        n, at, q = len(evaluator.limited), evaluator.limited, slice(0, COUNT)
        change = np.einsum("fru,fu->fr", slopes.by_state, state)
        change += np.einsum("fru,fu->fr", blocks.by_force, forces)
        lift = change + excess.residuals
        foot_lift = np.einsum("fru,fu->fr", slopes.feet, state[:, q]) + excess.feet
        rows = np.empty_like(point.slack)
        rows[:, :n] = state[:, at]
        rows[:, n : 2 * n] = -state[:, at]
        rows[:, 2 * n :] = np.einsum("fpq,fq->fp", slopes.heights, state[:, q])
        rows *= evaluator.row_scale
        new_dual = np.where(self.active, wanted - blocks.stiff * rows, 0.0)
        elastic = np.where(self.active, new_dual / self.weight - point.elastic, 0.0)
        slack = np.where(self.active, excess.rows + rows + elastic, 0.0)
        safe = np.where(self.bearing, point.coefficients, 1.0)
        dual = np.where(self.bearing, barrier / safe - point.dual * (1 + forces / safe), 0.0)
        step = Point(
            controls=moved,
            coefficients=forces,
            lift=lift,
            foot_lift=foot_lift,
            multiplier=(1 + delta) * lift + point.lift - point.multiplier,
            foot_multiplier=(1 + delta) * foot_lift + point.foot_lift - point.foot_multiplier,
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
        return step, float(slope)


@dataclass(frozen=True)
class _Trial:
    """A point that was accepted, and the step length that led to it."""

    point: Point
    values: Values
    length: float


@dataclass(frozen=True)
class _Blocks:
    """Per-frame parts of the Newton system: exact curvature and Gauss–Newton parts apart."""

    barrier: float
    curved: Array
    gauss: Array
    mixed_curved: Array
    mixed_gauss: Array
    inner_gauss: Array
    inner_diagonal: Array
    force_pull: Array
    by_force: Array
    slopes: Slopes
    stiff: Array


@dataclass(frozen=True)
class _Factor:
    """The factored banded matrix, and per frame how λ is eliminated."""

    factor: Array
    inverse: Array
    cross: Array
    answer: Array
    delta: float


@dataclass(frozen=True)
class _Excess:
    """Errors of the constraints: r − z, foot residuals − copies, g + p − s."""

    residuals: Array
    feet: Array
    rows: Array

    def total(self) -> float:
        """Return θ, the sum of all magnitudes."""
        parts = (self.residuals, self.feet, self.rows)
        return float(sum(np.abs(part).sum() for part in parts))
