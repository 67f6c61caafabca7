"""One synthesis from plan to motion: min E(X; θ) subject to the feet, eqs. (13)–(15)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.layout import JOINT_COORDINATES
from motionstyle.dynamics.codegen import FrameFunction
from motionstyle.dynamics.symbols import parameter_vector
from motionstyle.errors import MotionStyleError
from motionstyle.motion.motion import Motion
from motionstyle.spacetime.continuation import solve_spacetime
from motionstyle.spacetime.edits import edit_shoes
from motionstyle.spacetime.foot_constraints import FootConstraints
from motionstyle.spacetime.solver_point import InteriorPointResult, SolverSettings
from motionstyle.spacetime.spacetime_problem import (
    SpacetimeProblem,
    SpacetimeSettings,
    Values,
)
from motionstyle.spacetime.splines import SplineBasis
from motionstyle.spacetime.style import Style, initial_style
from motionstyle.spacetime.synthesis_plan import Plan
from motionstyle.spacetime.synthesis_sheet import SynthesisRow

Array = NDArray[np.float64]

# k_shoe (N/m) and h̄ (m) of initial styles: a soft heel (biomechanics.md §6), since the physics fit
# knows no shoes.
USUAL_SHOES = (1e4, 0.01)


@dataclass(frozen=True)
class Synthesis:
    """A motion of kind `nio` and how it was found.

    report : columns of `tables/syntheses.csv` that the solver knows. trace : one record per
    iteration.
    """

    motion: Motion
    report: dict[str, Any]
    trace: list[dict[str, float]]


def net_torques(
    motion: Motion, functions: Mapping[str, FrameFunction], frames_per_knot: float = 2.0
) -> tuple[Array, Array, Array]:
    """Return q, q̇ of the splines through a motion, and inertia − gravity − contacts, (F, 35) each.

    The last is what muscles, springs and shoes together exert; at the root what nobody does.

    Raises
    ------
    MotionStyleError
        If the motion's contact forces are unknown.
    """
    if motion.contact_forces is None:
        raise MotionStyleError(
            f"motion {motion.id}: no contact forces; a style needs a physical one"
        )
    basis = SplineBasis.uniform(motion.frames, motion.rate_hz, frames_per_knot)
    q, qd, qdd = basis.evaluate(basis.fit(motion.coordinates))
    forces = motion.contact_forces.reshape(motion.frames, -1)
    tau = functions["forces"](q, qd, qdd, forces, parameter_vector(motion.body))[0]
    return q, qd, tau


def initial_style_of(
    motion: Motion, functions: Mapping[str, FrameFunction], *, frames_per_knot: float = 2.0
) -> Style:
    """Return the style that learning starts from (nio.md A3), for a physical motion.

    Raises
    ------
    MotionStyleError
        If the motion's contact forces are unknown.
    """
    q, qd, tau = net_torques(motion, functions, frames_per_knot)
    joints = JOINT_COORDINATES
    style = initial_style(q[:, joints], qd[:, joints], tau[:, joints], USUAL_SHOES)
    about = {"recipe": "initial", "clip": motion.id, "solver_status": "not needed"}
    return replace(style, about={**about, "body_mass_kg": motion.body.mass})


def spacetime_problem(
    row: SynthesisRow,
    plan: Plan,
    style: Style,
    functions: Mapping[str, FrameFunction],
    weights: SpacetimeSettings | None = None,
) -> SpacetimeProblem:
    """Return the problem of a row: its plan, and its style with the row's shoes."""
    shoes = edit_shoes(style.shoe_stiffness, style.shoe_rest_length, row.edits)
    return SpacetimeProblem(
        body=plan.body,
        rate_hz=plan.start.rate_hz,
        feet=plan.feet,
        ranges=plan.ranges,
        style=replace(style, shoe_stiffness=shoes[0], shoe_rest_length=shoes[1]),
        functions=dict(functions),
        settings=weights or SpacetimeSettings(),
    )


def synthesise(
    row: SynthesisRow,
    plan: Plan,
    style: Style,
    functions: Mapping[str, FrameFunction],
    *,
    settings: SolverSettings | None = None,
    weights: SpacetimeSettings | None = None,
    start: Motion | None = None,
    log: Callable[[str], None] = print,
) -> Synthesis:
    """Return the motion of least energy that keeps to the plan's feet, ranges and body.

    Parameters
    ----------
    start : where to start from; the plan's own start (§7 of the paper) by default.

    Whether it converged stands in the report's `status`: a motion that did not is returned for a
    look, not for use.
    """
    problem = spacetime_problem(row, plan, style, functions, weights)
    controls = problem.basis().fit((start or plan.start).coordinates)
    result = solve_spacetime(problem, controls, settings=settings, log=log)
    values = result.values
    motion = replace(
        plan.start,
        id=row.id,
        kind="nio",
        coordinates=values.coordinates,
        contact_forces=values.forces + values.shoe_forces,
        rebranched=(),
        provenance={
            **plan.start.provenance,
            "variant": "synthesised",
            "solver_status": result.status,
        },
    )
    return Synthesis(motion, _report(result, values, plan.feet), [asdict(t) for t in result.trace])


def _report(result: InteriorPointResult, values: Values, feet: FootConstraints) -> dict[str, Any]:
    root = float((values.residuals[:, :6] ** 2).sum())
    return {
        "status": result.status,
        "iterations": result.iterations,
        "seconds": result.seconds,
        "E": values.energy,
        "optimality": result.optimality,
        "root_share_of_E_pct": 100 * root / values.energy if values.energy > 0 else 0.0,
        "cone_excess_n": feet.cone_excess(values.forces),  # shoes apart
    }
