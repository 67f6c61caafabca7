"""Reading the YAML files that tell what a source's joints or markers are, with common checks."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from motionstyle.errors import MotionStyleError, near_matches

_KINDS = {dict: "mapping of names", list: "list"}


def read_map_file(
    folder: str | Path, name: str, what: str, sections: Mapping[str, type | None]
) -> tuple[Path, dict[str, Any], list[str]]:
    """Return path, sections and the problems found so far of `folder`/`name`.yaml.

    Parameters
    ----------
    what : the kind of file in messages, such as "skeleton".
    sections : keys the file may have; dict or list where a section must be one. Empty sections
        are left out.

    Raises
    ------
    MotionStyleError
        If there is no such file (with near matches), it is not YAML, or a section is not of its
        kind.
    """
    path = Path(folder) / f"{name}.yaml"
    known = sorted(p.stem for p in Path(folder).glob("*.yaml"))
    if not path.is_file():
        raise MotionStyleError(
            f"{what} '{name}' has no file {path}{near_matches(name, known)}; "
            f"known {what}s: {', '.join(known)}"
        )
    try:
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        where = getattr(error, "problem_mark", None)
        line = f" (line {where.line + 1})" if where is not None else ""
        raise MotionStyleError(f"{path}: not a YAML file{line}") from error
    if not isinstance(data, dict):
        raise MotionStyleError(f"{path}: expected the sections {', '.join(sorted(sections))}")
    data = {str(key): value for key, value in data.items() if value is not None}
    wrong = [
        f"{key} must be a {_KINDS[kind]}"
        for key, kind in sections.items()
        if kind is not None and not isinstance(data.get(key, kind()), kind)
    ]
    if wrong:
        raise MotionStyleError(f"{path}: " + "; ".join(wrong))
    problems = [
        f"unknown key '{key}'{near_matches(key, sorted(sections))}"
        for key in set(data) - {*sections}
    ]
    return path, data, problems
