"""Reading OpenSim storage files (.mot, .sto), and force plates out of them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError, near_matches
from motionstyle.mocap.formats.marker_clip import ForceRecord
from motionstyle.mocap.formats.text import Problems, number_problem, read_lines, tidy_rate, words

Array = NDArray[np.float64]
# Header keys of OpenSim ("nRows=…") and of the older SIMM motion files ("datarows …").
_ROWS, _COLUMNS = ("nrows", "datarows"), ("ncolumns", "datacolumns")
LOADED_N = 20.0  # a plate that bears less is unloaded, N
POSITION_UNITS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2}


@dataclass(frozen=True)
class MotTable:
    """A storage file: column names and values (T, C); `in_degrees` as the header says."""

    columns: tuple[str, ...]
    values: Array
    in_degrees: bool
    source: str

    @property
    def times(self) -> Array:
        """The column `time`, s."""
        return self.values[:, 0]

    def column(self, name: str) -> Array:
        """Return one column, (T,).

        Raises
        ------
        MotionStyleError
            If there is none of that name.
        """
        if name not in self.columns:
            raise MotionStyleError(
                f"{self.source}: no column '{name}'{near_matches(name, self.columns)}"
            )
        return self.values[:, self.columns.index(name)]


@dataclass(frozen=True)
class PlateColumns:
    """Names of a plate's columns without their last letter x, y or z."""

    force: str
    point: str
    moment: str


def read_mot(path: str | Path) -> MotTable:
    """Read a storage file: header up to `endheader`, column names, numbers.

    Raises
    ------
    MotionStyleError
        With every fault and its line: no `endheader`, counts of rows and columns that disagree
        with the header, doubled names, cells that are no numbers, time that does not increase.
    """
    path = Path(path)
    lines = read_lines(path, "storage (.mot, .sto)")
    problems = Problems(path)
    ends = [i for i, line in enumerate(lines) if line.strip().lower() == "endheader"]
    if not ends:
        problems.add(None, "no line 'endheader'; is this an OpenSim storage file?")
        problems.stop()
    header = _header(lines[: ends[0]])
    body = [(i, w) for i, line in enumerate(lines, 1) if i > ends[0] + 1 and (w := words(line))]
    if len(body) < 2:
        problems.add(None, "no rows follow the header")
        problems.stop()
    at, columns = body[0]
    if columns[0].lower() != "time":
        problems.add(at, f"the first column is '{columns[0]}', expected 'time'")
    for name in sorted({c for c in columns if columns.count(c) > 1}):
        problems.add(at, f"column '{name}' stands there {columns.count(name)} times")
    _check_count(header, _COLUMNS, len(columns), "column names", at, problems)
    _check_count(header, _ROWS, len(body) - 1, "rows", at, problems)
    values = np.zeros((len(body) - 1, len(columns)))
    for row, (number, cells) in enumerate(body[1:]):
        if len(cells) != len(columns):
            problems.add(number, f"{len(cells)} numbers, expected {len(columns)}")
            continue
        try:
            values[row] = cells
        except ValueError:
            values[row] = np.nan
        if not np.isfinite(values[row]).all():
            for name, cell in zip(columns, cells, strict=True):
                if fault := number_problem(cell):
                    problems.add(number, f"{name} {fault}")
    problems.stop()
    for row in np.flatnonzero(np.diff(values[:, 0]) <= 0):
        number = body[row + 2][0]
        problems.add(number, f"time {values[row + 1, 0]:g} s follows {values[row, 0]:g} s")
    problems.stop()
    degrees = header.get("indegrees", (0, "no"))[1].lower() in {"yes", "true", "1"}
    return MotTable(tuple(columns), values, degrees, str(path))


def _header(lines: list[str]) -> dict[str, tuple[int, str]]:
    """Return (line, value) by lower-case key, of `key=value` and `key value` lines."""
    header = {}
    for number, line in enumerate(lines, start=1):
        if match := re.match(r"\s*([A-Za-z]+)\s*[= \t]\s*(\S.*?)\s*$", line):
            header.setdefault(match[1].lower(), (number, match[2]))
    return header


def _check_count(
    header: Mapping[str, tuple[int, str]],
    keys: tuple[str, ...],
    found: int,
    what: str,
    line: int,
    problems: Problems,
) -> None:
    said = next((header[key] for key in keys if key in header), None)
    if said is None:
        problems.add(line, f"the header does not say how many {what} there are ({keys[0]}=)")
    elif number_problem(said[1]) or float(said[1]) != found:
        problems.add(said[0], f"the header says {said[1]} {what}, but {found} follow")


def forces_from_mot(
    table: MotTable, plates: Mapping[str, PlateColumns], *, position_unit: str = "m"
) -> ForceRecord:
    """Return the plates of a storage file.

    Parameters
    ----------
    plates : columns by plate name.
    position_unit : "m" or "mm"; moments are then in N·m or N·mm.

    Raises
    ------
    MotionStyleError
        Naming every column that is not there; for unsteady sampling; if the vertical force of a
        plate is negative on average, see `check_signs`.
    """
    wanted = [
        prefix + axis
        for plate in plates.values()
        for prefix in (plate.force, plate.point, plate.moment)
        for axis in "xyz"
    ]
    missing = [name for name in wanted if name not in table.columns]
    if missing:
        named = ", ".join(f"'{m}'{near_matches(m, table.columns, 1)}" for m in missing)
        raise MotionStyleError(f"{table.source}: lacks the force columns {named}")
    scale = POSITION_UNITS[position_unit]

    def read(kind: str, factor: float) -> Array:
        return factor * np.stack(
            [
                np.stack([table.column(getattr(p, kind) + axis) for axis in "xyz"], axis=-1)
                for p in plates.values()
            ]
        )

    force = read("force", 1.0)
    centre = np.where(np.abs(force[..., 1:2]) > LOADED_N, read("point", scale), np.nan)
    steps = np.diff(table.times)
    step = (table.times[-1] - table.times[0]) / len(steps)
    if np.abs(steps - step).max() > 0.5 * step:
        row = int(np.argmax(np.abs(steps - step)))
        raise MotionStyleError(
            f"{table.source}: uneven sampling at {table.times[row]:g} s "
            f"({steps[row]:g} s to the next row, {step:g} s elsewhere)"
        )
    record = ForceRecord(
        names=tuple(plates),
        force=force,
        centre=centre,
        moment=read("moment", scale),
        rate_hz=tidy_rate(1.0 / step),
        source=table.source,
        start_s=float(table.times[0]),
    )
    check_signs(record, 1)
    return record


def check_signs(record: ForceRecord, up: int) -> None:
    """Refuse plates that pull the person down: `up` is the index of the vertical axis.

    Raises
    ------
    MotionStyleError
        Naming every plate whose mean vertical force is negative while it is loaded.
    """
    flipped = []
    for name, force in zip(record.names, record.force, strict=True):
        loaded = np.abs(force[:, up]) > LOADED_N
        mean = force[loaded, up].mean() if loaded.any() else 0.0
        if mean < 0:
            flipped.append(f"'{name}' ({mean:.0f} N)")
    if flipped:
        raise MotionStyleError(
            f"{record.source}: mean vertical force is negative on plate {', '.join(flipped)}; "
            "expected the force on the person, upward: flip the sign of all three force components"
        )
