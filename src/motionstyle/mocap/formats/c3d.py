"""Reading C3D files through ezc3d: marker paths and force plates."""

from __future__ import annotations

import struct
from collections import Counter
from pathlib import Path
from typing import Any

import ezc3d
import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError
from motionstyle.mocap.formats.marker_clip import ForceRecord, MarkerClip
from motionstyle.mocap.formats.mot import LOADED_N, check_signs
from motionstyle.mocap.formats.text import Problems, tidy_rate
from motionstyle.mocap.formats.trc import UNITS

Array = NDArray[np.float64]
_BLOCK, _MIPS = 512, 86  # bytes of a block of the file; processor type with the other byte order
FORCE_UNITS = {"N": 1.0, "kN": 1000.0}
MOMENT_UNITS = {"Nmm": 1e-3, "Nm": 1.0, "Ncm": 1e-2}
_UP = 2  # C3D laboratories measure height along z


def _open(path: Path, *, plates: bool) -> Any:  # noqa: ANN401 (ezc3d has no types)
    """Open a C3D file.

    Raises
    ------
    MotionStyleError
        If the file cannot be read or ezc3d refuses it.
    """
    try:
        start = _first_bytes(path)
    except OSError as error:
        raise MotionStyleError(
            f"{path}: cannot read this C3D file ({error.strerror or error})"
        ) from error
    if len(start) < 2 or start[1] != 0x50:
        raise MotionStyleError(f"{path}: not a C3D file (its second byte is not 0x50)")
    try:
        file = ezc3d.c3d(str(path), extract_forceplat_data=plates)
    except Exception as error:
        raise MotionStyleError(f"{path}: ezc3d cannot read this C3D file: {error}") from error
    declared, found = _declared_frames(path, start), file["data"]["points"].shape[2]
    if declared is not None and declared > found:
        raise MotionStyleError(
            f"{path}: its header declares {declared} frames, but {found} follow; is the file cut "
            "off? Copy it again"
        )
    return file


