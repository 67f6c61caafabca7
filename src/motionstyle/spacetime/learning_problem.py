"""The problem that a style is learnt on: the captured motion's own feet, ranges and ends.

What is chosen here is the same for E(X_T) and E(X_S); `docs/spacetime.md` lists it, and
`tables/spacetime_sensitivity.csv` says what each choice does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.dynamics.codegen import FrameFunction
from motionstyle.motion.motion import Motion
from motionstyle.spacetime.edits import Edits, edit_ranges
from motionstyle.spacetime.footprint_constraints import FRICTION, captured_constraints
from motionstyle.spacetime.forces import eliminate_forces
from motionstyle.spacetime.spacetime_problem import (
    COUNT,
    Evaluator,
    SpacetimeProblem,
    SpacetimeSettings,
    Values,
)
from motionstyle.spacetime.style import Style

Array = NDArray[np.float64]
DEEP_M = 1e3  # a clearance this far below the ground is none


def learning_problem(
    motion: Motion,
    style: Style,
    functions: Mapping[str, FrameFunction],
    *,
    settings: SpacetimeSettings | None = None,
    keep_ends: int = 0,
    friction: float = FRICTION,
    ranges: bool = True,
    clearance: bool = True,
) -> SpacetimeProblem:
    """Return the problem whose feasible set holds the motion itself.

    Parameters
    ----------
    motion : X_T, physical. style : θ.
    keep_ends : control points at both ends that stay as in X_T.
    ranges, clearance : whether joints keep to their ranges and swinging feet off the ground.
    """
    feet = captured_constraints(motion, friction=friction)
    if not clearance:
        feet = replace(feet, clearance=np.where(feet.held, 0.0, -DEEP_M))
    limits = edit_ranges(motion, Edits())
    if not ranges:
        limits = np.full((COUNT, 2), (-np.inf, np.inf))
    return SpacetimeProblem(
        body=motion.body,
        rate_hz=motion.rate_hz,
        feet=feet,
        ranges=limits,
        style=style,
        functions=dict(functions),
        settings=settings or SpacetimeSettings(),
        keep_ends=keep_ends,
    )


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
