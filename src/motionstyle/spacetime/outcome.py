"""What a spacetime solve is held against, by name, joint and frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.layout import CONTACT_POINTS, COORDINATES, JOINT_COORDINATES
from motionstyle.dynamics.inverse import GRAVITY
from motionstyle.spacetime.diagnosis import Constraint, Outcome
from motionstyle.spacetime.solver_point import InteriorPointResult
from motionstyle.spacetime.spacetime_problem import SpacetimeProblem

Array = NDArray[np.float64]
ROOT_ROWS = tuple(f"root {kind} {axis}" for kind in ("force", "moment") for axis in "xyz")
ROOT_LIMIT_BW = 0.01  # of body weight
FOOT_LIMIT_M, RANGE_LIMIT_RAD, CONE_LIMIT_N = 0.005, 0.01, 0.1
AT_BOUND_RAD = 1e-3


def outcome_of(
    problem: SpacetimeProblem, result: InteriorPointResult
) -> Outcome[InteriorPointResult]:
    """Return a result with its constraints, variables at bounds and terms, for `checked_solve`."""
    values, feet, settings = result.values, problem.feet, problem.settings
    misses = np.abs(values.foot_residuals).reshape(problem.frames, -1, 3).max(axis=-1)
    height = ((values.points - feet.ground) * feet.normals).sum(axis=-1) - feet.clearance
    low, high = problem.ranges.T
    angles = values.coordinates
    beyond = np.maximum(np.maximum(low - angles, angles - high), 0.0)[:, JOINT_COORDINATES]
    names = COORDINATES[JOINT_COORDINATES]
    near = np.minimum(angles - low, high - angles)[:, JOINT_COORDINATES] < AT_BOUND_RAD
    weight = ROOT_LIMIT_BW * problem.body.mass * GRAVITY
    misses_m = misses / np.sqrt(settings.foot_weight)
    sunken = np.where(feet.held, 0.0, np.maximum(-height, 0.0))
    return Outcome(
        value=result,
        converged=result.status == "converged",
        message=result.status,
        iterations=result.iterations,
        optimality=result.optimality,
        constraints=(
            Constraint("root residual", "N or N m", weight, ROOT_ROWS, np.abs(values.root)),
            Constraint("held foot point", "m", FOOT_LIMIT_M, CONTACT_POINTS, misses_m),
            Constraint("clearance", "m", FOOT_LIMIT_M, CONTACT_POINTS, sunken),
            Constraint("joint range", "rad", RANGE_LIMIT_RAD, names, beyond),
            Constraint(
                "friction cone",
                "N",
                CONE_LIMIT_N,
                ("all points",),
                np.full((problem.frames, 1), feet.cone_excess(values.forces)),
            ),
        ),
        at_bounds={name: int(count) for name, count in zip(names, near.sum(axis=0), strict=True)},
        terms={
            "muscles": float((values.residuals[:, 6:] ** 2).sum()),
            "root": float((values.residuals[:, :6] ** 2).sum()),
            "feet": float((values.foot_residuals**2).sum()),
            "contact forces": float(settings.force_weight * (result.coefficients**2).sum()),
        },
    )