def _first_bytes(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(_BLOCK)


def _declared_frames(path: Path, header: bytes) -> int | None:
    """Return how many frames the header declares; None where it cannot hold their number.

    ezc3d reads a file that ends too early as if it had been shorter, and says so nowhere.
    """
    with path.open("rb") as file:
        file.seek((header[0] - 1) * _BLOCK + 3)
        processor = file.read(1)
    order = ">" if processor == bytes([_MIPS]) else "<"
    first, last = struct.unpack(f"{order}HH", header[6:10])
    return last - first + 1 if 0 < first <= last < 0xFFFF else None


def _parameter(file: Any, group: str, name: str, default: object = None) -> Any:  # noqa: ANN401
    """Return the value of a parameter, or the default where the file has none."""
    found = file["parameters"].get(group, {})
    if name not in found:
        return default
    value = found[name]["value"]
    return default if len(value) == 0 else value


def read_c3d(path: str | Path) -> MarkerClip:
    """Read the markers of a C3D file.

    Points that were not seen (negative residual, or exactly at the origin) are NaN. A prefix
    that all labels share ("Subject:LASI") is dropped. Points that share a label go by their
    descriptions instead.

    Returns
    -------
    MarkerClip
        In metres by POINT:UNITS, in the file's axes (as a rule z up). Outputs of models among
        the points are kept: a marker set leaves them out by their labels.

    Raises
    ------
    MotionStyleError
        If the file is no C3D file, has no points or no known unit or rate, or if labels are
        doubled and descriptions do not tell the points apart.
    """
    path = Path(path)
    file = _open(path, plates=False)
    problems = Problems(path)
    points = np.asarray(file["data"]["points"], dtype=float)[:3].transpose(2, 1, 0)
    if not points.size:
        problems.add(None, "the file has no points")
        problems.stop()
    labels = _labels(file, points.shape[1], problems)
    unit = str(_parameter(file, "POINT", "UNITS", [""])[0]).strip()
    if unit not in UNITS:
        problems.add(None, f"POINT:UNITS is {unit!r}, expected one of {', '.join(UNITS)}")
    rate = float(_parameter(file, "POINT", "RATE", [0.0])[0])
    if not rate > 0:
        problems.add(None, f"POINT:RATE is {rate}, expected frames per second above 0")
    problems.stop()
    residuals = np.asarray(file["data"]["meta_points"]["residuals"], dtype=float)
    unseen = np.isnan(points).any(axis=-1) | (points == 0).all(axis=-1)
    if residuals.shape[-2:] == points.shape[1::-1]:
        unseen |= residuals.reshape(points.shape[1], points.shape[0]).T < 0
    points[unseen] = np.nan
    return MarkerClip(labels, points * UNITS[unit], tidy_rate(rate), str(path), 0.0, unit)


def _labels(file: Any, count: int, problems: Problems) -> tuple[str, ...]:  # noqa: ANN401
    labels = [str(label).strip() for label in _parameter(file, "POINT", "LABELS", [])]
    if len(labels) < count:
        problems.add(None, f"{count} points, but POINT:LABELS names {len(labels)}")
        return tuple(labels)
    labels = labels[:count]
    prefixes = {label.split(":")[0] if ":" in label else None for label in labels}
    if len(prefixes) == 1 and None not in prefixes:
        labels = [label.split(":", 1)[1] for label in labels]
    texts = [str(text).strip() for text in _parameter(file, "POINT", "DESCRIPTIONS", [])]
    texts += [""] * (count - len(texts))
    doubled = {label for label, number in Counter(labels).items() if number > 1}
    names = [
        text if label in doubled and text else label
        for label, text in zip(labels, texts, strict=False)
    ]
    for name, number in sorted(Counter(names).items()):
        if number > 1:
            problems.add(
                None, f"label {name!r} stands for {number} points, and their descriptions agree"
            )
    return tuple(names)


def read_c3d_forces(path: str | Path) -> ForceRecord | None:
    """Read the force plates of a C3D file: forces on the person, in the file's axes.

    ezc3d turns channels into forces by the plate's type and corners (types 1 to 4).

    Returns
    -------
    ForceRecord
        Plates named "1", "2", …; the free moment is about the vertical through the centre of
        pressure. None if the file has no plates.

    Raises
    ------
    MotionStyleError
        If the file is no C3D file, a plate has an unknown unit, or a plate's mean vertical force
        is negative.
    """
    path = Path(path)
    file = _open(path, plates=True)
    plates = file["data"]["platform"]
    if not plates:
        return None
    problems = Problems(path)
    for number, plate in enumerate(plates, start=1):
        for kind, known in (
            ("unit_force", FORCE_UNITS),
            ("unit_moment", MOMENT_UNITS),
            ("unit_position", UNITS),
        ):
            if plate[kind] not in known:
                expected = ", ".join(known)
                problems.add(
                    None, f"plate {number}: {kind} is {plate[kind]!r}, expected {expected}"
                )
    problems.stop()

    def read(kind: str, unit: str, known: dict[str, float]) -> Array:
        paths = [np.asarray(p[kind], dtype=float).T * known[p[unit]] for p in plates]
        return np.stack(paths)

    force = read("force", "unit_force", FORCE_UNITS)
    centre = read("center_of_pressure", "unit_position", UNITS)
    loaded = np.abs(force[..., _UP : _UP + 1]) > LOADED_N
    rate = float(_parameter(file, "ANALOG", "RATE", [0.0])[0])
    record = ForceRecord(
        names=tuple(str(k + 1) for k in range(len(plates))),
        force=force,
        centre=np.where(loaded, centre, np.nan),
        moment=np.where(loaded, read("Tz", "unit_moment", MOMENT_UNITS), 0.0),
        rate_hz=tidy_rate(rate),
        source=str(path),
        corners=read("corners", "unit_position", UNITS),
    )
    check_signs(record, _UP)
    return record


def body_mass(path: str | Path) -> float | None:
    """Return the body mass a C3D file states (PROCESSING:Bodymass), kg, or None."""
    value = _parameter(_open(Path(path), plates=False), "PROCESSING", "Bodymass")
    return None if value is None else float(value[0])
