"""The physical level: a motion near its markers that obeys Newton (Liu et al. 2005, eq. (23)).

Unknowns are the control points of cubic B-splines. Minimised are the distance to virtual markers,
the joint torques (lightly, to share forces between the feet), slip and sinking of the feet, and
excess over joint ranges; the root residual of eq. (11) is driven to zero by an augmented
Lagrangian, and contact forces are eliminated frame by frame. Damped Gauss–Newton on banded
normal equations.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.kinematics import contact_points, forward_kinematics
from motionstyle.dynamics.codegen import FrameFunction
from motionstyle.dynamics.inverse import GRAVITY
from motionstyle.dynamics.passive import initial_passive, passive_forces
from motionstyle.motion.motion import Motion
from motionstyle.motion.resample import resample
from motionstyle.spacetime.physical_problem import (
    COUNT,
    PhysicalSettings,
    Problem,
    State,
    evaluate,
    kinematic_terms,
    set_up,
    step,
)

Array = NDArray[np.float64]
ROOT_WEIGHT = 100.0  # w_r of eq. (13)


@dataclass(frozen=True)
class PhysicalFit:
    """A physical motion and how well it obeys.

    report : the columns of `evaluation.physical.PHYSICAL_COLUMNS` but for the configuration.
    """

    motion: Motion
    report: dict[str, float | int | str]


def settings_from(config: Mapping[str, float]) -> PhysicalSettings:
    """Return settings from the section `physical` of the configuration."""
    names = {field.name for field in fields(PhysicalSettings)}
    return PhysicalSettings(**{k: v for k, v in config.items() if k in names})


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


def fit_physical(
    motion: Motion,
    functions: dict[str, FrameFunction],
    settings: PhysicalSettings,
    log: Callable[[str], None] = print,
) -> PhysicalFit:
    """Return the physical motion nearest to a kinematic one.

    Parameters
    ----------
    motion : kinematic, at the rate that is to be fitted (30 Hz as in the paper).
    functions : from `dynamics.codegen.load_functions`.

    Raises
    ------
    MotionStyleError
        If the motion is too short for splines.
    """
    started = perf_counter()
    problem = set_up(motion, functions, settings)
    controls = problem.basis.fit(motion.coordinates)
    damping, iterations, status = 1e-3, 0, "not converged"
    state = evaluate(problem, controls)
    for outer in range(settings.outer):
        for _ in range(settings.inner):
            iterations += 1
            controls, new, damping = step(problem, controls, state, damping)
            fall = (state.cost - new.cost) / max(state.cost, 1e-12)
            state = new
            if fall < settings.tolerance:
                break
        rms = float(np.sqrt((state.root[:, :3] ** 2).sum(axis=1).mean()))
        log(f"outer {outer}: cost {state.cost:.4f}, root force {rms:.3f} N rms")
        if rms < settings.root_goal_n:
            status = "converged"
            break
        tighter = max(problem.root_n * settings.root_shrink, settings.root_least_n)
        multiplier = (problem.shift + state.root) / problem.root_n**2
        problem.root_n, problem.shift = tighter, multiplier * tighter**2
        state = evaluate(problem, controls)
    seconds = perf_counter() - started
    return _result(problem, state, {"status": status, "iterations": iterations, "seconds": seconds})


def _root_share(problem: Problem, state: State) -> float:
    """Return the root's share of E, eq. (13), at the initial style: α = 1/29, springs of (22)."""
    joints = slice(6, COUNT)
    torques = state.solved.residuals[:, joints] * problem.settings.torque_nm
    angles, rates = state.coordinates[:, joints], state.rates[:, joints]
    passive = passive_forces(initial_passive(angles, rates, torques), angles, rates)
    muscles = ((torques - passive) ** 2).sum() / torques.shape[1]
    root = ROOT_WEIGHT * (state.root**2).sum()
    return float(root / (root + muscles))


def _result(problem: Problem, state: State, solver: dict[str, float | int | str]) -> PhysicalFit:
    motion, q = problem.motion, state.coordinates
    weight = motion.body.mass * GRAVITY
    misses, _foot, _weights, _excess = kinematic_terms(problem, q)
    points = contact_points(motion.body, forward_kinematics(motion.body, q))
    force = float(np.sqrt((state.root[:, :3] ** 2).sum(axis=1).mean()))
    moment = float(np.sqrt((state.root[:, 3:] ** 2).sum(axis=1).mean()))
    bearing = problem.foot_weights[..., 0] > 0
    away = np.linalg.norm((points - problem.feet)[..., [0, 2]], axis=-1)[bearing]
    vertical = state.contact_forces[..., 1].sum(axis=1)
    report: dict[str, float | int | str] = {
        "marker_rms_cm": 100 * float(np.sqrt((misses**2).sum(axis=-1).mean())),
        "root_force_rms_n": force,
        "root_moment_rms_nm": moment,
        "root_force_rms_pctbw": 100 * force / weight,
        "root_share_of_E_pct": 100 * _root_share(problem, state),
        "markers": "virtual",
        "foot_slip_mm": 1000 * float(np.sqrt((away**2).mean())) if len(away) else 0.0,
        "penetration_mm": 1000 * max(0.0, -float(points[..., 1].min())),
        "vertical_mean_bw": float(vertical.mean()) / weight,
        "vertical_peak_bw": float(vertical.max()) / weight,
        "frames": motion.frames,
        "rate_hz": motion.rate_hz,
        "mass_kg": motion.body.mass,
        "mass_source": motion.body.mass_source,
        "dataset": str(motion.provenance.get("dataset", "")),
        "action": str(motion.provenance.get("action", "")),
        **solver,
    }
    provenance = {**motion.provenance, "level": "physical", "example": motion.id}
    fitted = replace(
        motion,
        id=f"{motion.id}_physical",
        coordinates=q,
        contact_forces=state.contact_forces,
        provenance=provenance,
    )
    return PhysicalFit(fitted, report)
