"""The stage's settings, `config/similarity.yaml`, checked against its schema."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from motionstyle.configuration import load_config
from motionstyle.errors import MotionStyleError
from motionstyle.similarity.events import EventRules


def read_settings(path: str | Path, schema: str | Path) -> dict[str, Any]:
    """Read and check the settings.

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


def event_rules(settings: Mapping[str, Any]) -> EventRules:
    """Return the rules of segmentation."""
    part = settings["segmentation"]
    return EventRules(part["simultaneous_s"], part["standing_s"], part["fewest_events"])
