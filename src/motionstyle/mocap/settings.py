"""What the configuration may set about retargeting and contacts, by kind of movement."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, TypeVar

from motionstyle.mocap.fitting.floor import StanceThresholds

T = TypeVar("T")


def by_action(values: Mapping[str, T], action: str) -> T:
    """Return the value for an action: its own, that of its first word, or the default.

    The action "walk-turn-left" looks for "walk-turn-left", then "walk", then "default".
    """
    return values.get(action, values.get(action.split("-", maxsplit=1)[0], values["default"]))


def of_action(section: Mapping[str, Any], action: str) -> dict[str, Any]:
    """Return a section of the configuration with each value by action resolved for one."""
    return {
        name: by_action(value, action) if isinstance(value, Mapping) else value
        for name, value in section.items()
    }


@dataclass(frozen=True)
class RetargetSettings:
    """How clips become motions.

    cutoff_hz : low-pass for marker paths, by action. thresholds : when a foot bears, by action.
    repair : mend single-frame flips and let frozen stretches pass. smallest_tilt_deg,
    largest_tilt_deg : a floor tilted less is left alone, more is not believed.
    shortest_span_m : how far the feet must travel for a tilt to be fitted.
    """

    cutoff_hz: Mapping[str, float]
    thresholds: Mapping[str, StanceThresholds]
    repair: bool = True
    smallest_tilt_deg: float = 0.15
    largest_tilt_deg: float = 5.0
    shortest_span_m: float = 1.0

    @staticmethod
    def from_config(retarget: Mapping[str, Any], contacts: Mapping[str, Any]) -> RetargetSettings:
        """Build settings from the sections `retarget` and `contacts` of the configuration.

        An action's contact thresholds are the default ones but for those it names.
        """
        default = contacts["default"]
        names = [f.name for f in fields(StanceThresholds)]
        thresholds = {
            action: StanceThresholds(**{n: {**default, **own}[n] for n in names})
            for action, own in contacts.items()
        }
        return RetargetSettings(
            cutoff_hz=retarget["cutoff_hz"],
            thresholds=thresholds,
            repair=retarget["repair"],
            smallest_tilt_deg=retarget["smallest_tilt_deg"],
            largest_tilt_deg=retarget["largest_tilt_deg"],
            shortest_span_m=retarget["shortest_span_m"],
        )
