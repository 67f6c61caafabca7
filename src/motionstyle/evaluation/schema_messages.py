"""Complaints of a JSON schema as single clauses a user can act on, without the schema's text."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from jsonschema import Draft202012Validator, ValidationError

from motionstyle.errors import near_matches


def schema_problems(data: object, schema: Mapping[str, Any]) -> list[str]:
    """Return one clause per mistake in `data`: key path, what was found, what was expected.

    List items that have an `id` are named by it. Misspelt keys and choices come with near
    matches; where a schema node has a `description`, it tells what was expected.
    """
    errors = Draft202012Validator(schema).iter_errors(data)
    ordered = sorted(errors, key=lambda e: [(isinstance(s, str), s) for s in e.absolute_path])
    return [f"{_key_path(error, data)}: {_clause(error)}" for error in ordered]


def _key_path(error: ValidationError, data: object) -> str:
    """Return the place of an error, e.g. `claims[nio-F5].metrics.gap.table`."""
    text = ""
    for step in error.absolute_path:
        data = data[step]  # type: ignore[index]
        if isinstance(step, int):
            named = isinstance(data, dict) and isinstance(data.get("id"), str)
            text += f"[{data['id'] if named else step}]"
        else:
            text += f".{step}" if text else step
    return text or "top level"


def _one_of(names: str | Sequence[object]) -> str:
    return names if isinstance(names, str) else " or ".join(map(str, names))


def _clause(error: ValidationError) -> str:
    found, rule = error.instance, error.validator_value
    shown = json.dumps(found, ensure_ascii=False, default=str)
    shown = shown if len(shown) <= 60 else shown[:57] + "…"
    expected = error.schema.get("description") if isinstance(error.schema, dict) else None
    match error.validator:
        case "additionalProperties":
            known = list(error.schema.get("properties", ()))
            unknown = [key for key in found if key not in known]
            clause = ", ".join(f"unknown key '{k}'{near_matches(str(k), known)}" for k in unknown)
        case "required":
            clause = f"misses key {', '.join(key for key in rule if key not in found)}"
        case "type":
            what = "is empty" if found is None else f"is {shown}"
            clause = f"{what}; expected {_one_of(rule)}"
        case "enum":
            near = near_matches(found, list(map(str, rule))) if isinstance(found, str) else ""
            clause = f"is {shown}; expected one of {', '.join(map(str, rule))}{near}"
        case "not":
            clause = f"expected {expected or 'other keys'}"
        case "pattern":
            clause = f"is {shown}; expected {expected or f'text of the form {rule}'}"
        case "anyOf" | "oneOf":
            clause = f"is {shown}; expected {expected or 'something else'}"
        case _:
            clause = " ".join(error.message.split())[:200]
    return clause
