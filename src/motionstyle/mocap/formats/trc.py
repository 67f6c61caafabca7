"""Reading TRC marker files (Motion Analysis, OpenSim): a header of five lines, then one a frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import near_matches
from motionstyle.mocap.formats.marker_clip import MarkerClip
from motionstyle.mocap.formats.text import Problems, number_problem, read_lines, tidy_rate

UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "inch": 0.0254, "in": 0.0254}
HEADER_KEYS = ("DataRate", "NumFrames", "NumMarkers", "Units")
_FIRST_FRAME_LINE = 5  # index of the first line that may hold a frame


def read_trc(path: str | Path) -> MarkerClip:
    """Read a TRC file.

    Doubled tabs in the header (empty cells), empty cells for samples that were not seen, numbers
    with exponents and CRLF line ends are understood.

    Returns
    -------
    MarkerClip
        Positions in metres by the header's unit, in the file's axes; NaN where cells are empty or
        the marker stands exactly at the origin.

    Raises
    ------
    MotionStyleError
        With every fault of the file and its line: a header without rate, unit, counts or names,
        counts that disagree with the data, rows of the wrong length, cells that are no numbers,
        frame times that do not fit the rate.
    """
    path = Path(path)
    lines = read_lines(path, "TRC")
    problems = Problems(path)
    header = _header(lines, problems)
    labels = _labels(lines, problems)
    problems.stop()
    rate, unit = float(header["DataRate"]), header["Units"].lower()
    times, positions, numbers = _frames(lines, labels, problems)
    for key, found, what in (
        ("NumMarkers", len(labels), "markers are named in line 4"),
        ("NumFrames", len(positions), "frames follow"),
    ):
        said = header[key]
        if number_problem(said) or float(said) != found:
            problems.add(3, f"{key} is {said}, but {found} {what}")
    if not len(positions):
        problems.add(None, "the file has no frames")
    problems.stop()
    late = np.flatnonzero(np.abs(np.diff(times) * rate - 1.0) > 0.2)
    for frame in late:
        problems.add(
            numbers[frame + 1],
            f"time {times[frame + 1]:g} s follows {times[frame]:g} s, "
            f"expected steps of {1 / rate:.5g} s at DataRate {rate:g} Hz",
        )
    problems.stop()
    positions[(positions == 0).all(axis=-1)] = np.nan  # how some exporters write a missing sample
    return MarkerClip(
        labels=labels,
        positions=positions * UNITS[unit],
        rate_hz=tidy_rate(rate),
        source=str(path),
        start_s=float(times[0]),
        unit=unit,
    )


def _cells(line: str) -> list[str]:
    """Return the stripped cells of a line; a tab at its end makes no cell."""
    cells = [cell.strip() for cell in line.split("\t")]
    while cells and not cells[-1]:
        cells.pop()
    return cells


def _header(lines: list[str], problems: Problems) -> dict[str, str]:
    """Return the header's values by key; cells that doubled tabs leave empty are passed over."""
    if not lines or not lines[0].strip().startswith("PathFileType"):
        found = lines[0].strip()[:40] if lines else ""
        problems.add(1, f"begins with {found!r}, expected 'PathFileType'; is this a TRC file?")
        problems.stop()
    if len(lines) < _FIRST_FRAME_LINE:
        problems.add(len(lines), "the file ends within its header of five lines")
        problems.stop()
    keys = [cell for cell in _cells(lines[1]) if cell]
    values = [cell for cell in _cells(lines[2]) if cell]
    if len(values) != len(keys):
        problems.add(3, f"{len(values)} values for the {len(keys)} names in line 2")
    header = dict(zip(keys, values, strict=False))
    for key in HEADER_KEYS:
        if key not in header:
            problems.add(2, f"lacks {key}{near_matches(key, keys)}")
    rate = header.get("DataRate", "1")
    if number_problem(rate) or not float(rate) > 0:
        problems.add(3, f"DataRate is {rate}, expected frames per second above 0")
    unit = header.get("Units", "m")
    if unit.lower() not in UNITS:
        near = near_matches(unit, list(UNITS))
        problems.add(3, f"Units is {unit!r}, expected one of {', '.join(UNITS)}{near}")
    return header


def _labels(lines: list[str], problems: Problems) -> tuple[str, ...]:
    cells = _cells(lines[3])
    if [cell.rstrip("s") for cell in cells[:2]] != ["Frame#", "Time"]:
        problems.add(4, f"begins with {' '.join(cells[:2])!r}, expected 'Frame#' and 'Time'")
    labels = tuple(cell for cell in cells[2:] if cell)
    if not labels:
        problems.add(4, "names no markers")
    for label in sorted({name for name in labels if labels.count(name) > 1}):
        problems.add(4, f"names marker {label!r} {labels.count(label)} times, expected once")
    return labels


def _frames(
    lines: list[str], labels: tuple[str, ...], problems: Problems
) -> tuple[NDArray[np.float64], NDArray[np.float64], list[int]]:
    """Return times (F,), positions (F, M, 3) in the file's unit and line numbers."""
    times: list[float] = []
    rows: list[list[float]] = []
    numbers: list[int] = []
    width = 2 + 3 * len(labels)
    for number, line in enumerate(lines[_FIRST_FRAME_LINE:], start=_FIRST_FRAME_LINE + 1):
        if not line.strip():
            continue
        cells = [cell.strip() for cell in line.split("\t")]
        if any(cells[width:]):
            problems.add(number, f"{len(cells)} cells, expected {width} (frame, time, 3 a marker)")
            continue
        cells = cells[:width]
        if len(cells) < width:
            if len(cells) < width - 3:
                problems.add(number, f"{len(cells)} cells, expected {width}; is the line cut off?")
                continue
            cells += [""] * (width - len(cells))
        if fault := number_problem(cells[1]):
            problems.add(number, f"time {fault}")
            continue
        times.append(float(cells[1]))
        rows.append(_row(cells[2:], labels, number, problems))
        numbers.append(number)
    return np.array(times), np.array(rows).reshape(len(rows), len(labels), 3), numbers


def _row(cells: list[str], labels: tuple[str, ...], number: int, problems: Problems) -> list[float]:
    """Return the numbers of a frame, NaN for empty cells and for `nan`."""
    values = []
    for at, cell in enumerate(cells):
        if not cell or cell.lower() == "nan":
            values.append(np.nan)
            continue
        try:
            value = float(cell)
        except ValueError:
            value = np.inf
        if not np.isfinite(value):
            problems.add(number, f"{labels[at // 3]} {'xyz'[at % 3]} {number_problem(cell)}")
            value = 0.0
        values.append(value)
    for at, label in enumerate(labels):
        seen = np.isfinite(values[3 * at : 3 * at + 3])
        if seen.any() and not seen.all():
            problems.add(number, f"{label} has {int(seen.sum())} of its 3 coordinates")
    return values
