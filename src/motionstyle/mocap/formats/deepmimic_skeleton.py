"""The humanoid that DeepMimic frames move, read from its URDF file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError
from motionstyle.mocap.formats.text import Problems, number_problem, parse_number

LAYOUT = (
    ("chest", 4),
    ("neck", 4),
    ("right_hip", 4),
    ("right_knee", 1),
    ("right_ankle", 4),
    ("right_shoulder", 4),
    ("right_elbow", 1),
    ("left_hip", 4),
    ("left_knee", 1),
    ("left_ankle", 4),
    ("left_shoulder", 4),
    ("left_elbow", 1),
)
"""Joints after the root and how many values each has in a frame: a quaternion or an angle."""

METRES_PER_UNIT = 0.25


@dataclass(frozen=True)
class Humanoid:
    """The skeleton: the root, the joints of `LAYOUT`, then the end joints.

    Attributes
    ----------
    names : names of the joints.
    parents : index of each joint's parent, -1 for the root, (J,).
    offsets : positions against the parent at zero pose, metres, (J, 3).
    """

    names: tuple[str, ...]
    parents: NDArray[np.int64]
    offsets: NDArray[np.float64]


def read_humanoid(path: str | Path) -> Humanoid:
    """Read the humanoid's URDF file; every fault in it is reported at once.

    Raises
    ------
    MotionStyleError
        For a file that cannot be read, is not valid XML, or whose joints are not those of
        `LAYOUT` (spherical, or revolute about +z) without turned joint frames.
    """
    path = Path(path)
    try:
        # The published humanoid.urdf ends in a zero byte, which no XML parser takes.
        robot = Xml.fromstring(path.read_bytes().rstrip(b"\0 \t\r\n"))
    except OSError as error:
        raise MotionStyleError(f"{path}: cannot read this URDF file ({error.strerror})") from error
    except Xml.ParseError as error:
        line, column = error.position
        raise MotionStyleError(
            f"{path}: line {line}, column {column + 1}: not valid XML ({error.msg.split(':')[0]})"
        ) from error
    problems = Problems(path)
    joints: dict[str, Xml.Element] = {}
    links = {link.get("name", ""): link for link in robot.iter("link")}
    for joint in robot.iter("joint"):
        child = joint.find("child")
        joints["" if child is None else child.get("link", "")] = joint
    names = ["root", *(name for name, _ in LAYOUT)]
    parents, offsets = [-1], [np.zeros(3)]
    for name, width in LAYOUT:
        joint = joints.get(name)
        if joint is None:
            problems.add(None, f"no joint moves a link '{name}'")
            continue
        _check_kind(name, width, joint, problems)
        parent = joint.find("parent")
        parent_name = "" if parent is None else parent.get("link", "")
        if parent_name not in names[: len(parents)]:
            problems.add(None, f"joint '{name}' hangs on '{parent_name}', expected a joint before")
            parent_name = "root"
        parents.append(names.index(parent_name))
        offsets.append(_vector(name, joint.find("origin"), "xyz", problems))
    problems.stop()
    for name, parent_name, end in _ends(joints, links, problems):
        names.append(name)
        parents.append(names.index(parent_name))
        offsets.append(end)
    problems.stop()
    scaled = np.array(offsets) * METRES_PER_UNIT
    return Humanoid(tuple(names), np.array(parents, dtype=np.int64), scaled)


def _check_kind(name: str, width: int, joint: Xml.Element, problems: Problems) -> None:
    """Note a joint of another type, about another axis, or with a turned frame."""
    expected = "spherical" if width == 4 else "revolute"
    if joint.get("type") != expected:
        problems.add(None, f"joint '{name}' is {joint.get('type')}, expected {expected}")
    elif width == 1 and not np.array_equal(
        _vector(name, joint.find("axis"), "xyz", problems), [0.0, 0.0, 1.0]
    ):
        problems.add(None, f"joint '{name}' does not turn about the axis 0 0 1")
    origin = joint.find("origin")
    turned = origin is not None and origin.get("rpy") is not None
    if turned and _vector(name, origin, "rpy", problems).any():
        problems.add(None, f"joint '{name}' has a turned frame (rpy), which is not supported")


def _vector(
    name: str, element: Xml.Element | None, key: str, problems: Problems
) -> NDArray[np.float64]:
    """Read three numbers of an attribute; zeros stand for faulty ones, which are noted."""
    texts = ("" if element is None else element.get(key, "")).split()
    if len(texts) != 3:
        problems.add(None, f"'{name}' has {len(texts)} numbers in {key}, expected 3")
        return np.zeros(3)
    faults = [fault for text in texts if (fault := number_problem(text))]
    for fault in faults:
        problems.add(None, f"'{name}': {key} {fault}")
    return np.zeros(3) if faults else np.array([parse_number(text) for text in texts])


def _ends(
    joints: dict[str, Xml.Element], links: dict[str, Xml.Element], problems: Problems
) -> list[tuple[str, str, NDArray[np.float64]]]:
    """Return the end joints the file describes: name, parent, offset in units of the file."""
    ends = []
    sphere = _collision(links, "neck", "sphere")
    if sphere is not None:
        radius = sphere[1].get("radius", "")
        fault = number_problem(radius)
        top = _vector("neck", sphere[0], "xyz", problems)
        if fault:
            problems.add(None, f"'neck': radius {fault}")
        else:
            top[1] += parse_number(radius)
        ends.append(("neck_end", "neck", top))
    for side in ("right", "left"):
        ankle, wrist = f"{side}_ankle", joints.get(f"{side}_wrist")
        box = _collision(links, ankle, "box")
        if box is not None:
            size = _vector(ankle, box[1], "size", problems)
            sole = _vector(ankle, box[0], "xyz", problems) - [0.0, size[1] / 2.0, 0.0]
            half = np.array([size[0] / 2.0, 0.0, 0.0])
            ends.append((f"{ankle}_heel_end", ankle, sole - half))
            ends.append((f"{ankle}_toe_end", ankle, sole + half))
        if wrist is not None:
            offset = _vector(f"{side}_wrist", wrist.find("origin"), "xyz", problems)
            ends.append((f"{side}_elbow_end", f"{side}_elbow", offset))
    return ends


def _collision(
    links: dict[str, Xml.Element], name: str, shape: str
) -> tuple[Xml.Element, Xml.Element] | None:
    """Return the origin and the geometry of a link's collision shape, None if it has none."""
    if name not in links:
        return None
    origin = links[name].find("collision/origin")
    geometry = links[name].find(f"collision/geometry/{shape}")
    return None if origin is None or geometry is None else (origin, geometry)
