"""Solve a spacetime problem by way of gentler ones: softer springs, and a root that may give.

The springs' sigmoid (7) of gain 500/rad puts a kink at every rest angle, and the root's weight
makes the valleys of E narrow; Newton's method stumbles over both. Stages with gains of 20 and 100
and a hundredth of the weight come first, each from where the last one ended, multipliers and all,
and not solved to the end; only the last, the problem itself, decides the status.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.spacetime.interior_point import (
    InteriorPoint,
    InteriorPointResult,
    SolverSettings,
)
from motionstyle.spacetime.solver_point import Point
from motionstyle.spacetime.spacetime_problem import COUNT, Evaluator, SpacetimeProblem

Array = NDArray[np.float64]
WARM_BARRIER = 1e-4
WARM_POINT_BARRIER = 1e-6  # of a start that has all its multipliers


@dataclass(frozen=True)
class Stage:
    """A gentler problem on the way.

    gain : of the springs' sigmoid, 1/rad. root_share : of the root's own weight. barrier : μ to
    begin with. tolerance, iterations : where it ends. pace, whole_steps : see `SolverSettings`.
    """

    gain: float
    root_share: float
    barrier: float
    tolerance: float
    iterations: int
    pace: float = 0.0
    whole_steps: bool = False


STAGES = (
    Stage(20.0, 0.01, 1e-1, 0.1, 120, pace=0.1, whole_steps=True),
    Stage(100.0, 0.01, 1e-3, 0.05, 80, pace=0.02),
)
LAST_BARRIER = 1e-3


def solve_spacetime(
    problem: SpacetimeProblem,
    controls: Array,
    coefficients: Array | None = None,
    settings: SolverSettings | None = None,
    *,
    warm: bool = False,
    start_point: Point | None = None,
    log: Callable[[str], None] | None = None,
) -> InteriorPointResult:
    """Return the optimum reached from control points (K, 35), through all stages.

    Parameters
    ----------
    coefficients : λ in N (F, 32), or None to find them from the motion.
    warm : start with the problem itself and little barrier, as from a neighbouring optimum.
    start_point : the whole point of a neighbouring optimum, `result.point`, to start from instead,
        with its multipliers and even less barrier. Means `warm`.

    Iterations, seconds and trace are those of all stages together.
    """
    settings = settings or SolverSettings()
    own = problem.settings
    warm = warm or start_point is not None
    stages = [] if warm else [stage for stage in STAGES if stage.gain < own.sigmoid_gain]
    last_barrier = WARM_BARRIER if warm else LAST_BARRIER if stages else settings.barrier
    if start_point is not None:
        last_barrier = WARM_POINT_BARRIER
    last = Stage(own.sigmoid_gain, 1.0, last_barrier, settings.tolerance, settings.iterations)
    trace, iterations, seconds = [], 0, 0.0
    point, share = start_point, 1.0
    for stage in [*stages, last]:
        weights = replace(
            own, sigmoid_gain=stage.gain, root_weight=own.root_weight * stage.root_share
        )
        solver = InteriorPoint(
            Evaluator(replace(problem, settings=weights)),
            replace(
                settings,
                tolerance=max(settings.tolerance, stage.tolerance),
                iterations=min(settings.iterations, stage.iterations),
                barrier=stage.barrier,
                pace=stage.pace,
                whole_steps=stage.whole_steps,
                seconds=max(0.0, settings.seconds - seconds),
            ),
        )
        if log:
            log(f"sigmoid gain {stage.gain:g}/rad, root weight {weights.root_weight:g}")
        if point is None:
            point = solver.start(controls, coefficients, near=warm)
        else:
            point = _weighed(point, share / stage.root_share)
        result = solver.solve(point, log)
        trace += [
            replace(t, iteration=len(trace) + k, seconds=seconds + t.seconds)
            for k, t in enumerate(result.trace)
        ]
        iterations += result.iterations
        seconds += result.seconds
        if result.status == "not a number" or seconds >= settings.seconds:
            break
        point, share = result.point, stage.root_share
    return replace(result, iterations=iterations, seconds=seconds, trace=trace)


def _weighed(point: Point, ratio: float) -> Point:
    """Return the point for another weight of the root, old by new; forces of multipliers stay."""
    scale = np.ones(COUNT)
    scale[:6] = np.sqrt(ratio)
    return replace(point, lift=point.lift * scale, multiplier=point.multiplier * scale)
