"""Read DeepMimic motions: JSON frames on the humanoid of its URDF file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from motionstyle.errors import MotionStyleError
from motionstyle.mocap.formats.clip import SkeletonClip, forward_kinematics
from motionstyle.mocap.formats.deepmimic_skeleton import LAYOUT, Humanoid, read_humanoid
from motionstyle.mocap.formats.text import Problems

_VALUES = 8 + sum(width for _, width in LAYOUT)
_COLUMNS = (
    "duration",
    *(f"root {axis}" for axis in "xyz"),
    *(f"root q{part}" for part in "wxyz"),
    *(
        f"{name} q{part}" if width == 4 else f"{name} angle"
        for name, width in LAYOUT
        for part in "wxyz"[:width]
    ),
)
_NORM_TOLERANCE = 0.5
_ROOT_SEAM = np.radians(45.0)


def read_deepmimic(
    path: str | Path,
    urdf_path: str | Path,
    *,
    rate_hz: float | None = None,
    cycles: int = 1,
    norm_tolerance: float = _NORM_TOLERANCE,
) -> SkeletonClip:
    """Read a DeepMimic clip and resample it to a uniform rate.

    Every frame lasts its own duration; as in the simulator, the last frame ends the clip and
    its duration does not count. Positions are interpolated linearly and rotations along the
    shortest arc, which also undoes sign changes of the quaternions. The published clips hold
    hand-edited quaternions far from unit length (10 of the 15 by more than 0.001, 0.58 at
    worst), which the simulator normalises; so does this reader, within `norm_tolerance`.

    Parameters
    ----------
    path : the JSON file, `{"Loop": "wrap" | "none", "Frames": [[44 numbers], ...]}`.
    urdf_path : the humanoid's URDF file, whose lengths times 0.25 are metres.
    rate_hz : rate to resample to; by default one over the median duration, rounded to a whole
        number if that is within 1 %.
    cycles : how often a clip with Loop "wrap" is run through. Each repeat is displaced by last
        minus first root position in the horizontal plane; its first frame takes the place of
        the last frame of the one before.
    norm_tolerance : how far a quaternion's length may be from 1.

    Returns
    -------
    SkeletonClip
        In metres, y up, x forward at zero pose. End joints: `<side>_ankle_heel_end` and
        `<side>_ankle_toe_end` (bottom back and front edge of the foot box), `neck_end` (top of
        the head sphere) and `<side>_elbow_end` (wrist).

    Raises
    ------
    MotionStyleError
        For a file that cannot be read or has any fault, which are reported together with frame
        and column; for `cycles` above 1 on a clip that does not wrap or whose root turns by
        more than 45 degrees between first and last frame; for a bad `rate_hz` or `cycles`.
    """
    path = Path(path)
    humanoid = read_humanoid(urdf_path)
    loop, rows = _rows(path, norm_tolerance)
    if isinstance(cycles, bool) or not isinstance(cycles, int) or cycles < 1:
        raise MotionStyleError(f"{path}: cycles is {cycles!r}, expected a whole number from 1")
    nominal = _nominal_rate(rows[:-1, 0])
    rate = nominal if rate_hz is None else float(rate_hz)
    if not (np.isfinite(rate) and rate > 0):
        raise MotionStyleError(f"{path}: rate_hz is {rate_hz}, expected frames per second above 0")
    durations = rows[:-1, 0]
    durations = np.where(np.abs(durations * nominal - 1.0) < 2e-3, 1.0 / nominal, durations)
    root, turns = rows[:, 1:4], _local_rotations(rows)
    if cycles > 1:
        _check_seam(path, loop, turns[:, 0])
        root, turns = _close_seam(root, turns)
        root, turns, durations = _unroll(root, turns, durations, cycles)
    times = np.concatenate([[0.0], np.cumsum(durations)])
    root, turns = _resample(times, root, turns, rate)
    return _clip(humanoid, root, turns, rate, str(path))


def _rows(path: Path, norm_tolerance: float) -> tuple[str, NDArray[np.float64]]:
    """Read and check the JSON file; return Loop and the frames, (F, 44)."""
    document = _document(path)
    problems = Problems(path)
    if not isinstance(document, dict):
        problems.add(None, "expected a JSON object with Loop and Frames")
        problems.stop()
    loop, frames = document.get("Loop"), document.get("Frames")
    if loop not in ("wrap", "none"):
        problems.add(None, f"Loop is {loop!r}, expected 'wrap' or 'none'")
    if not isinstance(frames, list) or len(frames) < 2:
        count = f"{len(frames)} frames" if isinstance(frames, list) else "no list"
        problems.add(None, f"Frames holds {count}, expected at least 2 frames")
        problems.stop()
    for at, row in enumerate(frames):
        _check_row(at, row, problems)
    problems.stop()
    rows = np.array(frames, dtype=np.float64)
    _check_durations(rows[:, 0], problems)
    for name, columns in _quaternions():
        size = np.linalg.norm(rows[:, columns], axis=1)
        for at in np.flatnonzero(np.abs(size - 1.0) > norm_tolerance):
            problems.add(
                None,
                f"frame {at}, {name}: quaternion of length {size[at]:.4g}, "
                f"expected 1 within {norm_tolerance:g}",
            )
    problems.stop()
    return loop, rows


def _check_row(at: int, row: object, problems: Problems) -> None:
    """Note a frame of the wrong length and values that are no finite numbers."""
    if not isinstance(row, list) or len(row) != _VALUES:
        size = f"{len(row)} values" if isinstance(row, list) else "no list of values"
        problems.add(None, f"frame {at} has {size}, expected {_VALUES}")
        return
    for name, value in zip(_COLUMNS, row, strict=True):
        if isinstance(value, bool) or not isinstance(value, int | float):
            problems.add(None, f"frame {at}, {name}: {value!r}, expected a number")
        elif not -1e300 < value < 1e300:
            problems.add(None, f"frame {at}, {name}: {value}, expected a finite number")


def _check_durations(durations: NDArray[np.float64], problems: Problems) -> None:
    """Note negative durations and zero ones before the last frame."""
    if not durations[:-1].any():
        problems.add(None, "the durations add up to 0")
        return
    for at in np.flatnonzero((durations <= 0) & (np.arange(len(durations)) < len(durations) - 1)):
        problems.add(None, f"frame {at}, duration: {durations[at]:g}, expected above 0")
    if durations[-1] < 0:
        problems.add(None, f"last frame, duration: {durations[-1]:g}, expected 0 or more")


def _document(path: Path) -> Any:  # noqa: ANN401 - whatever the JSON holds
    """Parse the JSON file."""
    try:
        return json.loads(path.read_bytes())
    except OSError as error:
        raise MotionStyleError(f"{path}: cannot read this file ({error.strerror})") from error
    except json.JSONDecodeError as error:
        raise MotionStyleError(
            f"{path}: line {error.lineno}, column {error.colno}: not valid JSON ({error.msg})"
        ) from error
    except (UnicodeDecodeError, RecursionError) as error:
        raise MotionStyleError(f"{path}: not a JSON text file") from error


def _quaternions() -> list[tuple[str, slice]]:
    """Return the names and columns of all quaternions, the root's first."""
    found, column = [("root", slice(4, 8))], 8
    for name, width in LAYOUT:
        if width == 4:
            found.append((name, slice(column, column + 4)))
        column += width
    return found


