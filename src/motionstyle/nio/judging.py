"""Judging a style: the same converged solves for every learner (nio.md E1–E3).

Ends are free. X_S is found from X_T and from perturbed ones; how far it lies from X_T is what
counts, beside E, G and whether the starts agree.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.dynamics.inverse import GRAVITY
from motionstyle.motion.difference import joint_rms_deg
from motionstyle.motion.motion import Motion
from motionstyle.nio.inner import effective_number
from motionstyle.nio.learning_problem import (
    LearningProblem,
    cost_of_point,
    target_cost,
)
from motionstyle.spacetime.continuation import solve_spacetime
from motionstyle.spacetime.solver_point import InteriorPointResult, SolverSettings
from motionstyle.spacetime.spacetime_problem import SpacetimeProblem
from motionstyle.spacetime.starts import perturbed
from motionstyle.spacetime.style import Style

Array = NDArray[np.float64]
# Some of the worst starts, ablated styles above all, are still on their way after 500 iterations
# and converge soon after; where a style ends is not to depend on where a solve was cut off.
JUDGING = SolverSettings(iterations=2000)
LOOSE_HZ = 4.0  # joint movement above it counts as looseness (E3)


@dataclass(frozen=True)
class Judged:
    """A style's resynthesis: rows of `tables/resynthesis.csv`, and the motion from X_T."""

    rows: list[dict[str, Any]]
    motion: Motion


def judge(
    learning: LearningProblem,
    style: Style,
    starts: Sequence[str],
    settings: SolverSettings = JUDGING,
    *,
    keep_ends: int = 0,
    root_weight: float | None = None,
    log: Callable[[str], None] = print,
) -> Judged:
    """Return how well X_S of a style comes to X_T, from each start.

    Parameters
    ----------
    starts : `target` (from X_T, the problem itself at once), `gentle` (from X_T by way of gentler
        problems, which lead further away), or `perturbed_N` (so too, from X_T with smooth noise of
        10° rms, seed N).
    keep_ends : control points at both ends that stay X_T's. root_weight : w_r where it is another.
    """
    problem = replace(learning.problem(style), keep_ends=keep_ends)
    if root_weight is not None:
        weights = replace(problem.settings, root_weight=root_weight)
        problem = replace(problem, settings=weights)
    target = target_cost(learning, style)
    rows, results = [], []
    for name in starts:
        controls = _start(learning, problem, name, keep_ends)
        result = solve_spacetime(problem, controls, settings=settings, warm=name == "target")
        row = {"start": name, **_measured(learning, problem, result, target.energy, target.total)}
        rows.append(row)
        results.append(result)
        log(f"{name}: {result.status}, {row['joint_error_deg']:.2f}°, E {row['E_synth']:.1f}")
    done = [row["total"] for row in rows if row["status"] == "converged"]
    best = min(done or [row["total"] for row in rows])
    for row, result in zip(rows, results, strict=True):
        row["above_best_pct"] = 100 * (row["total"] / best - 1)
        row["from_first_start_deg"] = joint_rms_deg(
            result.values.coordinates, results[0].values.coordinates
        )
    first = results[0]
    motion = replace(
        learning.target,
        kind="nio",
        coordinates=first.values.coordinates,
        contact_forces=first.values.forces + first.values.shoe_forces,
    )
    return Judged(rows, motion)


def _start(learning: LearningProblem, problem: SpacetimeProblem, name: str, keep: int) -> Array:
    if name in ("target", "gentle"):
        return learning.controls
    moved = perturbed(learning.target, int(name.removeprefix("perturbed_")))
    controls = problem.basis().fit(moved.coordinates)
    if keep:
        controls[:keep], controls[-keep:] = learning.controls[:keep], learning.controls[-keep:]
    return controls


def _measured(
    learning: LearningProblem,
    problem: SpacetimeProblem,
    result: InteriorPointResult,
    target_energy: float,
    target_total: float,
) -> dict[str, Any]:
    """Return one solve's columns."""
    cost = cost_of_point(problem, result.point)
    values = cost.values
    away = values.coordinates - learning.coordinates
    place = np.sqrt((away[:, :3] ** 2).sum(axis=1))
    middle = slice(learning.target.frames // 6, -(learning.target.frames // 6))
    weight = learning.target.body.mass * GRAVITY
    forces = (values.forces + values.shoe_forces).sum(axis=1)
    wanted = learning.target.contact_forces
    wanted = np.zeros_like(forces) if wanted is None else wanted.sum(axis=1)
    square = (values.muscle**2).sum(axis=0)
    return {
        "status": result.status,
        "optimality": result.optimality,
        "iterations": result.iterations,
        "solver_seconds": result.seconds,
        "joint_error_deg": learning.joint_error_deg(values.coordinates),
        "joint_error_middle_deg": joint_rms_deg(
            values.coordinates[middle], learning.coordinates[middle]
        ),
        "captured_error_deg": joint_rms_deg(values.coordinates, learning.captured.coordinates),
        "root_path_rms_cm": 100 * float(np.sqrt((place**2).mean())),
        "ground_reaction_rms_pctbw": 100
        * float(np.sqrt(((forces - wanted)[:, 1] ** 2).mean()) / weight),
        "loose_deg": looseness_deg(values.coordinates, learning.target.rate_hz),
        "target_loose_deg": looseness_deg(learning.coordinates, learning.target.rate_hz),
        "E_target": target_energy,
        "E_synth": cost.energy,
        "total": cost.total,
        "G": target_total - cost.total,
        "G_over_E_target": (target_total - cost.total) / target_energy,
        "root_share_of_E_pct": 100 * cost.root / max(cost.energy, 1e-12),
        "foot_error_mm": 1000
        * float(np.abs(values.foot_residuals).max() / np.sqrt(problem.settings.foot_weight)),
        "effective_joints_in_alpha": effective_number(problem.style.preferences),
        "synth_passive_over_muscle": float((values.passive**2).sum() / max(square.sum(), 1e-12)),
    }


def looseness_deg(coordinates: Array, rate_hz: float) -> float:
    """Return the rms of joint angles' movement faster than 4 Hz, degrees: "loose" joints shake."""
    angles = coordinates[:, 6:]
    bent = np.linspace(0, 1, len(angles))[:, None]
    level = angles - (angles[0] + bent * (angles[-1] - angles[0]))
    spectrum = np.fft.rfft(level, axis=0)
    spectrum[np.fft.rfftfreq(len(angles), 1 / rate_hz) < LOOSE_HZ] = 0
    return float(np.degrees(np.sqrt((np.fft.irfft(spectrum, len(angles), axis=0) ** 2).mean())))


def ablated_styles(style: Style) -> Mapping[str, Style]:
    """Return E2's styles: no preferences and no passive elements, in both scalings of α."""
    count = len(style.preferences)
    nothing = np.zeros(5 * count + 2)
    found = {}
    for name, share in (("alpha_1", 1.0), ("alpha_1_29", 1 / count)):
        vector = nothing.copy()
        vector[:count] = share
        about = {"recipe": f"no_style_{name}", "clip": style.about.get("clip", "")}
        found[f"no_style_{name}"] = replace(style.with_vector(vector), about=about)
    return found
