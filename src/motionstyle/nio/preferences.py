"""Preferences alone, without springs and shoes, by cutting planes (nio.md E3).

For a fixed motion E is linear in α, so that min_X E is concave and G convex. Every X_S found is a
counterexample that bounds G from below for all α at once:

    G(α) ≥ Σ_j α_j (s_j(X_T) − s_j(X_i)) + (rest(X_T) − rest(X_i)),   s_j = Σ_t Q_mj².

The next α is least in the highest of these planes, near the best α so far (a proximal bundle
method). The true G is then found by one more inner solve.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from motionstyle.dynamics.passive import SIGMOID_GAIN
from motionstyle.nio.derivatives import JOINTS
from motionstyle.nio.inner import (
    Inner,
    InnerSettings,
    Learnt,
    inner_solve,
    learning_row,
    learnt,
)
from motionstyle.nio.learning_problem import Cost, LearningProblem, target_cost
from motionstyle.spacetime.style import Style

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PreferenceSettings:
    """Settings of the bundle method.

    rounds : inner solves. least, largest : bounds of 29 α. nearness : weight of |29 (α − best)|²,
    as a share of G at the start. iterations, tolerance, barrier : of inner solves.
    """

    rounds: int = 12
    least: float = 0.1
    largest: float = 10.0
    nearness: float = 0.01
    iterations: int = 120
    tolerance: float = 1e-5
    barrier: float = 1e-2


def plane(target: Cost, found: Cost) -> tuple[Array, float]:
    """Return slope (29,) and offset of G's lower bound that one counterexample gives."""
    squares = (target.values.muscle**2).sum(axis=0), (found.values.muscle**2).sum(axis=0)
    rest = (target.total - target.muscle) - (found.total - found.muscle)
    return squares[0] - squares[1], rest


def lowest(
    planes: list[tuple[Array, float]],
    best: Array,
    nearness: float,
    bounds: tuple[float, float],
) -> Array:
    """Return α of sum 1 that is least in the highest plane, near the best one, (29,).

    Parameters
    ----------
    nearness : weight of |29 (α − best)|². bounds : of 29 α.
    """
    slopes = np.array([slope for slope, _ in planes]) / JOINTS
    offsets = np.array([offset for _, offset in planes])
    scale = max(float(np.abs(slopes @ (JOINTS * best) + offsets).max()), 1e-9)
    start = np.append(JOINTS * best, (slopes @ (JOINTS * best) + offsets).max() / scale)

    def objective(x: Array) -> tuple[float, Array]:
        away = x[:-1] - JOINTS * best
        weight = nearness / scale
        return float(x[-1] + weight * (away**2).sum()), np.append(2 * weight * away, 1.0)

    constraints = [
        {
            "type": "ineq",
            "fun": lambda x: x[-1] - (slopes @ x[:-1] + offsets) / scale,
            "jac": lambda x: np.column_stack([-slopes / scale, np.ones(len(slopes))]),
        },
        {
            "type": "eq",
            "fun": lambda x: x[:-1].sum() / JOINTS - 1,
            "jac": lambda x: np.append(np.full(JOINTS, 1 / JOINTS), 0.0),
        },
    ]
    found = minimize(
        objective, start, jac=True, method="SLSQP", constraints=constraints,
        bounds=[bounds] * JOINTS + [(None, None)], options={"maxiter": 300, "ftol": 1e-10},
    )  # fmt: skip
    wanted = np.clip(found.x[:-1], *bounds)
    return wanted / wanted.sum()


def learn_preferences(
    learning: LearningProblem,
    settings: PreferenceSettings | None = None,
    log: Callable[[str], None] = print,
) -> Learnt:
    """Return the style of preferences alone for which X_T is nearest to optimal."""
    settings = settings or PreferenceSettings()
    began = perf_counter()
    empty = np.zeros_like(learning.start.vector())
    empty[:JOINTS] = 1 / JOINTS
    style = learning.start.with_vector(empty)
    rows: list[dict[str, Any]] = []
    planes: list[tuple[Array, float]] = []
    best: tuple[float, Style, Inner] | None = None
    nearness = 0.0
    for k in range(settings.rounds):
        inner = inner_solve(
            learning,
            style,
            InnerSettings(
                0.0, SIGMOID_GAIN, settings.iterations, settings.tolerance, settings.barrier
            ),
            None if best is None else best[2].result.point.controls,
            None if best is None else best[2].result.point,
        )
        target = target_cost(learning, style)
        gap = target.total - inner.cost.total
        usable = np.isfinite(gap) and inner.result.optimality < 1.0
        better = bool(usable and (best is None or gap < best[0]))
        row = learning_row(learning, style, target, inner)
        row |= {"iteration": k, "closeness": 0.0, "gain": SIGMOID_GAIN, "accepted": better}
        rows.append(row | {"objective": gap, "seconds": perf_counter() - began})
        log(f"{k:3d} G {gap:.1f}, {row['joint_error_deg']:.2f}°, {row['status']}")
        if better:
            best = (gap, style, inner)
            nearness = nearness or settings.nearness * abs(gap)
        elif best is not None:
            nearness *= 3.0
        if best is None:
            break
        if np.isfinite(gap):
            planes.append(plane(target, inner.cost))
        vector = style.vector()
        vector[:JOINTS] = lowest(
            planes, best[1].preferences, nearness, (settings.least, settings.largest)
        )
        style = style.with_vector(vector)
    chosen, last = (style, inner) if best is None else (best[1], best[2])
    return learnt(learning, "alpha_only", chosen, last, rows)
