"""The configuration of a run: checked against its schema, every problem told in one line."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

import yaml
from jsonschema import Draft202012Validator, FormatChecker
from jsonschema.exceptions import ValidationError

from motionstyle.errors import MotionStyleError, near_matches
from motionstyle.files import read_json

_TYPES = {
    "string": "text",
    "number": "a number",
    "integer": "a whole number",
    "boolean": "true or false",
    "array": "a list",
    "object": "a group of keys",
    "null": "null",
}
_RULES = {
    "minimum": "at least {}",
    "exclusiveMinimum": "more than {}",
    "maximum": "at most {}",
    "exclusiveMaximum": "less than {}",
    "minLength": "text that is not empty",
    "minItems": "{} or more entries",
}

_KEY_RULES = {"additionalProperties", "required"}

KeyPath = tuple[str | int, ...]


def read_settings(path: str | Path, schema_path: str | Path) -> dict[str, Any]:
    """Read a stage's settings, a YAML file, and check them; see `load_config`.

    Raises
    ------
    MotionStyleError
        With the file's name, and every problem, one a line.
    """
    path = Path(path)
    try:
        raw = yaml.safe_load(path.read_text(encoding="utf-8-sig"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise MotionStyleError(f"{path}: not a readable settings file ({error})") from error
    try:
        return load_config(raw, schema_path, path.parent)
    except MotionStyleError as error:
        raise MotionStyleError(f"{path}:\n{error}") from error


def load_config(
    raw: Mapping[str, Any], schema_path: str | Path, root: str | Path
) -> dict[str, Any]:
    """Check a configuration and fill in the schema's defaults.

    Parameters
    ----------
    raw : the merged configuration, as Snakemake or YAML gives it; left as it is.
    schema_path : a JSON schema. Beside the standard formats, `existing-file` and
        `existing-folder` are known.
    root : the folder that relative paths of the configuration are taken from.

    Returns
    -------
    dict
        A copy with defaults; paths stay as written.

    Raises
    ------
    MotionStyleError
        With every problem, one a line: key, what was found, what was expected.
    """
    schema = read_json(schema_path)
    if not isinstance(raw, Mapping):
        raise MotionStyleError(f"the configuration: found {_found(raw)}, expected a group of keys")
    config = _plain(raw)
    filled = _filled(config, schema)
    problems: dict[KeyPath, str] = {}
    for path, found, advice in _voids(config, ()):
        expected = _expected_at(schema, path)
        problems[path] = f"config key '{_key(path)}': found {found}, expected {expected}{advice}"
    validator = Draft202012Validator(schema, format_checker=_formats(Path(root)))
    for error in validator.iter_errors(filled):
        for path, line in _lines(error):
            if error.validator in _KEY_RULES or path not in problems:
                problems[path] = line
    if problems:
        raise MotionStyleError("\n".join(problems[path] for path in sorted(problems, key=_key)))
    return filled


def _plain(value: object) -> Any:  # noqa: ANN401 - whatever YAML holds
    """Copy mappings and sequences to plain dictionaries and lists, paths to text."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return str(value) if isinstance(value, Path) else value


def _voids(value: object, path: KeyPath) -> Iterator[tuple[KeyPath, str, str]]:
    """Yield the path of every null and every number that is not finite, with words for it."""
    if value is None:
        advice = "; delete the line to have the default"
        yield path, "null (nothing after the colon)", advice
    elif isinstance(value, float) and not math.isfinite(value):
        yield path, str(value), ""
    elif isinstance(value, dict | list):
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _voids(item, (*path, key))


def _filled(config: dict[str, Any], schema: Mapping[str, Any]) -> dict[str, Any]:
    """Return a copy with the schema's defaults for absent keys, group by group."""
    filled = deepcopy(config)
    for key, part in schema.get("properties", {}).items():
        if key not in filled and "default" in part:
            filled[key] = deepcopy(part["default"])
        if isinstance(filled.get(key), dict):
            filled[key] = _filled(filled[key], part)
    return filled


def _formats(root: Path) -> FormatChecker:
    checker = FormatChecker()

    @checker.checks("existing-file", raises=OSError)
    def is_file(value: object) -> bool:
        return not isinstance(value, str) or (root / value).is_file()

    @checker.checks("existing-folder", raises=OSError)
    def is_folder(value: object) -> bool:
        return not isinstance(value, str) or (root / value).is_dir()

    return checker


def _lines(error: ValidationError) -> Iterator[tuple[KeyPath, str]]:
    """Say a violation in one line a key: unknown keys, missing keys, or one wrong value."""
    path = tuple(error.absolute_path)
    known = error.schema.get("properties", {})
    if error.validator == "additionalProperties":
        for name in set(error.instance) - set(known):
            near = near_matches(name, list(known)) or f"; known are {', '.join(known)}"
            yield (*path, name), f"config key '{_key((*path, name))}': unknown key{near}"
    elif error.validator == "required":
        for name in set(error.validator_value) - set(error.instance):
            expected = _expected(known.get(name, {}))
            line = f"config key '{_key((*path, name))}': found nothing, expected {expected}"
            yield (*path, name), line
    else:
        found = _found(error.instance)
        yield path, f"config key '{_key(path)}': found {found}, expected {_rule(error)}"


def _rule(error: ValidationError) -> str:
    """Say what the violated rule asks for."""
    limit, kind = error.validator_value, str(error.validator)
    meaning = error.schema.get("description", "")
    explained = f" ({meaning})" if meaning else ""
    if kind == "type":
        return _expected(error.schema)
    if kind == "enum":
        return _expected(error.schema) + near_matches(str(error.instance), [*map(str, limit)])
    if kind == "format" and str(limit).startswith("existing-"):
        return f"an existing {str(limit).removeprefix('existing-')}{explained}"
    if kind == "pattern":
        return meaning or f"text like {limit}"
    return _RULES[kind].format(limit) + explained if kind in _RULES else str(error.message)


def _expected(schema: Mapping[str, Any]) -> str:
    """Say what a key of this part of the schema takes."""
    if "enum" in schema:
        return f"one of {', '.join(str(choice) for choice in schema['enum'])}"
    types = schema.get("type", [])
    kinds = " or ".join(_TYPES[kind] for kind in ([types] if isinstance(types, str) else types))
    meaning = schema.get("description", "")
    if not kinds or kinds == meaning:
        return meaning or "a value"
    return f"{kinds} ({meaning})" if meaning else kinds


def _expected_at(schema: Mapping[str, Any], path: KeyPath) -> str:
    part: Mapping[str, Any] = schema
    for step in path:
        inner = part.get("items") if isinstance(step, int) else part.get("properties", {}).get(step)
        part = inner if isinstance(inner, Mapping) else {}
    return _expected(part)


def _found(value: object) -> str:
    if isinstance(value, dict | list) and not value:
        return f"an empty {'list' if isinstance(value, list) else 'group'}"
    text = str(value).lower() if isinstance(value, bool) else repr(value)
    return text if len(text) <= 80 else f"{text[:77]}…"


def _key(path: Iterable[str | int]) -> str:
    """Write a path as `body.default_mass_kg` or `mirrors[0]`."""
    text = ""
    for step in path:
        text += f"[{step}]" if isinstance(step, int) else f".{step}" if text else step
    return text
