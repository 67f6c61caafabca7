"""Motions as BVH files, for Blender and other programs.

World axes are the motion's own: right-handed, y up, x forward and z to the right in the first
frame; lengths in cm, angles in degrees.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.kinematics import joint_rotations
from motionstyle.body.layout import (
    CONTACT_POINT_NODES,
    CONTACT_POINTS,
    END_POINT_NODES,
    NODES,
    PARENTS,
)
from motionstyle.files import atomic_write
from motionstyle.motion.motion import Motion

Array = NDArray[np.float64]
CENTIMETRES = 100.0
_POSITIONS = "Xposition Yposition Zposition"
_ROTATIONS = "Zrotation Xrotation Yrotation"


def euler_zxy(matrices: Array) -> Array:
    """Return z, x, y (rad) with R = Rz·Rx·Ry, (F, 3, 3) to (F, 3), |x| ≤ π/2.

    Near x = ±90°, where z and y are not unique, y makes up for whatever z was taken.
    """
    z = np.arctan2(-matrices[:, 0, 1], matrices[:, 1, 1])
    cos, sin = np.cos(z)[:, None], np.sin(z)[:, None]
    first = cos * matrices[:, 0] + sin * matrices[:, 1]  # the rows of Rz⁻¹ R = Rx Ry
    second = cos * matrices[:, 1] - sin * matrices[:, 0]
    x = np.arctan2(matrices[:, 2, 1], second[:, 1])
    return np.column_stack([z, x, np.arctan2(first[:, 2], first[:, 0])])


def _decimal(values: Array, digits: int) -> str:
    """Write numbers with a fixed count of decimals, zero without a sign."""
    return " ".join(f"{v:.{digits}f}" for v in np.round(values, digits) + 0.0)


def _hierarchy(motion: Motion) -> Iterator[tuple[int, str]]:
    """Yield (node, line) of the HIERARCHY section; node is -1 but at the start of a joint."""
    geometry = motion.body.geometry
    ends = dict(zip(END_POINT_NODES, geometry.end_points, strict=True))
    for name, node, point in zip(
        CONTACT_POINTS, CONTACT_POINT_NODES, geometry.contact_points, strict=True
    ):
        if name.startswith("toe"):
            ends[node] = point

    def block(node: int, depth: int) -> Iterator[tuple[int, str]]:
        indent, inner = "  " * depth, "  " * (depth + 1)
        root = PARENTS[node] < 0
        yield node, f"{indent}{'ROOT' if root else 'JOINT'} {NODES[node]}"
        yield -1, f"{indent}{{"
        offset = geometry.joint_offsets[node] * CENTIMETRES
        yield -1, f"{inner}OFFSET {_decimal(offset, 8)}"
        channels = f"6 {_POSITIONS} {_ROTATIONS}" if root else f"3 {_ROTATIONS}"
        yield -1, f"{inner}CHANNELS {channels}"
        for child, parent in enumerate(PARENTS):
            if parent == node:
                yield from block(child, depth + 1)
        if node in ends:
            yield -1, f"{inner}End Site"
            yield -1, f"{inner}{{"
            yield -1, f"{inner}  OFFSET {_decimal(ends[node] * CENTIMETRES, 8)}"
            yield -1, f"{inner}}}"
        yield -1, f"{indent}}}"

    yield from block(PARENTS.index(-1), 0)


def write_bvh(path: str | Path, motion: Motion) -> None:
    """Write a motion as a BVH file, atomically.

    The joints are the 18 nodes with End Sites at the top of the head, the fingertips and the toe
    tips. The root has six channels, every other joint Zrotation Xrotation Yrotation, unwrapped
    in time. Joint positions survive the file to better than 10⁻⁵ mm.

    Parameters
    ----------
    path : the file. motion : metres and radians; written as cm and degrees at its own rate.
    """
    lines = list(_hierarchy(motion))
    order = [node for node, _ in lines if node >= 0]
    rotations = joint_rotations(motion.coordinates)
    angles = [np.degrees(np.unwrap(euler_zxy(rotations[node]), axis=0)) for node in order]
    rows = np.hstack([motion.coordinates[:, :3] * CENTIMETRES, *angles])
    with atomic_write(path) as handle:
        handle.write("HIERARCHY\n")
        handle.writelines(f"{line}\n" for _, line in lines)
        handle.write(f"MOTION\nFrames: {motion.frames}\n")
        handle.write(f"Frame Time: {1.0 / motion.rate_hz:.12f}\n")
        handle.writelines(f"{_decimal(row, 8)}\n" for row in rows)
