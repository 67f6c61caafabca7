"""CSV tables that are the same bytes on every system: the form of all of `tables/*.csv`.

UTF-8, a header line always, line feeds, decimal points; text is quoted only where it must be.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Mapping, Sequence
from numbers import Integral, Real
from pathlib import Path

import numpy as np

from motionstyle.errors import MotionStyleError
from motionstyle.files import atomic_write


def format_cell(value: object) -> str:
    """Return a value as the text of a cell.

    None and NaN are empty, truth values `yes` or `no`, whole numbers exact, other numbers the
    shortest text of at most 6 significant digits (`inf`, `-inf` if infinite; no negative zero).

    Raises
    ------
    TypeError
        If the value is none of these and no text.
    """
    if value is None:
        return ""
    if isinstance(value, str):
        return value
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    if isinstance(value, Integral):
        return str(int(value))
    if isinstance(value, Real):
        number = float(value)
        return "" if math.isnan(number) else f"{number + 0.0:.6g}"
    raise TypeError(f"a table cell cannot hold {type(value).__name__}")


def plain(row: Mapping[str, object]) -> dict[str, object]:
    """Return a row whose NumPy numbers are Python's, so that it can be written as JSON."""
    return {k: v.item() if isinstance(v, np.generic) else v for k, v in row.items()}


def _quoted(text: str) -> str:
    """Quote a cell that holds a comma, a quotation mark or a line break."""
    return '"' + text.replace('"', '""') + '"' if any(c in text for c in ',"\r\n') else text


def _line(cells: Sequence[str]) -> str:
    """Return one line; a single empty cell is written `""`, for a blank line would be no row."""
    return (",".join(map(_quoted, cells)) if cells != [""] else '""') + "\n"


def write_table(
    path: str | Path, columns: Sequence[str], rows: Iterable[Mapping[str, object]]
) -> None:
    """Write a CSV table atomically.

    Parameters
    ----------
    path : the file.
    columns : names of the columns, in order; the header is written even if there are no rows.
    rows : values by column, see `format_cell`; an absent key is an empty cell.

    Raises
    ------
    ValueError
        If a column is named twice or a row has a key that is no column.
    """
    columns = list(columns)
    if not columns or len(set(columns)) != len(columns):
        raise ValueError(f"{path}: the columns must be named, each once, found {columns}")
    with atomic_write(path) as handle:
        handle.write(_line(columns))
        for row in rows:
            if unknown := sorted(set(row) - set(columns)):
                raise ValueError(f"{path}: {', '.join(unknown)} is no column of this table")
            handle.write(_line([format_cell(row.get(column)) for column in columns]))


def read_table(path: str | Path) -> list[dict[str, str]]:
    """Read a CSV table; every cell stays text.

    Raises
    ------
    MotionStyleError
        If the file cannot be read, has no header or names a column twice, or a row does not have
        as many cells as there are columns.
    """
    path = Path(path)
    try:
        with path.open(encoding="utf-8-sig", newline="") as handle:
            reader = csv.reader(handle, strict=True)
            header = next(reader, [])
            if not header or len(set(header)) != len(header):
                raise MotionStyleError(
                    f"{path}: line 1 must name the columns, each once, found {header}"
                )
            rows = []
            for cells in reader:
                if cells and len(cells) != len(header):
                    raise MotionStyleError(
                        f"{path}: line {reader.line_num} has {len(cells)} cells, "
                        f"expected {len(header)}"
                    )
                if cells:
                    rows.append(dict(zip(header, cells, strict=True)))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise MotionStyleError(f"{path}: not a readable table ({error})") from error
    return rows
