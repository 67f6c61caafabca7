"""Read Acclaim motion: an AMC file and the ASF skeleton it moves (`asf_skeleton`)."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError, near_matches
from motionstyle.mocap.formats.asf_skeleton import Bone, Skeleton, read_asf
from motionstyle.mocap.formats.clip import SkeletonClip, forward_kinematics
from motionstyle.mocap.formats.text import (
    Problems,
    axis_rotation,
    number_problem,
    parse_number,
    read_lines,
    words,
)


def find_asf(amc_path: str | Path) -> Path:
    """Find the skeleton of an AMC file in its folder.

    Tried in order: `<stem>.asf`, then the stem up to its last underscore (`02_01.amc` to
    `02.asf`), with the suffix in lower and in upper case.

    Raises
    ------
    MotionStyleError
        If there is none; the message lists what was tried.
    """
    amc_path = Path(amc_path)
    stems = [amc_path.stem]
    if "_" in amc_path.stem:
        stems.append(amc_path.stem.rpartition("_")[0])
    tried = [amc_path.with_name(stem + suffix) for stem in stems for suffix in (".asf", ".ASF")]
    for path in tried:
        if path.is_file():
            return path
    names = ", ".join(path.name for path in tried)
    raise MotionStyleError(
        f"{amc_path}: no skeleton file beside it; tried {names}. Put the ASF file there or name "
        "it as the skeleton file."
    )


def read_asf_amc(
    amc_path: str | Path, asf_path: str | Path, rate_hz: float = 120.0
) -> SkeletonClip:
    """Read an AMC motion on its ASF skeleton; every fault in a file is reported at once.

    A bone of the ASF becomes the joint at the bone's START, where it rotates; a bone without
    children also gets an end joint `<bone>_end`. The zero pose is that of the ASF, and there
    every joint's world rotation is the identity: a bone turns by C R C^-1 against its parent,
    C being its `axis` and R its degrees of freedom. Rotations of an order XYZ are about fixed
    axes, x first. Joint limits are ignored.

    Parameters
    ----------
    amc_path, asf_path : the two files.
    rate_hz : frames per second; an AMC file does not say.

    Returns
    -------
    SkeletonClip
        Lengths are the raw numbers of the files: the factor of `:units length` is NOT applied.
        For the CMU data (`length 0.45`), metres are the value times 0.0254 / 0.45.

    Raises
    ------
    MotionStyleError
        For a file that cannot be read or has any fault, with line, frame and bone; for a rate
        that is not a finite number above 0.
    """
    if not (np.isfinite(rate_hz) and rate_hz > 0):
        raise MotionStyleError(f"rate_hz is {rate_hz}, expected frames per second above 0")
    skeleton = read_asf(asf_path)
    frames = _Frames(Path(amc_path), skeleton)
    return _clip(skeleton, frames.values, frames.radians_per_unit, rate_hz, str(amc_path))


@dataclass
class _Frame:
    """Where a frame starts and which bones it has given so far."""

    line: int
    number: int
    row: dict[str, list[float]]


class _Frames:
    """The frames of an AMC file: per moving bone its values in the order of its channels."""

    def __init__(self, path: Path, skeleton: Skeleton) -> None:
        lines = read_lines(path, "AMC")
        self.problems = Problems(path)
        self.bones = {bone.name: bone for bone in skeleton.bones if bone.channels}
        self.still = {bone.name for bone in skeleton.bones if not bone.channels}
        self.frames: list[_Frame] = []
        self.radians_per_unit = 0.0
        for number, line in enumerate(lines, start=1):
            split = words(line)
            if split and not split[0].startswith("#"):
                self._read(number, split)
        self._finish(lines)
        self.values = {
            name: np.array([frame.row[name] for frame in self.frames]) for name in self.bones
        }

    def _read(self, number: int, split: list[str]) -> None:
        """Read one line: a header, a frame number, or a bone's values."""
        if split[0].startswith(":"):
            units = {":DEGREES": np.pi / 180.0, ":RADIANS": 1.0}.get(split[0].upper())
            if units and self.radians_per_unit:
                self.problems.add(number, f"a second angle unit {split[0]}")
            self.radians_per_unit = self.radians_per_unit or units or 0.0
        elif len(split) == 1 and re.fullmatch(r"[+-]?[0-9]+", split[0]):
            self._complete()
            self.frames.append(_Frame(number, int(split[0]), {}))
            if len(self.frames) > 1:
                before = self.frames[-2].number
                if self.frames[-1].number != before + 1:
                    self.problems.add(
                        number, f"frame {split[0]} follows frame {before}, expected {before + 1}"
                    )
        elif not self.frames:
            self.problems.add(number, f"{split[0][:40]!r} before the first frame number")
        else:
            self._bone(number, split[0], split[1:])

    def _bone(self, number: int, name: str, texts: list[str]) -> None:
        """Read one bone's values of the current frame."""
        frame = self.frames[-1]
        at = f"frame {frame.number}"
        if name not in self.bones:
            why = "has no degrees of freedom" if name in self.still else "is not a bone of the ASF"
            hint = "" if name in self.still else near_matches(name, list(self.bones))
            self.problems.add(number, f"{at}: '{name[:40]}' {why}{hint}")
            return
        if name in frame.row:
            self.problems.add(number, f"{at}: a second line for bone '{name}'")
        channels = self.bones[name].channels
        if len(texts) != len(channels):
            self.problems.add(
                number,
                f"{at}: bone '{name}' has {len(texts)} values, "
                f"expected {len(channels)} ({' '.join(channels)})",
            )
        frame.row[name] = []
        for column, text in enumerate(texts):
            fault = number_problem(text)
            if fault:
                channel = channels[column] if column < len(channels) else "beyond the last"
                self.problems.add(number, f"{at}: {channel} of bone '{name}' {fault}")
            frame.row[name].append(0.0 if fault else parse_number(text))

    def _complete(self) -> None:
        """Note the bones the current frame lacks."""
        if not self.frames:
            return
        frame = self.frames[-1]
        missing = [name for name in self.bones if name not in frame.row]
        if missing:
            self.problems.add(
                frame.line,
                f"frame {frame.number} lacks {len(missing)} of {len(self.bones)} bones: "
                + ", ".join(missing),
            )

    def _finish(self, lines: list[str]) -> None:
        """Check the last frame and the header, and raise what was found."""
        self._complete()
        if not any(line.strip() for line in lines):
            self.problems.add(None, "the file is empty")
        elif not self.frames:
            self.problems.add(None, "no frames: a line with a frame number was expected")
        if self.frames and not self.radians_per_unit:
            self.problems.add(None, "neither :DEGREES nor :RADIANS stands in the header")
        self.problems.stop()


