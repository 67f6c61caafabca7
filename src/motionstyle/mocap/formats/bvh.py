"""Read BVH files strictly.

Why an own parser: pybvh 0.9 models neither position channels off the root (every joint of the
Bandai Namco clips has them) nor joints with other than three rotation channels, and it accepts
NaN, unclosed blocks and repeated names. It serves as an independent oracle in the tests.
"""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionstyle.mocap.formats.bvh_hierarchy import HierarchyJoint, read_hierarchy
from motionstyle.mocap.formats.clip import SkeletonClip, forward_kinematics
from motionstyle.mocap.formats.text import (
    Problems,
    axis_rotation,
    number_problem,
    parse_number,
    read_lines,
    tidy_rate,
    words,
)

_SLOWEST_FRAME_S = 1.0


def read_bvh(path: str | Path) -> SkeletonClip:
    """Read a BVH file; every fault in it is reported at once.

    Position channels may stand on any joint and replace its OFFSET, component by component.
    Rotations are applied in the order the channels are written. An End Site becomes the joint
    `<parent>_end`; where that name is taken (a joint so named, or a second End Site),
    `<parent>_end2`, `_end3`, ... is the first free one. Keywords and channel names are read in
    any case; joint names may hold spaces and any letters (UTF-8 or Latin-1). A frame time
    within 0.01 % of 1/N seconds, as the usual 0.008333, is read as exactly N frames a second.

    Parameters
    ----------
    path : the file.

    Returns
    -------
    SkeletonClip
        Positions and offsets in the units of the file (the caller scales), rotations as
        matrices, rate in Hz.

    Raises
    ------
    MotionStyleError
        For a file that cannot be read or has any fault; the message lists all of them with
        line, joint and column.
    """
    path = Path(path)
    lines = read_lines(path, "BVH")
    problems = Problems(path)
    motion = next(
        (at for at, line in enumerate(lines) if line.strip(" \t").upper() == "MOTION"), len(lines)
    )
    if not any(line.strip() for line in lines):
        problems.add(None, "the file is empty")
        problems.stop()
    skeleton = read_hierarchy(lines[:motion], problems)
    if motion == len(lines):
        problems.add(len(lines), "no MOTION section: the file holds no more than a hierarchy")
        problems.stop()
    frames, frame_time, first = _motion_header(lines, motion, problems)
    columns = [f"{joint.name} {name}" for joint in skeleton for name in joint.columns]
    values = _motion_rows(lines, first, frames, columns, problems)
    problems.stop()
    return _clip(skeleton, values, tidy_rate(1.0 / frame_time), str(path))


def _motion_header(lines: list[str], motion: int, problems: Problems) -> tuple[int, float, int]:
    """Read `Frames:` and `Frame Time:`; return them and the index of the first row."""
    frames, frame_time, at = 0, 0.0, motion + 1
    seen: set[str] = set()
    while at < len(lines):
        found = re.match(
            r"[ \t]*(frames|frame[ \t]+time)[ \t]*:?[ \t]*(.*?)[ \t]*$", lines[at], re.I
        )
        if not found and lines[at].strip():
            break
        if found:
            value, number = found[2], at + 1
            key = "Frames" if found[1].lower() == "frames" else "Frame Time"
            if key in seen:
                problems.add(number, f"a second '{key}:' line")
            seen.add(key)
            if key == "Frames":
                frames = int(value) if re.fullmatch(r"\+?[0-9]{1,9}", value) else 0
                if frames <= 0:
                    problems.add(number, f"'Frames:' is {value!r}, expected a whole number above 0")
            else:
                fault = number_problem(value)
                frame_time = 0.0 if fault else parse_number(value)
                if fault:
                    problems.add(number, f"'Frame Time:' {fault}")
                elif not 0.0 < frame_time <= _SLOWEST_FRAME_S:
                    problems.add(
                        number,
                        f"'Frame Time:' is {value}, expected the seconds between frames, "
                        f"above 0 and at most {_SLOWEST_FRAME_S:g}",
                    )
        at += 1
    for key in ("Frames", "Frame Time"):
        if key not in seen:
            problems.add(motion + 1, f"no '{key}:' line after MOTION")
    return frames, frame_time, at


def _motion_rows(
    lines: list[str], first: int, frames: int, columns: list[str], problems: Problems
) -> NDArray[np.float64]:
    """Read the motion rows, (frames, columns); report every faulty row and value."""
    rows = [at for at in range(first, len(lines)) if lines[at].strip(" \t")]
    if frames > 0 and len(rows) != frames:
        problems.add(None, f"'Frames:' declares {frames} rows, the MOTION section has {len(rows)}")
    try:
        values = (
            np.loadtxt(io.StringIO("\n".join(lines[at] for at in rows)), ndmin=2, comments=None)
            if rows
            else np.zeros((0, len(columns)))
        )
        if values.shape == (len(rows), len(columns)) and np.isfinite(values).all():
            return values
    except ValueError:
        pass  # the rows are gone through one by one to say where
    split = [words(lines[at]) for at in rows]
    counts = {len(row) for row in split}
    if len(counts) == 1 and len(rows) > 1 and counts != {len(columns)}:
        problems.add(
            rows[0] + 1,
            f"each of the {len(rows)} rows has {counts.pop()} values, "
            f"the hierarchy declares {len(columns)} channels",
        )
        counts.add(-1)
    for frame, (at, row) in enumerate(zip(rows, split, strict=True)):
        if len(row) != len(columns) and -1 not in counts:
            problems.add(at + 1, f"frame {frame} has {len(row)} values, expected {len(columns)}")
        for column, value in enumerate(row):
            fault = number_problem(value)
            if fault:
                name = columns[column] if column < len(columns) else "beyond the last channel"
                problems.add(at + 1, f"frame {frame}, column {column + 1} ({name}) {fault}")
    return np.zeros((0, len(columns)))


def _clip(
    joints: list[HierarchyJoint], values: NDArray[np.float64], rate_hz: float, source: str
) -> SkeletonClip:
    """Turn channel values into joint transforms and chain them."""
    parents = np.array([joint.parent for joint in joints], dtype=np.int64)
    offsets = np.array([joint.offset for joint in joints])
    positions = np.tile(offsets, (len(values), 1, 1))
    rotations = np.tile(np.eye(3), (len(values), len(joints), 1, 1))
    column = 0
    for at, joint in enumerate(joints):
        for kind, axis in joint.channels or ():
            if kind == "position":
                positions[:, at, axis] = values[:, column]
            else:
                turn = axis_rotation(axis, np.radians(values[:, column]))
                rotations[:, at] = rotations[:, at] @ turn
            column += 1
    positions, rotations = forward_kinematics(parents, positions, rotations)
    names = tuple(joint.name for joint in joints)
    return SkeletonClip(names, parents, offsets, positions, rotations, rate_hz, source)
