"""What the readers of text motion files share: lines, numbers, and one error for all faults."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError

_SHOWN = 40
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
_COMMA = re.compile(r"[+-]?[0-9]*,[0-9]+([eE][+-]?[0-9]+)?")


class Problems:
    """The faults found in one file, raised together.

    Parameters
    ----------
    path : the file the messages name.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.found: list[tuple[int | None, str]] = []

    def add(self, line: int | None, message: str) -> None:
        """Note a fault at a line (counted from 1; None where no line can be named)."""
        self.found.append((line, message))

    def stop(self) -> None:
        """Raise what was noted; return if there is nothing.

        Raises
        ------
        MotionStyleError
            Lists every fault in file order, the first 40 in words and the rest as a count.
        """
        if not self.found:
            return
        ordered = sorted(self.found, key=lambda one: (one[0] is None, one[0] or 0))
        texts = [f"line {at}: {text}" if at else text for at, text in ordered]
        if len(texts) == 1:
            raise MotionStyleError(f"{self.path}: {texts[0]}")
        shown = texts[:_SHOWN]
        if len(texts) > _SHOWN:
            shown.append(f"and {len(texts) - _SHOWN} more")
        raise MotionStyleError(
            f"{self.path}: {len(texts)} problems:\n" + "\n".join(f"  {text}" for text in shown)
        )


def read_lines(path: Path, kind: str) -> list[str]:
    """Read a text file as lines without their ends: LF, CRLF or CR, UTF-8 (BOM) or Latin-1.

    Parameters
    ----------
    path : the file.
    kind : the format's name, for messages.

    Raises
    ------
    MotionStyleError
        If the file cannot be read or is binary.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise MotionStyleError(
            f"{path}: cannot read this {kind} file ({error.strerror or error})"
        ) from error
    zero = data.find(b"\0")
    if zero >= 0:
        hint = " (UTF-16? save it as UTF-8)" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else ""
        raise MotionStyleError(
            f"{path}: not {kind} text: byte {zero} is 0, as in binary data{hint}"
        )
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    return re.split(r"\r\n|\r|\n", text)


def words(line: str) -> list[str]:
    """Split at blanks and tabs only, so that a Latin-1 no-break space stays in a name."""
    return re.findall(r"[^ \t\f\v]+", line)


def number_problem(text: str) -> str | None:
    """Say why `text` is not a finite decimal number ("is ...", for a sentence), or None."""
    if _NUMBER.fullmatch(text):
        return None if math.isfinite(float(text)) else f"is {text}, too large a number"
    if not text:
        return "is missing"
    if text.lower().lstrip("+-") in ("nan", "inf", "infinity", "1.#qnan", "1.#ind", "1.#inf"):
        return f"is {text}, expected a finite number"
    if _COMMA.fullmatch(text):
        return f"is '{text}', with a decimal comma; expected '{text.replace(',', '.')}'"
    return f"is {text[:30]!r}, expected a number"


def parse_number(text: str) -> float:
    """Convert a number that `number_problem` found no fault with."""
    return float(text)


def tidy_rate(rate_hz: float) -> float:
    """Round a rate within 0.01 % of a whole number of frames per second to that number."""
    whole = round(rate_hz)
    return float(whole) if whole and abs(rate_hz / whole - 1.0) < 1e-4 else rate_hz


def axis_rotation(axis: int, angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return rotation matrices about the x, y or z axis (0, 1, 2), (F, 3, 3), from radians (F,)."""
    cos, sin = np.cos(angles), np.sin(angles)
    one, two = (axis + 1) % 3, (axis + 2) % 3
    matrices = np.zeros((*angles.shape, 3, 3))
    matrices[..., axis, axis] = 1.0
    matrices[..., one, one] = cos
    matrices[..., two, two] = cos
    matrices[..., one, two] = -sin
    matrices[..., two, one] = sin
    return matrices