def _local_rotations(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return each joint's turn against its parent, root first: quaternions (F, J, 4), w last."""
    quaternions, column = [rows[:, [5, 6, 7, 4]]], 8
    for _, width in LAYOUT:
        if width == 4:
            quaternions.append(rows[:, [column + 1, column + 2, column + 3, column]])
        else:
            half = rows[:, column] / 2.0
            zero = np.zeros_like(half)
            quaternions.append(np.stack([zero, zero, np.sin(half), np.cos(half)], axis=-1))
        column += width
    return np.stack(quaternions, axis=1)


def _nominal_rate(durations: NDArray[np.float64]) -> float:
    """Return one over the median duration, Hz, as a whole number where it is within 1 % of it."""
    rate = 1.0 / float(np.median(durations))
    whole = float(round(rate))
    return whole if whole and abs(rate / whole - 1.0) < 0.01 else rate


def _check_seam(path: Path, loop: str, root: NDArray[np.float64]) -> None:
    """Refuse to repeat a clip that does not wrap; root quaternions are (F, 4)."""
    if loop != "wrap":
        raise MotionStyleError(f"{path}: Loop is '{loop}'; a clip that does not wrap has 1 cycle")
    ends = Rotation.from_quat(root[[0, -1]])
    turn = (ends[0].inv() * ends[1]).magnitude()
    if turn > _ROOT_SEAM:
        raise MotionStyleError(
            f"{path}: the root turns by {np.degrees(turn):.0f} degrees from the first to the last "
            "frame; repeats are displaced but not turned, so this clip has 1 cycle"
        )


def _close_seam(
    root: NDArray[np.float64], quaternions: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Let the last frame meet the first, so that repeats do not jump where they join.

    The published cycles do not quite close (28° at the walk's shoulder). Half of each joint's
    turn between last and first frame is spread over the last quarter of the cycle, the other
    half, backwards, over the first quarter, with smooth weights; the root's height likewise.
    """
    phase = np.linspace(0.0, 1.0, len(root))
    fade = np.clip(4.0 * np.abs(phase - 0.5) - 1.0, 0.0, 1.0)
    weight = 0.5 * np.sign(phase - 0.5) * fade**2 * (3.0 - 2.0 * fade)
    closed = np.array(quaternions)
    for joint in range(quaternions.shape[1]):
        turns = Rotation.from_quat(quaternions[:, joint])
        gap = (turns[0] * turns[-1].inv()).as_rotvec()
        closed[:, joint] = (Rotation.from_rotvec(weight[:, None] * gap) * turns).as_quat()
    raised = np.array(root)
    raised[:, 1] += weight * (root[0, 1] - root[-1, 1])
    return raised, closed


def _unroll(
    root: NDArray[np.float64],
    quaternions: NDArray[np.float64],
    durations: NDArray[np.float64],
    cycles: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Repeat a wrapping clip; a repeat's first frame replaces the last one before it."""
    step = (root[-1] - root[0]) * [1.0, 0.0, 1.0]
    roots = [root[:-1] + cycle * step for cycle in range(cycles)]
    roots.append(root[-1:] + (cycles - 1) * step)
    turns = [*([quaternions[:-1]] * cycles), quaternions[-1:]]
    return np.concatenate(roots), np.concatenate(turns), np.tile(durations, cycles)


def _resample(
    times: NDArray[np.float64],
    root: NDArray[np.float64],
    quaternions: NDArray[np.float64],
    rate_hz: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return root positions (F, 3) and local rotations (F, J, 3, 3) at a uniform rate."""
    count = int(np.floor(times[-1] * rate_hz + 1e-6)) + 1
    if count < 2:
        raise MotionStyleError(
            f"{rate_hz:g} Hz is too low a rate for a clip of {times[-1]:.3g} s: it leaves one frame"
        )
    grid = np.minimum(np.arange(count) / rate_hz, times[-1])
    positions = np.stack([np.interp(grid, times, root[:, axis]) for axis in range(3)], axis=-1)
    rotations = [
        Slerp(times, Rotation.from_quat(quaternions[:, joint]))(grid).as_matrix()
        for joint in range(quaternions.shape[1])
    ]
    return positions, np.stack(rotations, axis=1)


def _clip(
    humanoid: Humanoid,
    root: NDArray[np.float64],
    turns: NDArray[np.float64],
    rate_hz: float,
    source: str,
) -> SkeletonClip:
    """Put the rotations on the humanoid's skeleton and chain them."""
    frames, joints = len(root), len(humanoid.names)
    positions = np.tile(humanoid.offsets, (frames, 1, 1))
    positions[:, 0] = root
    rotations = np.tile(np.eye(3), (frames, joints, 1, 1))
    rotations[:, : turns.shape[1]] = turns
    positions, rotations = forward_kinematics(humanoid.parents, positions, rotations)
    return SkeletonClip(
        humanoid.names, humanoid.parents, humanoid.offsets, positions, rotations, rate_hz, source
    )
