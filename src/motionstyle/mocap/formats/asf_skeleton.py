"""The ASF skeleton file: its sections, its bones, and every fault in them."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import near_matches
from motionstyle.mocap.formats.text import Problems, number_problem, parse_number, read_lines, words


@dataclass
class Bone:
    """One bone, or the root with a vector of zero length.

    Attributes
    ----------
    name : as in the file; `root` for the root.
    vector : from the bone's start to its end at zero pose, in file units, (3,).
    axis : rotation of the bone's axes about world x, y and z, radians, (3,).
    order : in which order rotations are applied, e.g. "XYZ".
    channels : TX to RZ in the order of the AMC values; empty for a bone that does not move.
    line : line of the file, from 1.
    """

    name: str
    line: int
    vector: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    axis: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    order: str = "XYZ"
    channels: tuple[str, ...] = ()


@dataclass(frozen=True)
class Skeleton:
    """The bones, root first and parents before children, and each one's parent index."""

    bones: tuple[Bone, ...]
    parents: tuple[int, ...]

    def joints(self) -> tuple[NDArray[np.int64], NDArray[np.float64], tuple[str, ...]]:
        """Return parents (J,), offsets (J, 3) and names: bone starts, then ends of leaf bones."""
        leaves = [at for at in range(len(self.bones)) if at not in self.parents]
        ends = [self.bones[at] for at in leaves]
        starts = [np.zeros(3), *(self.bones[parent].vector for parent in self.parents[1:])]
        names = (*(bone.name for bone in self.bones), *(f"{bone.name}_end" for bone in ends))
        offsets = np.array([*starts, *(bone.vector for bone in ends)])
        return np.array([*self.parents, *leaves], dtype=np.int64), offsets, names


def read_asf(path: str | Path) -> Skeleton:
    """Read an ASF skeleton file; every fault in it is reported at once.

    Lengths stay the raw numbers of the file; angles become radians. A root placed or turned
    away from the origin, and bones that change length or shift, are refused: no file at hand
    has them, so their meaning could not be verified.

    Raises
    ------
    MotionStyleError
        For a file that cannot be read or has any fault, with line and bone.
    """
    path = Path(path)
    reader = _Reader(path)
    for number, line in enumerate(read_lines(path, "ASF"), start=1):
        split = words(line)
        if split and not split[0].startswith("#"):
            reader.read_line(number, split)
    return reader.finish()


