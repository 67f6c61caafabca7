"""Settings of the learners out of `config/nio.yaml`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from motionstyle.errors import MotionStyleError, near_matches
from motionstyle.nio.optima import OurSettings, Stage
from motionstyle.nio.paper import PaperSettings


def our_settings(settings: Mapping[str, Any], schedule: str) -> OurSettings:
    """Return our learner's settings with one of the schedules of stages.

    Raises
    ------
    MotionStyleError
        If there is no such schedule, or nothing that is set by schedule for it.
    """
    part = dict(settings["ours"])
    schedules = part.pop("schedules")
    if schedule not in schedules:
        raise MotionStyleError(
            f"schedule {schedule!r} is not one of {', '.join(schedules)}"
            f"{near_matches(schedule, list(schedules))}"
        )
    for name in ("rounds", "stages_work", "rounds_work", "most_work"):
        if schedule not in part[name]:
            raise MotionStyleError(
                f"ours.{name} of config/nio.yaml has no entry for schedule {schedule!r}: add one"
            )
        part[name] = part[name][schedule]
    stages = [Stage(float(pull), steps, float(gain)) for pull, steps, gain in schedules[schedule]]
    return OurSettings(stages=stages, **part)


def paper_settings(settings: Mapping[str, Any]) -> PaperSettings:
    """Return the settings of the paper's learner."""
    return PaperSettings(**settings["paper"])
