"""A point to start the interior-point method from: contact forces that suit the given motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from motionstyle.spacetime.barrier_problem import BarrierProblem
from motionstyle.spacetime.solver_point import FORCE_UNIT, Point
from motionstyle.spacetime.spacetime_problem import POINTS

Array = NDArray[np.float64]


def starting_point(
    system: BarrierProblem,
    controls: Array,
    coefficients: Array | None,
    barrier: float,
    *,
    near: bool = False,
) -> Point:
    """Return a point whose motion is given; λ is made central, the copies equal the residuals.

    Multipliers are 0 unless the motion is near an optimum: residuals that are large only because
    the start is poor would bend the problem, and the first step be short. With 0 it is Gauss and
    Newton's.

    Parameters
    ----------
    controls : (K, 35). coefficients : λ in N to begin from (F, 32), or None: from the motion.
    barrier : first μ.
    """
    evaluator = system.evaluator
    if coefficients is None:
        coefficients = _first_coefficients(system, controls)
    scaled = _central(system, controls, np.maximum(coefficients / FORCE_UNIT, 1e-2), barrier)
    values = evaluator.values(controls, scaled * FORCE_UNIT)
    slack = np.where(system.active, np.maximum(values.inequalities, 1e-2), 1.0)
    row_dual = np.where(system.active, np.minimum(barrier / slack, system.weight * slack), 0.0)
    share = 1.0 if near else 0.0
    return Point(
        controls=controls,
        coefficients=scaled,
        lift=values.residuals,
        foot_lift=values.foot_residuals,
        multiplier=share * values.residuals,
        foot_multiplier=share * values.foot_residuals,
        elastic=row_dual / system.weight,
        slack=slack,
        dual=np.where(system.bearing, barrier / np.where(system.bearing, scaled, 1.0), 0.0),
        row_dual=row_dual,
    )


def _central(system: BarrierProblem, controls: Array, coefficients: Array, barrier: float) -> Array:
    """Return the λ/100 N that suit a motion best at this barrier: convex, frame by frame."""
    evaluator = system.evaluator
    values = evaluator.values(controls, np.zeros_like(coefficients))
    columns = FORCE_UNIT * evaluator.slopes(values).by_coefficients
    inner = np.swapaxes(columns, 1, 2) @ columns
    index = np.arange(4 * POINTS)
    inner[:, index, index] += np.where(system.bearing, system.force_weight, 1.0)
    pull = np.einsum("fru,fr->fu", columns, values.residuals)
    found = np.where(system.bearing, coefficients, 1.0)
    dual = np.where(system.bearing, barrier / found, 0.0)
    for _ in range(60):
        gradient = np.einsum("fuv,fv->fu", inner, np.where(system.bearing, found, 0.0)) + pull
        left = np.where(system.bearing, gradient - barrier / found, 0.0)
        matrix = inner.copy()
        matrix[:, index, index] += np.where(system.bearing, dual / found, 0.0)
        step = np.linalg.solve(matrix, -left[..., None])[..., 0]
        dual_step = np.where(system.bearing, barrier / found - dual * (1 + step / found), 0.0)
        primal_length, dual_length = (
            np.where(
                system.bearing & (move < 0), 0.99 * value / np.maximum(-move, 1e-300), 1.0
            ).min(axis=1, keepdims=True, initial=1.0)
            for value, move in ((found, step), (dual, dual_step))
        )
        found = found + primal_length * step
        dual = dual + dual_length * dual_step
        if np.abs(np.where(system.bearing, gradient - dual, 0.0)).max() < barrier:
            break
    return np.where(system.bearing, found, 0.0)


def _first_coefficients(system: BarrierProblem, controls: Array) -> Array:
    """Return λ that nearly balances the root, by ridge regression and clipping."""
    empty = np.zeros((system.evaluator.problem.frames, 4 * POINTS))
    values = system.evaluator.values(controls, empty)
    columns = system.evaluator.slopes(values).by_coefficients[:, :6]
    inner = columns @ np.swapaxes(columns, 1, 2)
    size = np.trace(inner, axis1=1, axis2=2)[:, None, None]
    inner = inner + (1e-6 * size + 1e-12) * np.eye(6)
    pull = np.linalg.solve(inner, -values.residuals[:, :6, None])
    return (np.swapaxes(columns, 1, 2) @ pull)[..., 0]
