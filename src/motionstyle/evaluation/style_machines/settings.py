"""Reading `config/style_machines.yaml`, and which of its experiments a run can make."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

import yaml

from motionstyle.configuration import load_config
from motionstyle.errors import MotionStyleError, near_matches


def load_settings(path: str | Path, schema: str | Path) -> dict[str, Any]:
    """Read and check settings; a file with `base` names another one that it changes.

    Raises
    ------
    MotionStyleError
        With every problem, one a line.
    """
    path = Path(path)
    raw = _read(path)
    if "base" in raw:
        base = _read(path.parent / str(raw.pop("base")))
        raw = _merged(base, raw)
    try:
        return load_config(raw, schema, path.parent)
    except MotionStyleError as error:
        lines = str(error).replace("config key", f"{path.name}, key")
        raise MotionStyleError(lines) from None


def _read(path: Path) -> dict[str, Any]:
    try:
        raw = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise MotionStyleError(f"{path}: not a readable YAML file ({error})") from error
    if not isinstance(raw, dict):
        raise MotionStyleError(f"{path}: found {raw!r}, expected a group of keys")
    return raw


def _merged(base: Mapping[str, Any], change: Mapping[str, Any]) -> dict[str, Any]:
    result = deepcopy(dict(base))
    for key, value in change.items():
        both = isinstance(value, Mapping) and isinstance(result.get(key), Mapping)
        result[key] = _merged(result[key], value) if both else deepcopy(value)
    return result


def available(wanted: Iterable[str], known: Iterable[str], experiment: str) -> bool:
    """Whether a run has all motions of an experiment.

    Without any of them the experiment is left out: the sheet is another one.

    Raises
    ------
    MotionStyleError
        If some are there and others are not; the message names those and near matches.
    """
    ids, there = list(dict.fromkeys(wanted)), set(known)
    missing = [one for one in ids if one not in there]
    if not missing:
        return True
    if len(missing) == len(ids):
        return False
    named = ", ".join(one + near_matches(one, sorted(there), 1) for one in missing[:5])
    more = f" and {len(missing) - 5} more" if len(missing) > 5 else ""
    raise MotionStyleError(
        f"style machines, {experiment}: no motion {named}{more} in this run; correct the name in "
        "config/style_machines.yaml or add the clip to the sheet"
    )


def pattern_ids(pattern: str, styles: Iterable[str], takes: Iterable[str]) -> list[str]:
    """Return the ids of a pattern with {style} and {take}; a style loses its "planted-" prefix."""
    return [
        pattern.format(style=style.removeprefix("planted-"), take=take)
        for style in styles
        for take in takes
    ]


def planned(settings: Mapping[str, Any], known: Iterable[str]) -> dict[str, Any]:
    """Return the settings with only the experiments whose motions are in the run."""
    there = set(known)
    plan = deepcopy(dict(settings))
    checks = {
        "explained_variance": lambda e: e["motions"],
        "analogies": lambda e: [
            *pattern_ids(e["walk"], e["styles"], e["takes"]),
            *pattern_ids(e["run"], e["styles"], e["takes"]),
        ],
        "held_out": lambda e: pattern_ids(e["motion"], e["styles"], [*e["learn"], *e["try"]]),
        "dances": lambda e: e,
    }
    for group, ids in checks.items():
        plan[group] = {
            name: entry
            for name, entry in settings[group].items()
            if available(ids(entry), there, f"{group}.{name}")
        }
    singles = {
        "gaits": lambda e: [*e["motions"], e["walk"], e["run"], e["strut"], e["cat"]],
        "three_walks": lambda e: [*e["learn"], *e["try"]],
        "novice": lambda e: [e["held_out"], e["expert"]],
        "driving": lambda e: e["learn"],
    }
    for group, ids in singles.items():
        entry = settings.get(group)
        if entry is not None and not available(ids(entry), there, group):
            del plan[group]
    if "gaits" in plan:
        roles = [plan["gaits"][role] for role in ("walk", "run", "strut", "cat")]
        available(roles, plan["gaits"]["motions"], "gaits (roles must be among its motions)")
    return plan
