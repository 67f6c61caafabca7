"""What the solver minimises, at a given motion: its contact forces, and its cost by term."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from motionstyle.spacetime.forces import eliminate_forces
from motionstyle.spacetime.spacetime_problem import Evaluator, Values

Array = NDArray[np.float64]


def best_coefficients(evaluator: Evaluator, controls: Array) -> Array:
    """Return the λ ≥ 0 (N, (F, 32)) of least objective for control points (K, 35), exactly.

    λ is a nuisance of a given motion: E(X_T) means its least value over λ. Convex, frame by frame.
    """
    problem = evaluator.problem
    values = evaluator.values(controls, np.zeros((problem.frames, evaluator.bearing.shape[1])))
    columns = evaluator.slopes(values).by_coefficients
    ridge = np.full(evaluator.bearing.shape, problem.settings.force_weight)
    found = eliminate_forces(values.residuals, columns, problem.feet.held, ridge)
    return found.coefficients


def objective_terms(evaluator: Evaluator, values: Values, coefficients: Array) -> dict[str, float]:
    """Return the terms whose sum the solver halves and minimises, but for its barrier.

    `muscles` and `root` make E of eq. (13); `ranges` and `clearance` are ρ·(excess)².
    """
    short = np.where(evaluator.row_active, np.minimum(values.inequalities, 0.0), 0.0)
    elastic = evaluator.row_weight * short**2
    split = 2 * len(evaluator.limited)
    return {
        "muscles": float((values.residuals[:, 6:] ** 2).sum()),
        "root": float((values.residuals[:, :6] ** 2).sum()),
        "feet": float((values.foot_residuals**2).sum()),
        "contact forces": evaluator.problem.settings.force_weight * float((coefficients**2).sum()),
        "ranges": float(elastic[:, :split].sum()),
        "clearance": float(elastic[:, split:].sum()),
    }
