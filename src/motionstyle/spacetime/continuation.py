"""Solve a spacetime problem for springs as steep as the paper's, by way of gentler ones.

The springs' sigmoid (7) of gain 500/rad puts a kink at every rest angle, over which Newton's
method stumbles. Problems with gains of 20, 60 and 200 come first, each from the last one's
optimum and not solved to the end; only the last, at the problem's own gain, decides the status.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.spacetime.interior_point import (
    FORCE_UNIT,
    InteriorPoint,
    InteriorPointResult,
    SolverSettings,
)
from motionstyle.spacetime.spacetime_problem import Evaluator, SpacetimeProblem

Array = NDArray[np.float64]
GAINS = (20.0, 60.0, 200.0)
STAGE_TOLERANCE = 1e-3  # of the stages before the last
STAGE_ITERATIONS = 120
WARM_BARRIER = 1e-4
BARRIER_SHARE, LARGEST_BARRIER = 1e-5, 10.0  # of E at the start: poor starts need more barrier


def solve_spacetime(
    problem: SpacetimeProblem,
    controls: Array,
    coefficients: Array | None = None,
    settings: SolverSettings | None = None,
    *,
    warm: bool = False,
    log: Callable[[str], None] | None = None,
) -> InteriorPointResult:
    """Return the optimum reached from control points (K, 35), through all gains.

    Parameters
    ----------
    coefficients : λ in N (F, 32), or None to find them from the motion.
    warm : start at the problem's own gain with little barrier, as from a neighbouring optimum.

    Iterations, seconds and trace are those of all stages together.
    """
    settings = settings or SolverSettings()
    own = problem.settings.sigmoid_gain
    gains = [] if warm else [gain for gain in GAINS if gain < own]
    trace, iterations, seconds = [], 0, 0.0
    barrier = WARM_BARRIER if warm else _first_barrier(problem, controls, coefficients, settings)
    for gain in [*gains, own]:
        last = gain == own
        stage = replace(problem, settings=replace(problem.settings, sigmoid_gain=gain))
        limits = settings if last else replace(
            settings,
            tolerance=max(settings.tolerance, STAGE_TOLERANCE),
            iterations=min(settings.iterations, STAGE_ITERATIONS),
        )  # fmt: skip
        solver = InteriorPoint(
            Evaluator(stage),
            replace(limits, barrier=barrier, seconds=max(0.0, settings.seconds - seconds)),
        )
        if log:
            log(f"sigmoid gain {gain:g}/rad")
        result = solver.solve(solver.start(controls, coefficients), log)
        trace += [
            replace(t, iteration=len(trace) + k, seconds=seconds + t.seconds)
            for k, t in enumerate(result.trace)
        ]
        iterations += result.iterations
        seconds += result.seconds
        if result.status == "not a number" or seconds >= settings.seconds:
            break
        controls, coefficients = result.point.controls, result.point.coefficients * FORCE_UNIT
        barrier = WARM_BARRIER
    return replace(result, iterations=iterations, seconds=seconds, trace=trace)


def _first_barrier(
    problem: SpacetimeProblem,
    controls: Array,
    coefficients: Array | None,
    settings: SolverSettings,
) -> float:
    """Return μ to start with: little for a start of little energy."""
    evaluator = Evaluator(problem)
    start = InteriorPoint(evaluator, settings).start(controls, coefficients)
    energy = evaluator.values(start.controls, start.coefficients * FORCE_UNIT).energy
    wanted = BARRIER_SHARE * energy if np.isfinite(energy) else settings.barrier
    return float(np.clip(wanted, settings.barrier, max(settings.barrier, LARGEST_BARRIER)))
