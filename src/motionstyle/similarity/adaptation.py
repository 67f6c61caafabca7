"""Adapting one example to a task, with and without the style terms, and measuring the result.

Paper §4.2, §6; specification §7. The measures are the columns of `tables/adaptations.csv`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from hashlib import sha256
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.motion.motion import Motion
from motionstyle.similarity.adapt_measures import StyleModels, measure, models_without
from motionstyle.similarity.adapt_problem import AdaptProblem, build_problem
from motionstyle.similarity.adapt_terms import MOVED, WIDTH
from motionstyle.similarity.alignment import SIDE_OF_SET
from motionstyle.similarity.bank import Bank, describe_clip
from motionstyle.similarity.footholds import Example, Footholds, cut_example, make_footholds
from motionstyle.similarity.leg_space import LegSpace
from motionstyle.similarity.models import StyleModel
from motionstyle.similarity.settings import event_rules
from motionstyle.similarity.solver import Solution, solve
from motionstyle.similarity.tasks import Task

Array = NDArray[np.float64]
VARIANTS = ("full", "without_style")
LARGEST_ERROR_CM = 1.0
SCORE_TOLERANCE = 1e-6
BALANCE_FRAMES = 5
ADAPTATION_COLUMNS = (
    *("task", "action", "example", "variant", "figure", "solved", "status", "reason"),
    *("contact_error_cm", "contact_rms_cm", "penetration_cm", "skate_cm", "min_svm_score"),
    *("min_svm_score_example", "score_slack", "relative_leakage", "relative_leakage_example"),
    *("whole_body_leakage", "left_leg_leakage", "right_leg_leakage", "pose_outlier"),
    *("speed_ratio", "leakage_ratio", "distorted", "components", "settings_id"),
    *("balance_marked", "whole_body_segments", "leg_segments", "training_patterns", "frames"),
    *("variables", "attempts", "iterations", "seconds", "data", "config"),
)


@dataclass(frozen=True)
class Adapted:
    """The motion a variant ended with, or None where the solver failed, and its table row."""

    motion: Motion | None
    row: dict[str, object]


def settings_id(settings: Mapping[str, Any]) -> str:
    """Return a short digest of the adaptation's settings, the same for all tasks of a run.

    The number of components by action is one setting, as in the paper.
    """
    return sha256(repr(sorted(settings["adaptation"].items())).encode()).hexdigest()[:8]


def adapt(
    motion: Motion, task: Task, bank: Bank, settings: Mapping[str, Any], config: str
) -> dict[str, Adapted]:
    """Return the full and the ablated adaptation of an example, and the row of the example itself.

    Raises
    ------
    MotionStyleError
        If the example lacks segments, a foothold is out of reach, or too few pairs are left
        without the example.
    """
    part = settings["adaptation"]
    style = models_without(bank, settings, {motion.id.removesuffix("_mirror")})
    example = cut_example(motion, task, event_rules(settings), part["rate_hz"])
    holds = make_footholds(example, task)
    marked = np.zeros(example.motion.frames, dtype=bool)
    if task.balance:
        marked[-BALANCE_FRAMES:] = True
    components = part["components"][task.action]
    common: dict[str, object] = {
        "task": task.task,
        "action": task.action,
        "example": task.example,
        "figure": task.figure or None,
        "components": components,
        "settings_id": settings_id(settings),
        "data": describe_clip(motion).data,
        "balance_marked": task.balance,
        "whole_body_segments": sum(s.set == "whole_body" for s in example.segments),
        "leg_segments": sum(s.set in SIDE_OF_SET for s in example.segments),
        "training_patterns": style.patterns,
        "frames": example.motion.frames,
        "config": config,
    }
    own = measure(example.motion, example, holds, style, bank, settings)
    found = {"example": Adapted(None, common | own | {"variant": "example", "status": "not run"})}
    for variant in VARIANTS:
        models = style.models if variant == "full" else None
        problem, solution, attempts = _solve_patiently(
            example, holds, style.spaces, models, settings, components, marked
        )
        row = common | {"variant": variant, "variables": len(problem.start), "attempts": attempts}
        slack = solution.x[len(solution.x) - len(problem.scores) :] if problem.scores else None
        found[variant] = _finish(
            solution, slack, example, holds, task, variant, style, bank, settings, row, own
        )
    return found


def _solve_patiently(
    example: Example,
    holds: Footholds,
    spaces: Mapping[str, LegSpace],
    models: Mapping[str, StyleModel] | None,
    settings: Mapping[str, Any],
    components: int,
    marked: NDArray[np.bool_],
) -> tuple[AdaptProblem, Solution, int]:
    """Return a program, its solution and the number of attempts.

    Where the solver does not converge it goes on from its last point with twice the caution, for
    all tasks alike. Iterations and seconds are those of all attempts.
    """
    part = settings["adaptation"]
    start, iterations, seconds = None, 0, 0.0
    for attempt in range(1, part["attempts"] + 1):
        problem = build_problem(
            example,
            holds,
            spaces,
            models,
            part | {"caution": part["caution"] * 2 ** (attempt - 1)},
            components,
            settings["leg_space"]["features"],
            marked,
        )
        solution = solve(
            problem.program,
            problem.start if start is None else start,
            problem.lower,
            problem.upper,
            max_iterations=part["max_iterations"],
            time_limit_s=part["time_limit_s"],
        )
        iterations, seconds = iterations + solution.iterations, seconds + solution.seconds
        if solution.solved or not np.isfinite(solution.x).all():
            break
        start = solution.x
    return problem, replace(solution, iterations=iterations, seconds=seconds), attempt


def _finish(
    solution: Solution,
    slack: Array | None,
    example: Example,
    holds: Footholds,
    task: Task,
    variant: str,
    style: StyleModels,
    bank: Bank,
    settings: Mapping[str, Any],
    row: dict[str, object],
    own: Mapping[str, object],
) -> Adapted:
    """Return the motion and row of a solved program, or the row of a failure with its diagnosis."""
    row |= {
        "status": solution.status,
        "iterations": solution.iterations,
        "seconds": solution.seconds,
        "score_slack": None if slack is None else float(np.max(slack, initial=0.0)),
        "min_svm_score_example": own["min_svm_score"],
        "relative_leakage_example": own["relative_leakage"],
    }
    if not solution.solved:
        return Adapted(None, row | {"solved": False, "reason": solution.diagnosis})
    motion = _motion(solution.x, example, holds, task, variant, solution.status)
    row |= measure(motion, example, holds, style, bank, settings)
    row["leakage_ratio"] = row["relative_leakage"] / max(own["relative_leakage"], 1e-9)
    row["pose_outlier"] = row["pose_outlier"] / max(own["pose_outlier"], 1e-9)
    limits = settings["adaptation"]["distorted"]
    row["distorted"] = any(row[name] > limit for name, limit in limits.items())
    failures = [
        f"{name} {row[name]:.2f} cm"
        for name in ("contact_error_cm", "penetration_cm", "skate_cm")
        if row[name] > LARGEST_ERROR_CM
    ]
    if variant == "full" and row["min_svm_score"] < -SCORE_TOLERANCE:
        failures.append(
            f"S >= 0 cannot be met: least score {row['min_svm_score']:.2g}"
            + (
                ", also (example, example) lies outside"
                if own["min_svm_score"] < -SCORE_TOLERANCE
                else ""
            )
        )
    row |= {"solved": not failures, "reason": "; ".join(failures) or None}
    return Adapted(motion, row)


def _motion(
    x: Array, example: Example, holds: Footholds, task: Task, variant: str, status: str
) -> Motion:
    """Return the adapted motion from the program's variables."""
    source = example.motion
    coordinates = source.coordinates.copy()
    coordinates[:, MOVED] = x[: source.frames * WIDTH].reshape(source.frames, WIDTH)
    normals = np.zeros_like(source.contact_normals)
    normals[..., 1] = 1.0
    known = source.provenance
    surface = holds.surface
    provenance = {
        name: known.get(name) for name in ("dataset", "subject", "action", "style", "source")
    } | {
        "example": task.example,
        "edit": f"{task.task}, {variant.replace('_', ' ')}",
        "footprints": task.task,
        "planted": bool(known.get("planted")),
        "solver_status": status,
        "support_height_m": [float(h) for h in holds.support],
        "surface": {
            "places_m": list(surface.places),
            "rises_m": list(surface.rises),
            "origin_m": list(surface.origin),
            "direction": list(surface.direction),
        },
    }
    name = task.task if variant == "full" else f"{task.task}_{variant}"
    return replace(
        source,
        id=name,
        kind="adapted",
        coordinates=coordinates,
        contact_normals=normals,
        contact_forces=None,
        provenance=provenance,
    )


def failed_rows(task: Task, reason: str, config: str) -> list[dict[str, object]]:
    """Return the rows of a task that could not be posed at all."""
    return [
        {
            "task": task.task,
            "action": task.action,
            "example": task.example,
            "variant": variant,
            "figure": task.figure or None,
            "solved": False,
            "status": "refused",
            "reason": reason,
            "balance_marked": task.balance,
            "config": config,
        }
        for variant in VARIANTS
    ]
