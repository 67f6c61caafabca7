"""The nodes and coordinates of the body, and which way each coordinate is positive.

Liu et al. 2005 give the counts (18 nodes, 29 joint DOF, 6 root DOF) but no list; this layout
meets both. Axes of every node in the zero pose (standing, arms hanging, palms to the thighs):
x forward, y up, z to the right. Coordinate values are metres for the three root translations
and radians for the rest. The axes of left and right joints are mirrored so that the same
movement has the same sign on both sides.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

JointKind = Literal["free", "exponential", "hinges", "weld"]

X, Y, Z = np.eye(3)


@dataclass(frozen=True)
class Joint:
    """The joint between a node and its parent.

    kind "free": three translations and an exponential map, in the world;
    "exponential": one exponential map whose components are along `axes`;
    "hinges": rotations about `axes`, the first one outermost; "weld": none.
    """

    node: str
    parent: str | None
    kind: JointKind
    names: tuple[str, ...]
    axes: tuple[tuple[float, float, float], ...]


def _axes(*vectors: np.ndarray) -> tuple[tuple[float, float, float], ...]:
    return tuple((float(a), float(b), float(c)) for a, b, c in vectors)


def _leg(side: str, mirror: float) -> list[Joint]:
    return [
        Joint(
            f"thigh_{side}",
            "pelvis",
            "exponential",
            (f"hip_flexion_{side}", f"hip_adduction_{side}", f"hip_rotation_{side}"),
            _axes(Z, mirror * X, mirror * Y),
        ),
        Joint(f"shank_{side}", f"thigh_{side}", "hinges", (f"knee_flexion_{side}",), _axes(-Z)),
        Joint(
            f"foot_{side}",
            f"shank_{side}",
            "hinges",
            (f"ankle_dorsiflexion_{side}", f"foot_inversion_{side}"),
            _axes(Z, mirror * X),
        ),
        Joint(f"toes_{side}", f"foot_{side}", "hinges", (f"toes_extension_{side}",), _axes(Z)),
    ]


def _arm(side: str, mirror: float) -> list[Joint]:
    return [
        Joint(
            f"upper_arm_{side}",
            "thorax",
            "exponential",
            (
                f"shoulder_flexion_{side}",
                f"shoulder_abduction_{side}",
                f"shoulder_rotation_{side}",
            ),
            _axes(Z, -mirror * X, mirror * Y),
        ),
        Joint(
            f"forearm_{side}", f"upper_arm_{side}", "hinges", (f"elbow_flexion_{side}",), _axes(Z)
        ),
        Joint(f"hand_{side}", f"forearm_{side}", "weld", (), ()),
    ]


JOINTS: tuple[Joint, ...] = (
    Joint(
        "pelvis",
        None,
        "free",
        ("pelvis_tx", "pelvis_ty", "pelvis_tz", "pelvis_rx", "pelvis_ry", "pelvis_rz"),
        _axes(X, Y, Z, X, Y, Z),
    ),
    *_leg("r", 1.0),
    *_leg("l", -1.0),
    Joint(
        "abdomen",
        "pelvis",
        "exponential",
        ("abdomen_flexion", "abdomen_bending", "abdomen_rotation"),
        _axes(-Z, X, Y),
    ),
    Joint("thorax", "abdomen", "hinges", ("thorax_flexion", "thorax_rotation"), _axes(-Z, Y)),
    Joint("head", "thorax", "hinges", ("head_flexion", "head_rotation"), _axes(-Z, Y)),
    *_arm("r", 1.0),
    *_arm("l", -1.0),
)

NODES: tuple[str, ...] = tuple(j.node for j in JOINTS)
NODE_INDEX: dict[str, int] = {name: i for i, name in enumerate(NODES)}
PARENTS: tuple[int, ...] = tuple(-1 if j.parent is None else NODE_INDEX[j.parent] for j in JOINTS)
COORDINATES: tuple[str, ...] = tuple(name for j in JOINTS for name in j.names)
COORDINATE_INDEX: dict[str, int] = {name: i for i, name in enumerate(COORDINATES)}
COORDINATE_NODE: tuple[int, ...] = tuple(i for i, j in enumerate(JOINTS) for _ in j.names)
JOINT_SLICES: tuple[slice, ...] = tuple(
    slice(COORDINATE_NODE.index(i), COORDINATE_NODE.index(i) + len(j.names))
    if j.names
    else slice(0, 0)
    for i, j in enumerate(JOINTS)
)
ROOT_COORDINATES = slice(0, 6)
JOINT_COORDINATES = slice(6, 35)
EXPONENTIAL_BLOCKS: tuple[slice, ...] = (
    slice(3, 6),
    *(s for s, j in zip(JOINT_SLICES, JOINTS, strict=True) if j.kind == "exponential"),
)
HINGE_COLUMNS: tuple[int, ...] = tuple(
    k
    for block, joint in zip(JOINT_SLICES, JOINTS, strict=True)
    if joint.kind == "hinges"
    for k in range(block.start, block.stop)
)

CONTACT_POINTS: tuple[str, ...] = tuple(
    f"{point}_{side}" for side in "rl" for point in ("heel", "ball_medial", "ball_lateral", "toe")
)
CONTACT_POINT_NODES: tuple[int, ...] = tuple(
    NODE_INDEX[f"{'toes' if name.startswith('toe') else 'foot'}_{name[-1]}"]
    for name in CONTACT_POINTS
)
END_POINTS: tuple[str, ...] = ("head_top", "fingertip_r", "fingertip_l")
END_POINT_NODES: tuple[int, ...] = (
    NODE_INDEX["head"],
    NODE_INDEX["hand_r"],
    NODE_INDEX["hand_l"],
)


def mirrored_coordinates() -> tuple[np.ndarray, np.ndarray]:
    """Return (order, sign): coordinates of the left–right mirrored pose are q[order] * sign.

    The mirror is the sagittal plane z = 0. Left and right joints swap; bending to the right,
    rotations to the left, lateral position, roll and yaw change sign.
    """
    order = np.arange(len(COORDINATES))
    sign = np.ones(len(COORDINATES))
    for i, name in enumerate(COORDINATES):
        if name.endswith(("_r", "_l")):
            other = name[:-1] + ("l" if name.endswith("r") else "r")
            order[i] = COORDINATE_INDEX[other]
        elif name in {"pelvis_tz", "pelvis_rx", "pelvis_ry", "abdomen_bending"} or name.endswith(
            "_rotation"
        ):
            sign[i] = -1.0
    return order, sign
