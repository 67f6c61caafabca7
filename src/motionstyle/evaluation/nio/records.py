"""Records that jobs of learning leave: rows of tables, or why there are none."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from motionstyle.dynamics.codegen import FrameFunction
from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.nio.kinds import KINDS
from motionstyle.evaluation.nio.learning_table import style_cells
from motionstyle.motion.storage import load_motion
from motionstyle.nio.learning_problem import LearningProblem, learning_problem
from motionstyle.nio.styles_sheet import StyleRow
from motionstyle.tables import plain

# Farther than this from its fit a motion is another one: it fell, or a foot let go.
FARTHEST_MM, FARTHEST_DEG = 30.0, 3.0


def load_learning(
    row: StyleRow, motion: str | Path, functions: Mapping[str, FrameFunction]
) -> LearningProblem:
    """Return the learning problem of a row's window.

    Raises
    ------
    MotionStyleError
        If the window is not inside the motion, or see `learning_problem`.
    """
    learning = learning_problem(row.window(load_motion(motion)), functions)
    check_projection(learning)
    return learning


def check_projection(learning: LearningProblem) -> None:
    """Refuse a captured motion that had to be moved far to obey the dynamics in its contacts.

    Raises
    ------
    MotionStyleError
        If it was.
    """
    found = learning.projection
    if found.place_rms_mm > FARTHEST_MM or found.angle_rms_deg > FARTHEST_DEG:
        raise MotionStyleError(
            f"motion {learning.captured.id}: the nearest motion that obeys the dynamics in its "
            f"contacts lies {found.place_rms_mm:.0f} mm and {found.angle_rms_deg:.1f}° away "
            f"(limits {FARTHEST_MM:.0f} mm, {FARTHEST_DEG:.0f}°); choose a window without wrong "
            "contacts"
        )


def learning_record(row: StyleRow, algorithm: str, work: Callable[[], Any]) -> dict[str, Any]:
    """Return the record of one learning, whose `work` returns rows; a failure is one too."""
    found: dict[str, Any] = {"cells": style_cells(row), "algorithm": algorithm}
    try:
        return {**found, "status": "done", "rows": [plain(one) for one in work()]}
    except (MotionStyleError, FloatingPointError) as error:
        print(f"failed: {error}")
        return {**found, "status": "failed", "reason": str(error), "rows": []}


def judging_record(row: StyleRow, name: str, learning: LearningProblem | None) -> dict[str, Any]:
    """Return the head of a record of judging: whose style, of which kind, how X_T was projected."""
    kind = KINDS[name]
    found: dict[str, Any] = {
        "cells": style_cells(row),
        "kind": name,
        **{k: getattr(kind, k) for k in ("algorithm", "variant", "ends")},
    }
    if learning is not None:
        found["projection"] = {
            "projection_status": learning.projection.status,
            "projection_angle_rms_deg": learning.projection.angle_rms_deg,
            "projection_root_n": learning.projection.root_n,
        }
    return found
