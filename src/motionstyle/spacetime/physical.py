"""The physical level: a motion near its markers that obeys Newton (Liu et al. 2005, eq. (23)).

Unknowns are the control points of cubic B-splines and the shoes. Minimised are the distance to
markers, slip and sinking of the feet, excess over joint ranges, and, lightly, joint torques and
departures from how weight passes between feet, which settle what Newton leaves open; the root
residual of eq. (11) is driven to zero by an augmented Lagrangian, and contact forces are
eliminated frame by frame. Damped Gauss–Newton on banded normal equations.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.layout import CONTACT_POINTS, COORDINATES
from motionstyle.dynamics.codegen import FrameFunction
from motionstyle.dynamics.inverse import GRAVITY
from motionstyle.dynamics.passive import initial_passive, passive_forces
from motionstyle.motion.markers import MarkerPaths
from motionstyle.motion.motion import Motion
from motionstyle.motion.resample import resample
from motionstyle.spacetime.diagnosis import Constraint, Outcome, checked_solve
from motionstyle.spacetime.physical_problem import (
    COUNT,
    PhysicalSettings,
    Problem,
    set_up,
)
from motionstyle.spacetime.physical_step import (
    State,
    Variables,
    evaluate,
    force_costs,
    kinematic,
    kinematic_costs,
    step,
)

Array = NDArray[np.float64]
ROOT_WEIGHT = 100.0  # w_r of eq. (13)
FEWEST_STUCK = 3  # rounds without any step that lowers the cost, before giving up
ROOT_ROWS = tuple(f"root {kind} {axis}" for kind in ("force", "moment") for axis in "xyz")
# Up to which a violation is fine, for the diagnosis.
SLIP_LIMIT_M, SINK_LIMIT_M, RANGE_LIMIT_RAD = 0.01, 0.005, 0.02


@dataclass(frozen=True)
class PhysicalFit:
    """A physical motion and how well it obeys.

    motion : None if the solver broke down. report : the columns of
    `evaluation.physical.PHYSICAL_COLUMNS` but for the configuration. diagnosis : see
    `spacetime.diagnosis`.
    """

    motion: Motion | None
    report: dict[str, Any]
    diagnosis: dict[str, Any]


def prepare(motion: Motion, config: Mapping[str, float]) -> Motion:
    """Return the motion at the fit's rate, cut to its middle `longest_s` seconds.

    Where it is cut, `provenance["cut_start_s"]` tells the time of the new first frame.
    """
    slow = resample(motion, config["rate_hz"])
    extra = slow.frames - round(config["longest_s"] * config["rate_hz"])
    if extra <= 0:
        return slow
    first = extra // 2
    cut = slow.window(first, slow.frames - 1 - (extra - first))
    return replace(cut, provenance={**cut.provenance, "cut_start_s": first / slow.rate_hz})


def prepare_markers(markers: MarkerPaths | None, motion: Motion) -> MarkerPaths | None:
    """Return measured markers at the frames of a prepared motion."""
    if markers is None:
        return None
    return markers.at(motion.rate_hz, motion.provenance.get("cut_start_s", 0.0), motion.frames)


def fit_physical(
    motion: Motion,
    functions: dict[str, FrameFunction],
    settings: PhysicalSettings,
    log: Callable[[str], None] = print,
    *,
    markers: MarkerPaths | None = None,
) -> PhysicalFit:
    """Return the physical motion nearest to a kinematic one, or to measured markers.

    Parameters
    ----------
    motion : kinematic, at the rate that is to be fitted (30 Hz as in the paper).
    functions : from `dynamics.codegen.load_functions`.
    markers : measured, at the motion's frames; without, points on the kinematic body.

    Raises
    ------
    MotionStyleError
        If the motion is too short for splines, or markers do not cover it.
    """
    problem = set_up(motion, functions, settings, markers)
    kind = "virtual" if markers is None else "measured"
    found, record, diagnosis = checked_solve(lambda: _solve(problem, log), log)
    report: dict[str, Any] = {
        "markers": kind,
        "frames": motion.frames,
        "rate_hz": motion.rate_hz,
        "mass_kg": motion.body.mass,
        "mass_source": motion.body.mass_source,
        "dataset": str(motion.provenance.get("dataset", "")),
        "action": str(motion.provenance.get("action", "")),
        "surface": str(motion.provenance.get("surface", "")),
        **{k: v for k, v in asdict(record).items() if k != "violations"},
    }
    if found is None:
        return PhysicalFit(None, report, diagnosis)
    variables, state = found
    shoes = variables.shoes
    provenance = {**motion.provenance, "level": "physical", "example": motion.id}
    if shoes is not None:
        provenance["shoes"] = asdict(shoes)
        report |= {"shoe_stiffness_npm": shoes.stiffness, "shoe_rest_mm": 1000 * shoes.rest_length}
    fitted = replace(
        motion,
        id=f"{motion.id}_physical",
        coordinates=state.coordinates,
        contact_forces=state.contact_forces + state.shoe_forces,
        provenance=provenance,
    )
    return PhysicalFit(fitted, {**report, **_measures(problem, state)}, diagnosis)


def _solve(problem: Problem, log: Callable[[str], None]) -> Outcome[tuple[Variables, State]]:
    """Run the multiplier method from the kinematic motion."""
    settings = problem.settings
    variables = Variables(problem.basis.fit(problem.motion.coordinates), problem.shoes)
    state = evaluate(problem, variables)
    damping, iterations, promised, stuck = 1e-3, 0, np.inf, 0
    for outer in range(settings.outer):
        before = state
        for _ in range(settings.inner):
            iterations += 1
            taken = step(problem, variables, state, damping)
            fall = (state.cost - taken.state.cost) / problem.motion.frames
            promised = taken.promised / max(state.cost, 1e-12)
            variables, state, damping = taken.variables, taken.state, taken.damping
            if fall < settings.tolerance:
                break
        rms = _rms(state.root[:, :3])
        log(f"outer {outer}: cost {state.cost:.4f}, root force {rms:.3f} N rms")
        stuck = stuck + 1 if state is before else 0
        if rms < settings.root_goal_n or stuck == FEWEST_STUCK:
            break
        tighter = max(problem.root_n * settings.root_shrink, settings.root_least_n)
        multiplier = (problem.shift + state.root) / problem.root_n**2
        problem.root_n, problem.shift = tighter, multiplier * tighter**2
        state = evaluate(problem, variables)
        damping = min(damping, 1.0)
    converged = _rms(state.root[:, :3]) < settings.root_goal_n
    shown = kinematic(problem, state.coordinates)
    terms = {**kinematic_costs(problem, state.coordinates, shown), **force_costs(problem, state)}
    message = "" if converged else f"root force {_rms(state.root[:, :3]):.2f} N rms, not settled"
    return Outcome(
        value=(variables, state),
        converged=converged,
        message=message,
        iterations=iterations,
        optimality=float(promised),
        constraints=_constraints(problem, state),
        at_bounds=_at_bounds(problem, state),
        terms=terms,
    )


def _rms(vectors: Array) -> float:
    """Return the root mean square length of vectors (F, n)."""
    return float(np.sqrt((vectors**2).sum(axis=1).mean()))


def _constraints(problem: Problem, state: State) -> tuple[Constraint, ...]:
    goal = problem.settings.root_goal_n
    shown = kinematic(problem, state.coordinates)
    hold = (problem.ground.hold > 0)[..., None]
    slip = np.linalg.norm((shown.held * hold)[..., [0, 2]], axis=-1)
    return (
        Constraint("root force", "N", goal, ROOT_ROWS[:3], np.abs(state.root[:, :3])),
        Constraint("root moment", "N·m", goal, ROOT_ROWS[3:], np.abs(state.root[:, 3:])),
        Constraint("slip", "m", SLIP_LIMIT_M, CONTACT_POINTS, slip),
        Constraint("sinking", "m", SINK_LIMIT_M, CONTACT_POINTS, -shown.sunken),
        Constraint("joint range", "rad", RANGE_LIMIT_RAD, COORDINATES, np.abs(shown.excess)),
    )


def _at_bounds(problem: Problem, state: State) -> dict[str, int]:
    """Count frames in which a coordinate is beyond its range, or a bearing point bears nothing."""
    shown = kinematic(problem, state.coordinates)
    beyond = (shown.excess != 0).sum(axis=0)
    idle = problem.bearing & (state.contact_forces == 0).all(axis=-1)
    counts = {f"range of {n}": int(k) for n, k in zip(COORDINATES, beyond, strict=True)}
    names = zip(CONTACT_POINTS, idle.sum(axis=0), strict=True)
    return counts | {f"no force at {n}": int(k) for n, k in names}


def _root_share(state: State) -> float:
    """Return the root's share of E, eq. (13), at the initial style: α = 1/29, springs of (22)."""
    joints = slice(6, COUNT)
    angles, rates, torques = state.coordinates[:, joints], state.rates[:, joints], state.torques
    passive = passive_forces(initial_passive(angles, rates, torques), angles, rates)
    muscles = ((torques - passive) ** 2).sum() / torques.shape[1]
    root = ROOT_WEIGHT * (state.root**2).sum()
    return float(root / (root + muscles))


