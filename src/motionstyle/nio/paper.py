"""The paper's learner: gradient steps on G with a halving line search (nio.md A4, A5).

As printed but for what cannot be meant: each unknown is scaled by its usual size, α by itself (A5,
defect iii; `scaled = False` keeps the printed units as a reference), θ stays in its bounds, the
line search brackets with G̃ of frozen X_S (eq. 20) and is accepted only if the true G + D falls
(defects i, ii). Inner solves are cut off early, as the authors' were, but each starts from the
lowest X_S known, and G takes the lowest of all X_S found so far: cut off from X_T anew, E(X_S) ends
at up to four times its minimum, anywhere, and G + D of neighbouring θ cannot be told apart.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.layout import JOINT_COORDINATES
from motionstyle.dynamics.passive import LARGEST_DAMPING, LARGEST_STIFFNESS, SIGMOID_GAIN
from motionstyle.nio.derivatives import JOINTS, SIZE, energy_by_style
from motionstyle.nio.inner import (
    Inner,
    InnerSettings,
    Learnt,
    inner_solve,
    learning_row,
    learnt,
)
from motionstyle.nio.learning_problem import Cost, LearningProblem, motion_cost, target_cost
from motionstyle.nio.style_space import LARGEST_SHOE_LENGTH, LARGEST_SHOE_STIFFNESS
from motionstyle.spacetime.solver_point import Point
from motionstyle.spacetime.style import Style

Array = NDArray[np.float64]

LEAST_UNSCALED = 1e-5  # α below 0 makes E unbounded (nio.md §10)
SUM_WEIGHT = 1e4  # w of eq. (18)
REFERENCE = (100.0, 100.0, 5.0, 0.1)  # of k_s1, k_s2, k_d, q̄ (nio.md A5, but for q̄)
SHOE_REFERENCE = (1e3, 5e-4)  # 2e4, 0.02 would leave room for no other unknown's step
SMALLEST_STEP = 1e-6


@dataclass(frozen=True)
class PaperSettings:
    """Settings of the paper's learner.

    iterations : of the main loop, 50 in the paper. first_iterations, inner_iterations : after which
    the first inner solve, from X_T, and all others, from the lowest X_S known, are cut off.
    first_barrier, barrier : theirs. scaled : whether unknowns are scaled by their usual size.
    least_preference : of 29 α, where scaled. longest_step : what β = 1 moves the fastest of the
    scaled unknowns by. trials : how many step lengths, each a quarter of the last, are verified by
    a true G before learning stops. growth : a step is at most so many times the last accepted one.
    kept : how many X_S, the lowest, are held against every θ.
    """

    iterations: int = 50
    first_iterations: int = 100
    inner_iterations: int = 30
    first_barrier: float = 1e-2
    barrier: float = 1e-3
    scaled: bool = True
    least_preference: float = 0.1
    longest_step: float = 1.0
    trials: int = 6
    growth: float = 4.0
    kept: int = 12


@dataclass(frozen=True)
class _Known:
    """A style, E(X_T), and the lowest X_S known for it.

    point : where that X_S was found, to start the next inner solve from.
    """

    style: Style
    target: Cost
    inner: Inner
    point: Point

    @property
    def objective(self) -> float:
        """G + D."""
        gap = self.target.total - self.inner.cost.total
        return gap + soft_constraints(self.style.preferences)

    @property
    def told(self) -> bool:
        """Whether G is told: a solve cut off above X_T says nothing, least of all that G = 0."""
        return self.inner.cost is not self.target or self.inner.result.status == "converged"


def soft_constraints(preferences: Array) -> float:
    """Return D(θ) of eq. (18)."""
    short = np.minimum(preferences, 0.0)
    return float(SUM_WEIGHT * ((preferences.sum() - 1) ** 2 + (short**2).sum()))


def soft_slopes(preferences: Array) -> Array:
    """Return dD/dθ of eq. (18), (147,)."""
    found = np.zeros(SIZE)
    short = np.minimum(preferences, 0.0)
    found[:JOINTS] = 2 * SUM_WEIGHT * ((preferences.sum() - 1) + short)
    return found


def learn_as_paper(
    learning: LearningProblem,
    settings: PaperSettings,
    log: Callable[[str], None] = print,
) -> Learnt:
    """Return the style learnt from X_T by the paper's algorithm; rows as of `ours.learn`."""
    began = perf_counter()
    rows: list[dict[str, Any]] = []
    found = _CounterExamples(learning, settings)
    here = found.solved(learning.start, None)
    longest = 1.0

    def record(iteration: int, step: float) -> None:
        row = learning_row(learning, here.style, here.target, here.inner)
        row |= {"iteration": iteration, "closeness": 0.0, "gain": SIGMOID_GAIN, "step": step}
        row |= {"accepted": True, "objective": here.objective, "inner_solves": found.solves}
        rows.append(row | {"seconds": perf_counter() - began})
        log(
            f"{iteration:3d} G+D {row['objective']:.1f}, G/E {row['G_over_E_target']:.3f}, "
            f"E {row['E_target']:.0f}, {row['joint_error_deg']:.1f}°, "
            f"α on {row['effective_joints_in_alpha']:.1f} joints, β {step:g}, "
            f"{found.solves} solves, {rows[-1]['seconds']:.0f} s"
        )

    record(0, 0.0)
    for iteration in range(1, settings.iterations + 1):
        step = _stepped(found, here, longest, rows[-1]["objective"])
        if step is None:  # the trials' X_S, and a longer solve, may be lower than the one known
            better = found.solved(here.style, here.point)
            log(f"{iteration:3d} no step lowers G + D; it is {better.objective:.1f} at least")
            if better.objective > here.objective:
                here = better
                step = _stepped(found, here, longest, rows[-1]["objective"])
        if step is None:
            log(f"{iteration:3d} no step lowers G + D: stopped")
            rows[-1]["inner_solves"] = found.solves  # and of the trials that failed
            break
        here, beta = step
        longest = min(1.0, settings.growth * beta)
        record(iteration, beta)
    return learnt(learning, "paper", here.style, here.inner, rows)


