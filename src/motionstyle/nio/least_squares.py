"""The alternative the paper rejects: least squares on the motion itself, eq. (24), App. B.

‖X_T − argmin_X E(X; θ)‖² is minimised over scaled θ without derivatives (Powell's method), with a
budget of inner solves. Inner solves are the paper's, cut off early.
"""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from motionstyle.dynamics.passive import SIGMOID_GAIN
from motionstyle.nio.inner import (
    Inner,
    InnerSettings,
    Learnt,
    inner_solve,
    learning_row,
    learnt,
)
from motionstyle.nio.learning_problem import LearningProblem, target_cost
from motionstyle.nio.paper import PaperSettings
from motionstyle.nio.style_space import StyleSpace
from motionstyle.spacetime.style import Style

Array = NDArray[np.float64]
PREFERENCE_BOUNDS = (0.1, 10.0)  # of 29 α


class _SpentError(Exception):
    """The budget is spent."""


def learn_by_least_squares(
    learning: LearningProblem,
    settings: PaperSettings,
    budget: int,
    log: Callable[[str], None] = print,
) -> Learnt:
    """Return the best style of a number of inner solves; rows are the solves."""
    space = StyleSpace.of(learning.ranges, *PREFERENCE_BOUNDS)
    origin = space.coordinates(learning.start)
    low, high = (origin + room for room in space.room(origin))
    inner_settings = InnerSettings(
        0.0, SIGMOID_GAIN, settings.inner_iterations, 1e-6, settings.first_barrier
    )
    began = perf_counter()
    rows: list[dict[str, Any]] = []
    best: tuple[float, Style, Inner | None] = (np.inf, learning.start, None)

    def error(y: Array) -> float:
        nonlocal best
        if len(rows) >= budget:
            raise _SpentError
        style = space.style(np.clip(y, low, high), learning.start)
        inner = inner_solve(learning, style, inner_settings, learning.controls)
        row = learning_row(learning, style, target_cost(learning, style), inner)
        found = row["joint_error_deg"] ** 2
        better = found < best[0]
        if better:
            best = (found, style, inner)
        row |= {"iteration": len(rows), "closeness": 0.0, "gain": SIGMOID_GAIN}
        row |= {"accepted": bool(better), "objective": found, "inner_solves": len(rows) + 1}
        rows.append(row | {"seconds": perf_counter() - began})
        log(f"{len(rows):3d} {row['joint_error_deg']:.2f}°, best {np.sqrt(best[0]):.2f}°")
        return float(found)

    try:
        minimize(error, origin, method="Powell", bounds=list(zip(low, high, strict=True)))
    except _SpentError:
        log(f"{budget} inner solves: budget spent")
    if best[2] is None:
        return Learnt(best[1], rows)
    return learnt(learning, "least_squares", best[1], best[2], rows)
