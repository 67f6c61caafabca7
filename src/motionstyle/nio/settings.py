"""Settings of the learners, `config/nio.yaml`, checked against their schema."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from motionstyle.configuration import load_config
from motionstyle.errors import MotionStyleError, near_matches
from motionstyle.nio.ours import OurSettings, Stage
from motionstyle.nio.paper import PaperSettings


def read_nio_settings(path: str | Path, schema: str | Path) -> dict[str, Any]:
    """Read and check the settings of both learners.

    Raises
    ------
    MotionStyleError
        With every problem, one a line, and the file's name.
    """
    path = Path(path)
    try:
        raw = yaml.safe_load(path.read_text(encoding="utf-8-sig"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise MotionStyleError(f"{path}: not a readable settings file ({error})") from error
    try:
        return load_config(raw, schema, path.parent)
    except MotionStyleError as error:
        raise MotionStyleError(f"{path}:\n{error}") from error


def our_settings(settings: Mapping[str, Any], schedule: str) -> OurSettings:
    """Return our learner's settings with one of the schedules of stages.

    Raises
    ------
    MotionStyleError
        If there is no such schedule.
    """
    part = dict(settings["ours"])
    schedules = part.pop("schedules")
    if schedule not in schedules:
        raise MotionStyleError(
            f"schedule {schedule!r} is not one of {', '.join(schedules)}"
            f"{near_matches(schedule, list(schedules))}"
        )
    part["rounds"] = part["rounds"][schedule]
    stages = [Stage(float(pull), steps, float(gain)) for pull, steps, gain in schedules[schedule]]
    return OurSettings(stages=stages, **part)


def paper_settings(settings: Mapping[str, Any]) -> PaperSettings:
    """Return the settings of the paper's learner."""
    return PaperSettings(**settings["paper"])