def _ordered_rotation(
    axes: str, angles: dict[int, NDArray[np.float64]], frames: int
) -> NDArray[np.float64]:
    """Compose rotations about fixed axes, the first letter of `axes` first, (frames, 3, 3)."""
    rotation = np.tile(np.eye(3), (frames, 1, 1))
    for letter in axes:
        axis = "XYZ".index(letter)
        if axis in angles:
            rotation = axis_rotation(axis, angles[axis]) @ rotation
    return rotation


def _clip(
    skeleton: Skeleton,
    values: dict[str, NDArray[np.float64]],
    radians_per_unit: float,
    rate_hz: float,
    source: str,
) -> SkeletonClip:
    """Turn bone angles into joint transforms and chain them."""
    frames = len(next(iter(values.values())))
    parents, offsets, names = skeleton.joints()
    positions = np.tile(offsets, (frames, 1, 1))
    rotations = np.tile(np.eye(3), (frames, len(names), 1, 1))
    for joint, bone in enumerate(skeleton.bones):
        angles = {}
        for column, channel in enumerate(bone.channels):
            axis = "XYZ".index(channel[1])
            series = values[bone.name][:, column]
            if channel[0] == "T":
                positions[:, joint, axis] = series
            else:
                angles[axis] = series * radians_per_unit
        frame = _bone_frame(bone)
        rotations[:, joint] = frame @ _ordered_rotation(bone.order, angles, frames) @ frame.T
    positions, rotations = forward_kinematics(parents, positions, rotations)
    return SkeletonClip(names, parents, offsets, positions, rotations, rate_hz, source)


def _bone_frame(bone: Bone) -> NDArray[np.float64]:
    """Return C, the axes about which the bone's degrees of freedom turn, (3, 3)."""
    angles = {axis: np.array([angle]) for axis, angle in enumerate(bone.axis)}
    return _ordered_rotation(bone.order, angles, 1)[0]
