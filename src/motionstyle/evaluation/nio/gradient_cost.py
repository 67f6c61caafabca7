"""What the gradient of G costs: one inner solve against 147 + 1 of them (nio.md E14)."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np

from motionstyle.dynamics.passive import SIGMOID_GAIN
from motionstyle.nio.derivatives import SIZE, energy_by_style
from motionstyle.nio.inner import Inner, InnerSettings, inner_solve
from motionstyle.nio.learning_problem import LearningProblem, cost_of_point, target_cost
from motionstyle.nio.style_space import StyleSpace
from motionstyle.spacetime.continuation import solve_spacetime
from motionstyle.spacetime.style import Style

STEP = 1e-3  # of scaled θ
SOLVE = InnerSettings(0.0, SIGMOID_GAIN, 200, 1e-6, 1e-6)


def gradient_cost(
    learning: LearningProblem,
    style: Style,
    solves: int,
    seed: int = 0,
    log: Callable[[str], None] = print,
) -> list[dict[str, Any]]:
    """Return rows of `tables/figure_checks.csv`: seconds of the gradient, both ways, and its error.

    Of the 147 solves of one-sided differences a random few are timed and count for all; each begins
    at the optimum it differs from, which favours differences.

    Parameters
    ----------
    solves : how many are timed.
    """
    space = StyleSpace.of(learning.ranges, 1e-3, 29.0)
    origin = space.coordinates(style)
    style = space.style(origin, style)
    began = perf_counter()
    problem = learning.problem(style)
    result = solve_spacetime(problem, learning.controls)
    inner = Inner(problem, result, cost_of_point(problem, result.point))
    first_s = perf_counter() - began
    began = perf_counter()
    target = target_cost(learning, style, SOLVE.gain)
    by_style = energy_by_style(inner.problem, target.values)
    by_style -= energy_by_style(inner.problem, inner.cost.values)
    slope = by_style @ space.chain(style)
    gradient_s = perf_counter() - began
    gap = target.total - inner.cost.total
    rng = np.random.default_rng(seed)
    chosen = rng.choice(SIZE, size=min(solves, SIZE), replace=False)
    seconds, differences = [], []
    for k in chosen:
        moved = origin.copy()
        moved[k] += STEP if space.room(origin)[1][k] > STEP else -STEP
        began = perf_counter()
        other = space.style(moved, style)
        found = inner_solve(learning, other, SOLVE, None, inner.result.point)
        there = target_cost(learning, other, SOLVE.gain).total - found.cost.total
        seconds.append(perf_counter() - began)
        differences.append((there - gap) / (moved[k] - origin[k]))
        log(f"{k}: {differences[-1]:.6g} by difference, {slope[k]:.6g} exact, {seconds[-1]:.2f} s")
    worst = np.abs(np.array(differences) - slope[chosen]).max() / np.abs(slope).max()
    differences_s = first_s + SIZE * float(np.median(seconds))
    note = f"{len(chosen)} of {SIZE} differences timed; first solve {inner.result.status}"
    quantities = {
        "inner_solves_ours": (1.0, "inner solves"),
        "inner_solves_differences": (SIZE + 1.0, "inner solves"),
        "gradient_seconds": (gradient_s, "s"),
        "inner_solve_seconds": (first_s, "s"),
        "difference_solve_seconds": (float(np.median(seconds)), "s"),
        "gradient_time_ratio": (differences_s / (first_s + gradient_s), "ratio"),
        "cold_gradient_time_ratio": ((SIZE + 1) * first_s / (first_s + gradient_s), "ratio"),
        "gradient_difference_pct": (100 * float(worst), "% of largest"),
    }
    return [
        {"figure": "nio-E14", "quantity": name, "value": value, "unit": unit, "note": note}
        for name, (value, unit) in quantities.items()
    ]
