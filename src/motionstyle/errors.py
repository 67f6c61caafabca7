"""The one kind of error a user is meant to read: what is wrong, where, and what to do."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches


class MotionStyleError(Exception):
    """A mistake in input, configuration or data that the user can mend.

    The message is one sentence or one short list; it names the file, row, joint or frame,
    says what was found and what was expected, and what to do about it.
    """


def near_matches(name: str, known: Sequence[str], count: int = 3) -> str:
    """Return " (did you mean …?)" for the known names closest to `name`, or an empty string."""
    lower = {k.lower(): k for k in known}
    found = get_close_matches(name.lower(), list(lower), n=count, cutoff=0.6)
    return f" (did you mean {', '.join(lower[f] for f in found)}?)" if found else ""
