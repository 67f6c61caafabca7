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
from motionstyle.spacetime.diagnosis import Outcome, checked_solve
from motionstyle.spacetime.edits import edit_shoes
from motionstyle.spacetime.outcome import outcome_of
from motionstyle.spacetime.solver_point import InteriorPointResult, SolverSettings
from motionstyle.spacetime.spacetime_problem import (
    SpacetimeProblem,
    SpacetimeSettings,
)
from motionstyle.spacetime.splines import SplineBasis
from motionstyle.spacetime.style import Style, initial_style
from motionstyle.spacetime.synthesis_plan import Plan
from motionstyle.spacetime.synthesis_sheet import SynthesisRow

Array = NDArray[np.float64]

# k_shoe (N/m) and h̄ (m) of initial styles: a soft heel (biomechanics.md §6), since the physics fit
# knows no shoes.
USUAL_SHOES = (1e4, 0.01)
OTHER_BODY = 0.2  # share by which a style's body mass may differ from that of the body it moves


def style_warning(style: Style, motion: Motion) -> str:
    """Return a sentence if a style was made for a body of quite another mass, or an empty text.

    Springs and preferences are absolute numbers, so that those of a heavy body make a light one
    stiff. A warning, no refusal: styles of other bodies are tried on purpose. A style that does not
    say what body it was made for is not held against any.
    """
    made_for, mass = style.about.get("body_mass_kg"), motion.body.mass
    if not isinstance(made_for, (int, float)) or isinstance(made_for, bool) or not made_for > 0:
        return ""
    if abs(made_for / mass - 1) <= OTHER_BODY:
        return ""
    return (
        f"style of {style.about.get('clip', 'another clip')} was made for a body of "
        f"{made_for:.3g} kg, {motion.provenance.get('example', motion.id)} has {mass:.3g} kg; "
        "scale its springs and damping, or take a style of a body like this one"
    )


@dataclass(frozen=True)
class Synthesis:
    """A motion of kind `nio` and how it was found.

    motion : None if the solver broke down. report : columns of `tables/syntheses.csv` that the
    solver knows. trace : one record per iteration. diagnosis : see `spacetime.diagnosis`.
    """

    motion: Motion | None
    report: dict[str, Any]
    trace: list[dict[str, float]]
    diagnosis: dict[str, Any]


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

    def run() -> Outcome[InteriorPointResult]:
        return outcome_of(problem, solve_spacetime(problem, controls, settings=settings, log=log))

    result, record, diagnosis = checked_solve(run, log)
    report = {k: v for k, v in asdict(record).items() if k != "violations"}
    report["style_warning"] = style_warning(style, plan.example)
    if report["style_warning"]:
        log(f"warning: {report['style_warning']}")
    if result is None:
        return Synthesis(None, report, [], diagnosis)
    values = result.values
    root = float((values.residuals[:, :6] ** 2).sum())
    report |= {
        "E": values.energy,
        "root_share_of_E_pct": 100 * root / values.energy if values.energy > 0 else 0.0,
        "cone_excess_n": plan.feet.cone_excess(values.forces),  # shoes apart
    }
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
            "solver_status": record.status,
        },
    )
    return Synthesis(motion, report, [asdict(t) for t in result.trace], diagnosis)
