"""Energy along the straight way from the captured motion to the optimum (after Fig. 4).

Between control points, X(s) = X_T + s (X_S − X_T), a little beyond both ends. At every s the
contact coefficients λ are the best ones for that motion (convex, frame by frame, milliseconds), so
that what is drawn is a function of the motion alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from motionstyle.spacetime.objective import best_coefficients, objective_terms
from motionstyle.spacetime.spacetime_problem import Evaluator, SpacetimeProblem

Array = NDArray[np.float64]
BEYOND, STEPS = 0.25, 61


def landscape(problem: SpacetimeProblem, target: Array, optimum: Array) -> dict[str, list[float]]:
    """Return `s` and the terms of the objective there, see `objective_terms`, and their `total`.

    Parameters
    ----------
    target, optimum : control points (K, 35) of X_T (s = 0) and X_S (s = 1).
    """
    evaluator = Evaluator(problem)
    rows = []
    for s in np.linspace(-BEYOND, 1 + BEYOND, STEPS):
        controls = target + s * (optimum - target)
        coefficients = best_coefficients(evaluator, controls)
        terms = objective_terms(evaluator, evaluator.values(controls, coefficients), coefficients)
        rows.append({"s": float(s), **terms, "total": sum(terms.values())})
    return {name: [row[name] for row in rows] for name in rows[0]}
