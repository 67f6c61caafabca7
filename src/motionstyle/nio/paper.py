"""The paper's learner: gradient steps on G with a halving line search (nio.md A4, A5).

As printed but for what cannot be meant: each unknown is scaled by its usual size (A5, defect iii;
`scaled = False` keeps the printed units as a reference), θ stays in its bounds, the line search
brackets with G̃ of the frozen X_S (eq. 20) and is accepted only if the true G + D falls (defects
i, ii). Inner solves start from X_T and are cut off early, as the authors' were.
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
from motionstyle.spacetime.style import Style

Array = NDArray[np.float64]

LEAST_PREFERENCE = 1e-5  # α below 0 makes E unbounded (nio.md §10)
SUM_WEIGHT = 1e4  # w of eq. (18)
REFERENCE = (1 / 29, 100.0, 100.0, 5.0, 0.5)  # of α, k_s1, k_s2, k_d, q̄ (nio.md A5)
SHOE_REFERENCE = (1e3, 5e-4)  # 2e4, 0.02 would leave room for no other unknown's step
SMALLEST_STEP = 1e-6


@dataclass(frozen=True)
class PaperSettings:
    """Settings of the paper's learner.

    iterations : of the main loop, 50 in the paper. inner_iterations : after which an inner solve
    is cut off. scaled : whether unknowns are scaled by their usual size. trials : how many step
    lengths, each a quarter of the last, are verified by a true G before learning stops. After the
    first step none longer than `growth` times the last accepted one is tried.
    """

    iterations: int = 50
    inner_iterations: int = 40
    scaled: bool = True
    trials: int = 10
    growth: float = 16.0
    barrier: float = 1e-2


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
    unit = _units(settings.scaled)
    low, high = _bounds(learning.ranges)
    style = learning.start
    rows: list[dict[str, Any]] = []
    inner, target = _solved(learning, style, settings)
    solves, longest = 1, 1.0

    def record(iteration: int, step: float, accepted: bool) -> None:
        row = learning_row(learning, style, target, inner)
        row |= {"iteration": iteration, "closeness": 0.0, "gain": SIGMOID_GAIN, "step": step}
        row |= {"accepted": accepted, "objective": _objective(style, target, inner)}
        rows.append(row | {"inner_solves": solves, "seconds": perf_counter() - began})
        log(
            f"{iteration:3d} G+D {row['objective']:.1f}, G/E {row['G_over_E_target']:.3f}, "
            f"E {row['E_target']:.0f}, {row['joint_error_deg']:.1f}°, β {step:g}, "
            f"{rows[-1]['seconds']:.0f} s"
        )

    record(0, 0.0, True)
    for iteration in range(1, settings.iterations + 1):
        slope = energy_by_style(inner.problem, target.values)
        slope = slope - energy_by_style(inner.problem, inner.cost.values)
        slope += soft_slopes(style.preferences)
        found = None
        beta = min(longest, _bracketed(learning, style, inner, unit**2 * slope, (low, high)))
        for _ in range(settings.trials):
            moved = _moved(style, beta, unit**2 * slope, low, high)
            trial, trial_target = _solved(learning, moved, settings)
            solves += 1
            if _objective(moved, trial_target, trial) < rows[-1]["objective"]:
                found = (moved, trial, trial_target)
                break
            beta *= 0.25
        if found is None:
            log(f"{iteration:3d} no step lowers G + D: stopped")
            rows[-1]["inner_solves"] = solves  # and of the trials that failed
            break
        style, inner, target = found
        longest = settings.growth * beta
        record(iteration, beta, True)
    return learnt(learning, "paper", style, inner, rows)


def _units(scaled: bool) -> Array:
    if not scaled:
        return np.ones(SIZE)
    return np.concatenate([np.repeat(REFERENCE, JOINTS), SHOE_REFERENCE])


def _bounds(ranges: Array) -> tuple[Array, Array]:
    """Return bounds of θ (nio.md §9), (147,) each; α is bounded above by nothing."""
    rest_low, rest_high = ranges[JOINT_COORDINATES].T
    none = np.zeros(JOINTS)
    stiff = np.full(JOINTS, LARGEST_STIFFNESS)
    low = np.concatenate([none + LEAST_PREFERENCE, none, none, none, rest_low, [0, 0]])
    high = np.concatenate(
        [none + np.inf, stiff, stiff, none + LARGEST_DAMPING, rest_high,
         [LARGEST_SHOE_STIFFNESS, LARGEST_SHOE_LENGTH]]
    )  # fmt: skip
    return low, high


def _solved(learning: LearningProblem, style: Style, settings: PaperSettings) -> tuple[Inner, Cost]:
    """Return a truncated X_S, X_T itself where it is no better, and E(X_T)."""
    inner = inner_solve(
        learning,
        style,
        InnerSettings(0.0, SIGMOID_GAIN, settings.inner_iterations, 1e-6, settings.barrier),
        learning.controls,
    )
    target = target_cost(learning, style)
    settled = motion_cost(inner.problem, inner.result.point.controls)
    if settled.total < inner.cost.total:  # cut off early, λ lags behind the motion
        inner = replace(inner, cost=settled)
    if not inner.cost.total <= target.total:
        inner = replace(inner, cost=target)
    return inner, target


def _objective(style: Style, target: Cost, inner: Inner) -> float:
    return target.total - inner.cost.total + soft_constraints(style.preferences)


def _moved(style: Style, beta: float, way: Array, low: Array, high: Array) -> Style:
    return style.with_vector(np.clip(style.vector() - beta * way, low, high))


def _bracketed(
    learning: LearningProblem,
    style: Style,
    inner: Inner,
    way: Array,
    bounds: tuple[Array, Array],
) -> float:
    """Return β of the halving search (A5) on G̃ + D: both motions frozen, eq. (20)."""

    def frozen(beta: float) -> float:
        moved = _moved(style, beta, way, *bounds)
        problem = replace(inner.problem, style=moved)
        at_target = target_cost(learning, moved)
        at_synth = motion_cost(problem, inner.result.point.controls)
        return at_target.total - at_synth.total + soft_constraints(moved.preferences)

    beta = 1.0
    here = frozen(beta)
    while beta > SMALLEST_STEP:
        half = frozen(beta / 2)
        if here <= half:
            break
        beta, here = beta / 2, half
    return beta
