"""Lines of sheets, and typed values out of their cells, with a note of everything wrong."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from motionstyle.errors import MotionStyleError, near_matches

_RESERVED = {"CON", "PRN", "AUX", "NUL", *(f"{p}{n}" for p in ("COM", "LPT") for n in range(1, 10))}


class Cells:
    """The cells of one row; a wrong one is noted in `problems` and read as None.

    Parameters
    ----------
    table : name of the file, for messages.
    row : number of the line, counted from 1.
    cells : text by column, without spaces around it.
    problems : the list that notes are appended to.
    """

    def __init__(self, table: str, row: int, cells: Mapping[str, str], problems: list[str]) -> None:
        self.row = row
        self._where = f"{table} row {row}"
        self._cells = cells
        self._problems = problems

    def problem(self, column: str, text: str) -> None:
        """Note what is wrong with one cell."""
        self._problems.append(f"{self._where}, column {column}: {text}")

    def text(self, column: str) -> str | None:
        """Return the text, or None if the cell is empty."""
        return self._cells[column] or None

    def required(self, column: str) -> str:
        """Return the text of a cell that must not be empty."""
        if not self._cells[column]:
            self.problem(column, "empty, but required")
        return self._cells[column]

    def identifier(self, column: str) -> str:
        """Return a required name that may become a file name on every system."""
        value = self.required(column)
        if value and not re.fullmatch(r"[A-Za-z0-9_.-]+", value):
            self.problem(column, f"{value!r} may have only letters A-Z, digits, '_', '.' and '-'")
        elif value and not (value[0].isalnum() and value[-1] != "." and len(value) <= 100):
            rule = "begin with a letter or digit, not end in '.', and have at most 100 characters"
            self.problem(column, f"{value!r} must {rule}")
        elif value.split(".")[0].upper() in _RESERVED:
            self.problem(column, f"{value!r} is no file name on Windows")
        return value

    def one_of(self, column: str, known: Sequence[str]) -> str | None:
        """Return a text that must be one of `known`."""
        chosen = self._known(column, [self._cells[column]], known)
        return chosen[0] if chosen else None

    def some_of(self, column: str, known: Sequence[str]) -> tuple[str, ...]:
        """Return the parts of a comma-separated text, each one of `known`."""
        return tuple(dict.fromkeys(self._known(column, self._cells[column].split(","), known)))

    def _known(self, column: str, values: Sequence[str], known: Sequence[str]) -> list[str]:
        chosen = []
        for value in filter(None, (value.strip() for value in values)):
            if value in known:
                chosen.append(value)
                continue
            near = near_matches(value, known)
            self.problem(column, f"{value!r} is not one of {', '.join(known)}{near}")
        return chosen

    def number(
        self, column: str, expected: str, *, above: float, up_to: float = math.inf
    ) -> float | None:
        """Return a finite number within (above, up_to]."""
        value = self._cells[column]
        number = finite(value)
        if value and (number is None or not above < number <= up_to):
            comma = "; write a decimal point" if "," in value else ""
            self.problem(column, f"{value!r} is not {expected}{comma}")
            return None
        return number

    def whole(self, column: str, least: int) -> int | None:
        """Return a whole number from `least` on."""
        value = self._cells[column]
        if value and not (re.fullmatch(r"[0-9]{1,9}", value) and int(value) >= least):
            self.problem(column, f"{value!r} is not a whole number from {least} on")
            return None
        return int(value) if value else None


def finite(value: str) -> float | None:
    """Return the finite number a text is, or None."""
    try:
        number = float(value)
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def sheet_rows(
    path: Path, columns: Sequence[str], problems: list[str], *, none: str | None = None
) -> Iterator[Cells]:
    """Yield the cells of every row under the header; empty lines and comments are passed over.

    Rows are counted as an editor counts lines. Rows with a wrong number of cells are noted in
    `problems` and left out.

    Parameters
    ----------
    none : what to say of a sheet without rows, if that is a fault.

    Raises
    ------
    MotionStyleError
        If the file cannot be read, its header is not the columns, or it must have rows.
    """
    lines = _lines(path)
    if not lines:
        raise MotionStyleError(f"{path}: the sheet is empty; its first line names the columns")
    header = lines[0][1]
    _check_header(path, *lines[0], columns)
    if none is not None and len(lines) == 1:
        raise MotionStyleError(f"{path}: {none}")
    for number, line in lines[1:]:
        if len(line) != len(header):
            problems.append(
                f"{path.name} row {number}: {len(line)} cells, expected {len(header)}"
                " (one for each column, divided by tabs)"
            )
            continue
        named = {column: cell.strip() for column, cell in zip(header, line, strict=True)}
        yield Cells(path.name, number, named, problems)


def _lines(path: Path) -> list[tuple[int, list[str]]]:
    """Return (line number, cells) of every line that is neither empty nor a comment."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise MotionStyleError(
            f"{path}: the sheet is not UTF-8 text (byte {error.start + 1}); save it as UTF-8"
        ) from error
    except OSError as error:
        raise MotionStyleError(f"{path}: cannot read the sheet: {error.strerror}") from error
    found = []
    for number, line in enumerate(re.split(r"\r\n|\r|\n", text), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        try:
            found.append((number, next(csv.reader([line], delimiter="\t", strict=True))))
        except csv.Error as error:
            raise MotionStyleError(f"{path.name} row {number}: unbalanced quotes") from error
    return found


def _check_header(path: Path, number: int, header: list[str], columns: Sequence[str]) -> None:
    """Refuse a header with unknown, doubled or missing columns."""
    unknown = [name for name in header if name not in columns]
    missing = [name for name in columns if name not in header]
    where = f"{path.name} row {number}"
    problems = [
        f"{where}: unknown column {name!r}{near_matches(name, missing)}" for name in unknown
    ]
    problems += [f"{where}: column {name!r} is missing" for name in missing]
    doubled = {name for name in header if header.count(name) > 1}
    problems += [f"{where}: column {name!r} stands there twice" for name in sorted(doubled)]
    if len(header) == 1:
        problems = [
            f"{where}: no tab in this line; columns are divided by tabs: {', '.join(columns)}"
        ]
    if problems:
        raise MotionStyleError("\n".join(problems))
