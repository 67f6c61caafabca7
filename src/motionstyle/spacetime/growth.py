"""How the solver's seconds and memory grow with the frames, and what a warm re-solve costs."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.spacetime.continuation import solve_spacetime
from motionstyle.spacetime.solver_point import SolverSettings
from motionstyle.spacetime.spacetime_problem import SpacetimeProblem

Array = NDArray[np.float64]
MEMORY_ITERATIONS = 3  # the most memory is in use in every iteration alike
CHANGE = 0.01  # of springs, for the warm re-solve
COLUMNS = (
    *("frames", "unknowns", "status", "optimality", "iterations", "seconds", "ms_per_iteration"),
    *("peak_memory_mb", "warm_status", "warm_iterations", "warm_seconds"),
)


def growth_row(
    problem: SpacetimeProblem,
    controls: Array,
    settings: SolverSettings | None = None,
    log: Callable[[str], None] = print,
) -> dict[str, Any]:
    """Return one row of measurements, `COLUMNS`, of a problem solved from control points (K, 35).

    The warm re-solve starts from the whole point of the first, for springs stiffer by a hundredth.
    Memory is what arrays take at most, traced in a few iterations of their own.
    """
    settings = settings or SolverSettings()
    result = solve_spacetime(problem, controls, settings=settings)
    log(f"{problem.frames} frames: {result.status} in {result.iterations} iterations")
    stiffer = replace(
        problem.style.passive,
        stiffness_above=(1 + CHANGE) * problem.style.passive.stiffness_above,
        stiffness_below=(1 + CHANGE) * problem.style.passive.stiffness_below,
    )
    near = replace(problem, style=replace(problem.style, passive=stiffer))
    warm = solve_spacetime(near, result.point.controls, settings=settings, start_point=result.point)
    return {
        "frames": problem.frames,
        "unknowns": result.point.controls.size + int(problem.feet.held.sum()) * 4,
        "status": result.status,
        "optimality": result.optimality,
        "iterations": result.iterations,
        "seconds": result.seconds,
        "ms_per_iteration": 1000 * result.seconds / max(1, result.iterations),
        "peak_memory_mb": _peak_memory_mb(problem, controls),
        "warm_status": warm.status,
        "warm_iterations": warm.iterations,
        "warm_seconds": warm.seconds,
    }


def _peak_memory_mb(problem: SpacetimeProblem, controls: Array) -> float:
    tracemalloc.start()
    try:
        solve_spacetime(problem, controls, settings=SolverSettings(iterations=MEMORY_ITERATIONS))
        return tracemalloc.get_traced_memory()[1] / 2**20
    finally:
        tracemalloc.stop()


def growth_exponent(rows: list[dict[str, Any]], column: str = "ms_per_iteration") -> float:
    """Return p of column ∝ framesᵖ, by least squares in logarithms; 1 is linear."""
    frames = np.log([float(row["frames"]) for row in rows])
    return float(np.polyfit(frames, np.log([float(row[column]) for row in rows]), 1)[0])
