"""Known truth, part 2: styles learnt back from motions that were made with them (nio.md T1).

X* is the converged synthesis of a captured window's own problem with a random style θ*. It is
learnt from as if it had been captured. Then θ̂ is held against θ*: by G and the motion under the
constraints it was learnt with, by the motions under new ones, and parameter by parameter.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.layout import JOINT_COORDINATES
from motionstyle.dynamics.codegen import FrameFunction
from motionstyle.errors import MotionStyleError
from motionstyle.motion.difference import joint_rms_deg
from motionstyle.motion.motion import Motion
from motionstyle.nio.derivatives import SIZE, joint_response
from motionstyle.nio.inner import Learnt
from motionstyle.nio.judging import judge
from motionstyle.nio.learning_problem import LearningProblem, learning_problem, motion_cost
from motionstyle.nio.style_space import StyleSpace
from motionstyle.spacetime.continuation import solve_spacetime
from motionstyle.spacetime.edits import Edits
from motionstyle.spacetime.made_styles import random_style
from motionstyle.spacetime.solver_point import InteriorPointResult, SolverSettings
from motionstyle.spacetime.spacetime_problem import SpacetimeProblem
from motionstyle.spacetime.starts import perturbed
from motionstyle.spacetime.style import Style, initial_style
from motionstyle.spacetime.synthesis import synthesise
from motionstyle.spacetime.synthesis_plan import make_plan, planned_footprints
from motionstyle.spacetime.synthesis_sheet import FootprintSource, SynthesisRow

Array = NDArray[np.float64]
TEST = "nio_twin"
# New constraints, by task.
TASKS: Mapping[str, FootprintSource] = {
    "curve": FootprintSource(
        "arc",
        {"radius_m": 2.0, "side": "left", "lead_m": 0.0, "step_scale": 1.0, "time_scale": 1.0},
    ),
    "ramp_up": FootprintSource(
        "ramp", {"slope_deg": 5.0, "level_m": -np.inf, "step_scale": 1.0, "time_scale": 1.0}
    ),
    "line": FootprintSource("line", {"step_scale": 0.85, "time_scale": 1.0}),
}


@dataclass(frozen=True)
class Twin:
    """A problem whose answer is known: θ*, and the problem of learning it from X*.

    singular_values : of the optimum's derivative by scaled θ, degrees (rms) per unit, falling.
    """

    truth: Style
    learning: LearningProblem
    status: str
    singular_values: Array


def make_twin(
    learning: LearningProblem,
    functions: Mapping[str, FrameFunction],
    seed: int,
    noise_deg: float = 0.0,
    settings: SolverSettings | None = None,
) -> Twin:
    """Return the twin of a seed; noise is added to X* before it counts as captured.

    Raises
    ------
    MotionStyleError
        If there is no X*, or none of the motions near a noisy one obeys the dynamics.
    """
    truth = random_style(learning.start, seed)
    problem = learning.problem(truth)
    made = solve_spacetime(problem, learning.controls, settings=settings)
    if made.status != "converged":
        raise MotionStyleError(
            f"twin {seed}: the motion made with θ* did not converge ({made.status}); no truth"
        )
    values = made.values
    target = replace(
        learning.target,
        id=f"{learning.target.id}_twin{seed}",
        kind="planted",
        coordinates=values.coordinates,
        contact_forces=values.forces + values.shoe_forces,
    )
    spectrum = singular_values(learning, problem, made)
    if noise_deg:
        noisy = replace(perturbed(target, seed, noise_deg), id=target.id)
        other = learning_problem(noisy, functions, settings=learning.settings)
        return Twin(truth, other, made.status, spectrum)
    limp = truth.with_vector(np.append(np.zeros(SIZE - 2), truth.vector()[-2:]))
    free = motion_cost(learning.problem(limp), made.point.controls).values
    joints = JOINT_COORDINATES
    shoes = (learning.start.shoe_stiffness, learning.start.shoe_rest_length)
    start = initial_style(free.coordinates[:, joints], free.rates[:, joints], free.muscle, shoes)
    twin = replace(
        learning,
        captured=target,
        target=target,
        controls=made.point.controls,
        coordinates=values.coordinates,
        start=replace(start, about=learning.start.about),
    )
    return Twin(truth, twin, made.status, spectrum)


def singular_values(
    learning: LearningProblem, problem: SpacetimeProblem, found: InteriorPointResult
) -> Array:
    """Return the singular values of ∂(joint angles)/∂y at an optimum, degrees rms per unit."""
    space = StyleSpace.of(learning.ranges, 0.01, 29.0)
    joints, _controls = joint_response(problem, found, space.chain(problem.style))
    return np.linalg.svd(np.degrees(joints) / np.sqrt(len(joints)), compute_uv=False)


def new_motion(
    task: str, example: Motion, style: Style, functions: Mapping[str, FrameFunction]
) -> tuple[Motion | None, str]:
    """Return the synthesis of a style under new constraints, and its status."""
    row = SynthesisRow(
        f"{example.id}_{task}", None, task, example.id, "twin", "other", TASKS[task], Edits(),
        None, None, (), None, 0, Path(),
    )  # fmt: skip
    plan = make_plan(row, example, *planned_footprints(row, example))
    found = synthesise(row, plan, style, functions)
    return found.motion, str(found.report["status"])


def twin_row(
    twin: Twin,
    seed: int,
    noise_deg: float,
    learner: Callable[[LearningProblem], Learnt],
    functions: Mapping[str, FrameFunction],
    log: Callable[[str], None] = print,
) -> dict[str, Any]:
    """Return the row of `tables/known_truth.csv` of one twin, learnt back.

    `new_constraints_rms_deg` is the rms over the tasks at which both styles' motions converged.
    """
    learnt = learner(twin.learning)
    judged = judge(twin.learning, learnt.style, ["target"], log=log).rows[0]
    errors = []
    for task in TASKS:
        true, true_status = new_motion(task, twin.learning.target, twin.truth, functions)
        ours, our_status = new_motion(task, twin.learning.target, learnt.style, functions)
        done = true_status == our_status == "converged"
        if done and true is not None and ours is not None:
            errors.append(joint_rms_deg(ours.coordinates, true.coordinates))
        log(f"{task}: {true_status} and {our_status}, {errors[-1] if done else None}")
    logs = [np.log(style.preferences) for style in (twin.truth, learnt.style)]
    return {
        "test": TEST,
        "part": 2,
        "problem": twin.learning.target.id,
        "seed": seed,
        "start": "initial",
        "noise": noise_deg,
        "status": judged["status"],
        "target_status": twin.status,
        "E": judged["E_synth"],
        "target_E": judged["E_target"],
        "G_over_E_target": judged["G_over_E_target"],
        "joint_rms_deg": judged["joint_error_deg"],
        "new_constraints_rms_deg": float(np.sqrt(np.mean(np.square(errors)))) if errors else None,
        "log_alpha_correlation": float(np.corrcoef(*logs)[0, 1]),
        "optimality": judged["optimality"],
        "iterations": len(learnt.rows),
        "seconds": learnt.rows[-1]["seconds"],
        "reason": None if len(errors) == len(TASKS) else f"{len(errors)} of {len(TASKS)} new tasks",
    }
