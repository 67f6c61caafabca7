"""Values out of the stage's settings, `config/similarity.yaml`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from motionstyle.similarity.events import EventRules


def event_rules(settings: Mapping[str, Any]) -> EventRules:
    """Return the rules of segmentation."""
    part = settings["segmentation"]
    return EventRules(part["simultaneous_s"], part["standing_s"], part["fewest_events"])