def _measures(problem: Problem, state: State) -> dict[str, float]:
    """Return how near its markers a motion is and how well it obeys."""
    motion = problem.motion
    weight = motion.body.mass * GRAVITY
    shown = kinematic(problem, state.coordinates)
    handles = problem.handles
    away = shown.misses + handles.targets - handles.measured
    distance = np.linalg.norm(away, axis=-1)[handles.seen]
    held = problem.ground.hold > 0
    slip = np.linalg.norm(shown.held[..., [0, 2]], axis=-1)[held]
    vertical = (state.contact_forces + state.shoe_forces)[..., 1].sum(axis=1)
    force = _rms(state.root[:, :3])
    return {
        "marker_rms_cm": 100 * float(np.sqrt((distance**2).mean())),
        "root_force_rms_n": force,
        "root_moment_rms_nm": _rms(state.root[:, 3:]),
        "root_force_rms_pctbw": 100 * force / weight,
        "root_share_of_E_pct": 100 * _root_share(state),
        "foot_slip_mm": 1000 * float(np.sqrt((slip**2).mean())) if len(slip) else 0.0,
        "penetration_mm": 1000 * float(-shown.sunken.min()),
        "range_excess_deg": float(np.degrees(np.abs(shown.excess).max())),
        "vertical_mean_bw": float(vertical.mean()) / weight,
        "vertical_peak_bw": float(vertical.max()) / weight,
    }