class _CounterExamples:
    """All X_S found so far: each bounds min E from above at every θ, so G takes the lowest."""

    def __init__(self, learning: LearningProblem, settings: PaperSettings) -> None:
        self.learning = learning
        self.settings = settings
        self.solves = 0
        self._points: list[Point] = []

    def solved(self, style: Style, near: Point | None) -> _Known:
        """Return a style with its lowest X_S after one more inner solve, cut off early.

        X_T counts as an X_S where none found is lower.

        Parameters
        ----------
        near : the point of a neighbouring X_S to start from; None is X_T.
        """
        settings, learning = self.settings, self.learning
        limit, barrier = settings.inner_iterations, settings.barrier
        if near is None:
            limit, barrier = settings.first_iterations, settings.first_barrier
        inner = inner_solve(
            learning, style, InnerSettings(0.0, SIGMOID_GAIN, limit, 1e-6, barrier), None, near
        )
        self.solves += 1
        target = target_cost(learning, style)
        self._points.append(inner.result.point)
        costs = self._costs(style)
        if len(costs) > settings.kept:
            order = sorted(np.argsort([cost.total for cost in costs])[: settings.kept])
            self._points = [self._points[k] for k in order]
            costs = [costs[k] for k in order]
        lowest = min(range(len(costs)), key=lambda k: costs[k].total)
        cost = costs[lowest] if costs[lowest].total <= target.total else target
        return _Known(style, target, replace(inner, cost=cost), self._points[lowest])

    def frozen(self, style: Style) -> float:
        """Return G̃ + D, eq. (20), of the X_S known: no more than the true G + D."""
        target = target_cost(self.learning, style).total
        lowest = min(cost.total for cost in self._costs(style))
        return target - lowest + soft_constraints(style.preferences)

    def _costs(self, style: Style) -> list[Cost]:
        problem = self.learning.problem(style, gain=SIGMOID_GAIN)
        return [motion_cost(problem, point.controls) for point in self._points]


class _Line:
    """The styles that steps of length β lead to from one style, inside the bounds."""

    def __init__(self, known: _Known, settings: PaperSettings, ranges: Array) -> None:
        style = known.style
        problem = known.inner.problem
        slope = energy_by_style(problem, known.target.values)
        slope = slope - energy_by_style(problem, known.inner.cost.values)
        slope += soft_slopes(style.preferences)
        self._style, self._scaled = style, settings.scaled
        self._low, self._high = _bounds(ranges, settings)
        self._unit = np.ones(SIZE)
        self._way = slope
        if not settings.scaled:
            return
        self._unit = np.concatenate(
            [style.preferences, np.repeat(REFERENCE, JOINTS), SHOE_REFERENCE]
        )
        self._way = self._unit * slope
        vector = style.vector()
        free = np.where(slope > 0, vector > self._low, vector < self._high)
        fastest = float(np.abs(self._way[free]).max(initial=0.0))
        if fastest > 0:
            self._way = self._way * (settings.longest_step / fastest)

    def at(self, beta: float) -> Style:
        vector = self._style.vector()
        moved = vector - beta * self._unit * self._way
        if self._scaled:  # α by its logarithm
            moved[:JOINTS] = vector[:JOINTS] * np.exp(np.clip(-beta * self._way[:JOINTS], -9, 9))
        return self._style.with_vector(np.clip(moved, self._low, self._high))


def _stepped(
    found: _CounterExamples, here: _Known, longest: float, ceiling: float
) -> tuple[_Known, float] | None:
    """Return the style after one step that lowers the true G + D below a ceiling, and its β."""
    settings = found.settings
    line = _Line(here, settings, found.learning.ranges)
    beta = _bracketed(found, line, longest, ceiling)
    for _ in range(settings.trials):
        trial = found.solved(line.at(beta), here.point)
        if trial.told and trial.objective < ceiling:
            return trial, beta
        beta *= 0.25
    return None


def _bracketed(found: _CounterExamples, line: _Line, longest: float, ceiling: float) -> float:
    """Return β of the halving search (A5) on G̃ + D: all motions known are frozen, eq. (20)."""
    beta = longest
    here = found.frozen(line.at(beta))
    while beta > SMALLEST_STEP:
        half = found.frozen(line.at(beta / 2))
        if here <= half and here < ceiling:
            break
        beta, here = beta / 2, half
    return beta


def _bounds(ranges: Array, settings: PaperSettings) -> tuple[Array, Array]:
    """Return bounds of θ (nio.md §9), (147,) each; α is bounded above by D alone."""
    rest_low, rest_high = ranges[JOINT_COORDINATES].T
    none = np.zeros(JOINTS)
    stiff = np.full(JOINTS, LARGEST_STIFFNESS)
    least = settings.least_preference / JOINTS if settings.scaled else LEAST_UNSCALED
    low = np.concatenate([none + least, none, none, none, rest_low, [0, 0]])
    high = np.concatenate(
        [none + np.inf, stiff, stiff, none + LARGEST_DAMPING, rest_high,
         [LARGEST_SHOE_STIFFNESS, LARGEST_SHOE_LENGTH]]
    )  # fmt: skip
    return low, high
