"""How a solve grows with the length of the motion, and what a re-solve costs.

A stretch of a walk is repeated to any length: copies of the stretch follow each other on the root's
way, the small difference between its ends spread evenly over it. Such a motion is no capture; it is
made to time a solver on.
"""

from __future__ import annotations

import resource
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from time import perf_counter, process_time
from typing import Any

import numpy as np

from motionstyle.body.rotations import exponential, logarithm, unroll
from motionstyle.dynamics.codegen import FrameFunction
from motionstyle.motion.motion import Motion
from motionstyle.spacetime.continuation import solve_spacetime
from motionstyle.spacetime.edits import Edits, edit_ranges
from motionstyle.spacetime.footprint_constraints import captured_constraints
from motionstyle.spacetime.solver_point import SolverSettings
from motionstyle.spacetime.spacetime_problem import SpacetimeProblem
from motionstyle.spacetime.style import Style

SPRINGS_BY = 1.05  # the small change of θ before a warm re-solve
COLUMNS = (
    *("config", "motion", "frames", "status", "E", "iterations", "seconds", "cpu_seconds"),
    "ms_per_iteration",
    *("ms_per_iteration_and_frame", "growth_exponent", "peak_memory_mb"),
    *("warm_status", "warm_E", "warm_iterations", "warm_seconds", "warm_over_cold"),
    "reason",
)


def repeated(stretch: Motion, frames: int) -> Motion:
    """Return copies of a stretch, end to end, cut to `frames`; without contact forces.

    The last frame of each copy is the first of the next one. Joint angles and root height drift
    evenly over a copy so that they close; the root goes on from where it is, turned with its yaw.
    """
    q = stretch.coordinates
    period = stretch.frames - 1
    drift = q[-1] - q[0]
    drift[[0, 2, 3, 4, 5]] = 0.0
    closed = q - np.linspace(0, 1, stretch.frames)[:, None] * drift
    rotations = exponential(q[:, 3:6])
    turn = _yaw(rotations[-1] @ rotations[0].T)
    places, turned, heading = [], [], 0.0
    at = np.zeros(3)
    for _ in range(-(-frames // period)):
        about = exponential(np.array([0.0, heading, 0.0]))
        way = (closed[:, :3] - closed[0, :3]) * [1, 0, 1]
        places.append((way @ about.T + at)[:-1])
        turned.append((about @ rotations)[:-1])
        at = at + way[-1] @ about.T
        heading += turn
    index = np.arange(frames) % period
    coordinates = closed[index].copy()
    coordinates[:, [0, 2]] = np.concatenate(places)[:frames, [0, 2]] + q[0, [0, 2]]
    coordinates[:, 3:6], _jumps = unroll(logarithm(np.concatenate(turned)[:frames]))
    return replace(
        stretch,
        id=f"{stretch.id}_{frames}",
        coordinates=coordinates,
        contacts=stretch.contacts[index],
        contact_normals=stretch.contact_normals[index],
        contact_forces=None,
        rebranched=(),
    )


def _yaw(rotation: np.ndarray) -> float:
    """Return the turn about the vertical of a rotation, rad."""
    return float(np.arctan2(rotation[0, 2] - rotation[2, 0], rotation[0, 0] + rotation[2, 2]))


def growth_row(
    stretch: Motion,
    style: Style,
    functions: Mapping[str, FrameFunction],
    frames: int,
    iterations: int,
    log: Callable[[str], None] = print,
) -> dict[str, Any]:
    """Return how a solve of so many frames went, and a warm one with springs stiffer by 5 %.

    Parameters
    ----------
    iterations : limit of the stage with the paper's springs.

    Time an iteration is the processor's, which other programs disturb less. Peak memory is that of
    this process, libraries included: measure each length in its own.
    """
    motion = repeated(stretch, frames)
    problem = SpacetimeProblem(
        body=motion.body,
        rate_hz=motion.rate_hz,
        feet=captured_constraints(motion),
        ranges=edit_ranges(motion, Edits()),
        style=style,
        functions=dict(functions),
    )
    controls = problem.basis().fit(motion.coordinates)
    settings = SolverSettings(iterations=iterations)
    began = process_time()
    cold = solve_spacetime(problem, controls, settings=settings, log=log)
    spent = process_time() - began
    p = style.passive
    stiffer = replace(
        p,
        stiffness_above=SPRINGS_BY * p.stiffness_above,
        stiffness_below=SPRINGS_BY * p.stiffness_below,
    )
    other = replace(problem, style=replace(style, passive=stiffer))
    began = perf_counter()
    warm = solve_spacetime(
        other, cold.point.controls, settings=settings, start_point=cold.point, log=log
    )
    again = perf_counter() - began
    per_iteration = 1000 * spent / max(1, cold.iterations)
    return {
        "motion": stretch.id,
        "frames": frames,
        "status": cold.status,
        "E": cold.values.energy,
        "iterations": cold.iterations,
        "seconds": cold.seconds,
        "cpu_seconds": spent,
        "ms_per_iteration": per_iteration,
        "ms_per_iteration_and_frame": per_iteration / frames,
        "peak_memory_mb": peak_memory_mb(),
        "warm_status": warm.status,
        "warm_E": warm.values.energy,
        "warm_iterations": warm.iterations,
        "warm_seconds": again,
        "warm_over_cold": again / cold.seconds,
    }


def with_exponents(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return rows by length; `growth_exponent` p: time an iteration ~ framesᵖ since the last."""
    found: list[dict[str, Any]] = []
    for row in sorted(rows, key=lambda row: row["frames"]):
        made = dict(row)
        last = found[-1] if found else {}
        if "ms_per_iteration" in last and "ms_per_iteration" in row:
            slower = np.log(row["ms_per_iteration"] / last["ms_per_iteration"])
            made["growth_exponent"] = float(slower / np.log(row["frames"] / last["frames"]))
        found.append(made)
    return found


def peak_memory_mb() -> float:
    """Return the most memory this process has held, MB."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1e6 if sys.platform == "darwin" else 1e3)
