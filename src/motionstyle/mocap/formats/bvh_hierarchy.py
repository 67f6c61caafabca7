"""The HIERARCHY section of a BVH file: blocks, offsets, channels, and every fault in them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from motionstyle.mocap.formats.text import Problems, number_problem, parse_number, words

_CHANNELS = {
    f"{axis}{kind}": (kind, "xyz".index(axis))
    for axis in "xyz"
    for kind in ("position", "rotation")
}


@dataclass
class HierarchyJoint:
    """One ROOT, JOINT or End Site.

    Attributes
    ----------
    name : the joint's name; of an End Site, its parent's name and `_end`.
    parent : index of the parent, -1 for the root.
    line : line of the file, from 1.
    is_end : whether this is an End Site.
    offset : OFFSET in file units, (3,).
    channels : ("position" or "rotation", axis 0 to 2) in the order written.
    columns : the channel names as written.
    """

    name: str
    parent: int
    line: int
    is_end: bool
    offset: NDArray[np.float64] | None = None
    channels: list[tuple[str, int]] | None = None
    columns: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        """Name the block the way messages do."""
        return f"the End Site of '{self.name}'" if self.is_end else f"joint '{self.name}'"


def read_hierarchy(lines: list[str], problems: Problems) -> list[HierarchyJoint]:
    """Read the lines before MOTION into joints, parents first, and note every fault.

    Parameters
    ----------
    lines : the lines of the file before MOTION.
    problems : receives the faults; the joints may only be used if there are none.
    """
    reader = _Hierarchy(problems)
    for number, line in enumerate(lines, start=1):
        reader.read_line(number, words(line.replace("{", " { ").replace("}", " } ")))
    reader.finish()
    return reader.joints


class _Hierarchy:
    """The joints read so far and the blocks still open."""

    def __init__(self, problems: Problems) -> None:
        self.problems = problems
        self.joints: list[HierarchyJoint] = []
        self.open: list[int] = []
        self.awaits_brace = False

    @property
    def innermost(self) -> HierarchyJoint:
        """The block that is open now."""
        return self.joints[self.open[-1]]

    def read_line(self, number: int, rest: list[str]) -> None:
        """Read one line, of one or more statements and braces."""
        while rest:
            key = rest[0].upper()
            braces = [at for at, word in enumerate(rest) if word in ("{", "}")]
            cut = braces[0] if braces else len(rest)
            if self.awaits_brace and key != "{":
                self.problems.add(number, f"{self.innermost} lacks its opening '{{'")
                self.awaits_brace = False
            if key in ("{", "}"):
                self._brace(key, number)
                cut = 1
            elif key in ("ROOT", "JOINT") or (key == "END" and cut > 1):
                self._block(key, " ".join(rest[1:cut]), number)
            elif key == "OFFSET":
                self._offset(rest[1:cut], number)
            elif key == "CHANNELS":
                self._channels(rest[1:cut], number)
            elif key != "HIERARCHY":
                text = " ".join(rest)[:40]
                self.problems.add(number, f"unexpected {text!r} in the hierarchy")
                return
            rest = rest[max(cut, 1) :]

    def _brace(self, key: str, number: int) -> None:
        """Take an opening or closing brace."""
        if key == "{":
            if not self.awaits_brace:
                self.problems.add(number, "'{' without a ROOT, JOINT or End Site before it")
            self.awaits_brace = False
        elif self.open:
            self.open.pop()
        else:
            self.problems.add(number, "one '}' too many: no block is open here")

    def _block(self, key: str, name: str, number: int) -> None:
        """Start a ROOT, JOINT or End Site."""
        add = self.problems.add
        if self.open and self.innermost.is_end:
            add(number, f"{self.innermost} lacks its closing '}}' before this line")
            self.open.pop()
        if key == "ROOT" and self.joints:
            add(number, f"a second ROOT '{name}'; expected a single skeleton")
        elif key != "ROOT" and not self.open:
            add(number, f"{key} '{name}' outside of any ROOT block")
        if key == "END":
            name = self.innermost.name if self.open else ""
        elif not name:
            add(number, f"{key} without a name")
        else:
            same = [one for one in self.joints if one.name == name and not one.is_end]
            if same:
                add(number, f"duplicate joint name '{name}', first used in line {same[0].line}")
        parent = self.open[-1] if self.open else -1
        self.joints.append(HierarchyJoint(name, parent, number, key == "END"))
        self.open.append(len(self.joints) - 1)
        self.awaits_brace = True

    def _offset(self, values: list[str], number: int) -> None:
        """Read an OFFSET line of the innermost block."""
        if not self.open:
            self.problems.add(number, "OFFSET outside of any joint")
            return
        joint = self.innermost
        if joint.offset is not None:
            self.problems.add(number, f"{joint} has a second OFFSET")
        joint.offset = np.zeros(3)
        if len(values) != 3:
            self.problems.add(number, f"OFFSET of {joint} has {len(values)} values, expected 3")
        for axis, value in enumerate(values[:3]):
            fault = number_problem(value)
            if fault:
                self.problems.add(number, f"OFFSET {'XYZ'[axis]} of {joint} {fault}")
            else:
                joint.offset[axis] = parse_number(value)

    def _channels(self, values: list[str], number: int) -> None:
        """Read a CHANNELS line of the innermost block."""
        add = self.problems.add
        if not self.open:
            add(number, "CHANNELS outside of any joint")
            return
        joint = self.innermost
        if joint.channels is not None:
            add(number, f"{joint} has a second CHANNELS line")
        if joint.is_end:
            add(number, f"{joint} has CHANNELS; an End Site has none")
        count, names = (values[0], values[1:]) if values else ("no count", [])
        if count != str(len(names)):
            add(number, f"CHANNELS of {joint} announces {count} and lists {len(names)}")
        joint.channels, joint.columns = [], names
        for name in names:
            channel = _CHANNELS.get(name.lower())
            if channel is None:
                expected = "expected X/Y/Zposition or X/Y/Zrotation"
                add(number, f"unknown channel '{name}' on {joint}; {expected}")
            elif channel in joint.channels:
                add(number, f"duplicate channel '{name}' on {joint}")
            else:
                joint.channels.append(channel)

    def finish(self) -> None:
        """Note what is missing at the end and give End Sites their joint names."""
        for at in self.open:
            joint = self.joints[at]
            self.problems.add(joint.line, f"{joint} lacks its closing '}}'")
        if not self.joints:
            self.problems.add(None, "no ROOT: this is no BVH hierarchy")
        taken = {joint.name for joint in self.joints if not joint.is_end}
        for joint in self.joints:
            if joint.offset is None:
                self.problems.add(joint.line, f"{joint} has no OFFSET")
            if joint.is_end:
                stem, count = f"{joint.name}_end", 1
                joint.name = stem
                while joint.name in taken:
                    count += 1
                    joint.name = f"{stem}{count}"
                taken.add(joint.name)
            elif joint.channels is None:
                self.problems.add(joint.line, f"{joint} has no CHANNELS")