class _Reader:
    """State of reading: the section, the bones so far, their parents."""

    def __init__(self, path: Path) -> None:
        self.problems = Problems(path)
        self.section = ""
        self.radians_per_unit = 0.0
        self.root = Bone("root", 0)
        self.bones: dict[str, Bone] = {"root": self.root}
        self.block: dict[str, tuple[int, list[str]]] | None = None
        self.parents: dict[str, str] = {}

    def read_line(self, number: int, split: list[str]) -> None:
        """Read one line of the current section."""
        key = split[0].lower()
        if key.startswith(":"):
            if self.block is not None:
                self.problems.add(self.block["begin"][0], "a bone lacks its 'end'")
                self.block = None
            self.section = key
            if key == ":root":
                self.root.line = number
        elif self.section == ":units" and key == "angle":
            unit = split[1].lower() if len(split) > 1 else ""
            self.radians_per_unit = {"deg": np.pi / 180.0, "rad": 1.0}.get(unit[:3], 0.0)
            if not self.radians_per_unit:
                self.problems.add(number, f"angle unit is {unit!r}, expected deg or rad")
        elif self.section == ":root":
            self._root_line(number, key, split[1:])
        elif self.section == ":bonedata":
            self._bone_line(number, key, split[1:])
        elif self.section == ":hierarchy" and key not in ("begin", "end"):
            self._hierarchy_line(number, split)

    def _root_line(self, number: int, key: str, texts: list[str]) -> None:
        """Read a line of the root section."""
        if key == "order":
            self.root.channels = self._channels(number, "root", texts)
        elif key == "axis":
            self.root.order = self._order(number, "root", texts)
        elif key in ("position", "orientation") and self._numbers(number, "root", key, texts).any():
            self.problems.add(number, f"root {key} is {' '.join(texts)}; only 0 0 0 is supported")

    def _bone_line(self, number: int, key: str, texts: list[str]) -> None:
        """Read a line of the bone section; a bone is made at its 'end'."""
        if key == "begin":
            if self.block is not None:
                self.problems.add(self.block["begin"][0], "a bone lacks its 'end'")
            self.block = {"begin": (number, [])}
        elif self.block is None:
            self.problems.add(number, f"'{key[:40]}' outside of begin and end")
        elif key == "end":
            self._make_bone(self.block)
            self.block = None
        else:
            self.block.setdefault(key, (number, texts))

    def _make_bone(self, block: dict[str, tuple[int, list[str]]]) -> None:
        """Turn the lines between begin and end into a bone."""
        begin = block["begin"][0]
        name = " ".join(block.get("name", (0, []))[1]) or f"(nameless, line {begin})"
        missing = [key for key in ("name", "direction", "length", "axis") if key not in block]
        if missing:
            self.problems.add(begin, f"bone '{name}' has no {', '.join(missing)}")
            return
        if name in self.bones:
            self.problems.add(block["name"][0], f"duplicate bone name '{name}'")
        bone = Bone(name, begin)
        number, texts = block["direction"]
        direction = self._numbers(number, name, "direction", texts)
        size = float(np.linalg.norm(direction))
        if abs(size - 1.0) > 1e-3:
            self.problems.add(number, f"direction of '{name}' has length {size:.4g}, expected 1")
        number, texts = block["length"]
        length = float(self._numbers(number, name, "length", texts, count=1)[0])
        if length < 0:
            self.problems.add(number, f"length of '{name}' is {length:g}, expected 0 or more")
        bone.vector = direction * length
        number, texts = block["axis"]
        bone.axis = self._numbers(number, name, "axis", texts[:3])
        bone.order = self._order(number, name, texts[3:])
        if "dof" in block:
            number, texts = block["dof"]
            bone.channels = self._channels(number, name, texts)
            if any(channel[0] == "T" for channel in bone.channels):
                self.problems.add(number, f"bone '{name}' shifts; only rx, ry and rz are supported")
        self.bones[name] = bone

    def _numbers(
        self, number: int, name: str, key: str, texts: list[str], count: int = 3
    ) -> NDArray[np.float64]:
        """Read `count` numbers; zeros stand for faulty ones, which are noted."""
        if len(texts) != count:
            fault = f"{key} of '{name}' has {len(texts)} values, expected {count}"
            self.problems.add(number, fault)
        values = np.zeros(count)
        for at, text in enumerate(texts[:count]):
            fault = number_problem(text)
            if fault:
                self.problems.add(number, f"{key} of '{name}' {fault}")
            else:
                values[at] = parse_number(text)
        return values

    def _order(self, number: int, name: str, texts: list[str]) -> str:
        """Read a rotation order such as XYZ."""
        order = texts[0].upper() if len(texts) == 1 else " ".join(texts)
        if sorted(order) == ["X", "Y", "Z"]:
            return order
        self.problems.add(
            number, f"rotation order of '{name}' is {order!r}, expected one such as XYZ"
        )
        return "XYZ"

    def _channels(self, number: int, name: str, texts: list[str]) -> tuple[str, ...]:
        """Read degrees of freedom, each at most once."""
        channels = tuple(text.upper() for text in texts)
        for channel in channels:
            if not re.fullmatch("[TR][XYZ]", channel):
                self.problems.add(number, f"unknown degree of freedom '{channel}' of '{name}'")
            elif channels.count(channel) > 1:
                self.problems.add(number, f"duplicate degree of freedom '{channel}' of '{name}'")
        return channels

    def _hierarchy_line(self, number: int, split: list[str]) -> None:
        """Read one parent and its children."""
        for name in split:
            if name not in self.bones:
                hint = near_matches(name, list(self.bones))
                self.problems.add(number, f"hierarchy names unknown bone '{name}'{hint}")
        for child in split[1:]:
            if child == "root" or child in self.parents:
                self.problems.add(number, f"bone '{child}' has a second parent '{split[0]}'")
            self.parents[child] = split[0]

    def finish(self) -> Skeleton:
        """Check that every bone hangs on the root, sort parents first, and convert angles."""
        if not self.root.channels:
            self.problems.add(self.root.line or None, "no :root section with an order line")
        if not self.radians_per_unit:
            self.problems.add(None, "no angle unit (deg or rad) under :units")
        ordered: list[str] = ["root"]
        for name in ordered:
            ordered.extend(child for child, parent in self.parents.items() if parent == name)
        for name, bone in self.bones.items():
            if name not in ordered:
                self.problems.add(bone.line, f"bone '{name}' hangs on no chain from the root")
        if len(self.bones) == 1:
            self.problems.add(None, "no bones: this is no ASF skeleton")
        self.problems.stop()
        for bone in self.bones.values():
            bone.axis = bone.axis * self.radians_per_unit
        bones = tuple(self.bones[name] for name in ordered)
        parents = tuple(
            ordered.index(self.parents[name]) if name != "root" else -1 for name in ordered
        )
        return Skeleton(bones, parents)
