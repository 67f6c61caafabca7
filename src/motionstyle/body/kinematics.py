"""Forward kinematics of the body in NumPy, all frames at once, with geometric Jacobians.

Shapes: F frames, 18 nodes, 35 coordinates; the time axis comes first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.body import Body
from motionstyle.body.layout import (
    CONTACT_POINT_NODES,
    COORDINATE_NODE,
    COORDINATES,
    END_POINT_NODES,
    JOINT_SLICES,
    JOINTS,
    NODES,
    PARENTS,
)
from motionstyle.body.rotations import exponential, left_jacobian

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Pose:
    """World poses of the nodes: joint centres (F, 18, 3) in m and rotations (F, 18, 3, 3)."""

    positions: Array
    rotations: Array


def _subtree_table() -> NDArray[np.bool_]:
    """Return whether each node (18) moves with each coordinate (35), (18, 35)."""
    table = np.zeros((len(NODES), len(COORDINATES)), dtype=bool)
    for node in range(len(NODES)):
        ancestor = node
        while ancestor >= 0:
            table[node] |= np.array(COORDINATE_NODE) == ancestor
            ancestor = PARENTS[ancestor]
    return table


MOVES_WITH = _subtree_table()


def joint_rotations(coordinates: Array) -> list[Array]:
    """Return each node's rotation in its parent's frame, 18 arrays of shape (F, 3, 3)."""
    identity = np.broadcast_to(np.eye(3), (len(coordinates), 3, 3))
    rotations = []
    for joint, block in zip(JOINTS, JOINT_SLICES, strict=True):
        q = coordinates[:, block]
        axes = np.array(joint.axes).reshape(-1, 3)
        if joint.kind == "free":
            rotations.append(exponential(q[:, 3:]))
        elif joint.kind == "exponential":
            rotations.append(exponential(q @ axes))
        elif joint.kind == "hinges":
            turned = identity
            for k, axis in enumerate(axes):
                turned = turned @ exponential(q[:, k : k + 1] * axis)
            rotations.append(turned)
        else:
            rotations.append(identity)
    return rotations


def forward_kinematics(body: Body, coordinates: Array) -> Pose:
    """Return world joint centres and rotations of all nodes for coordinates (F, 35)."""
    frames = len(coordinates)
    positions = np.empty((frames, len(NODES), 3))
    rotations = np.empty((frames, len(NODES), 3, 3))
    for i, local in enumerate(joint_rotations(coordinates)):
        parent = PARENTS[i]
        if parent < 0:
            positions[:, i], rotations[:, i] = coordinates[:, :3], local
        else:
            positions[:, i] = positions[:, parent] + rotations[:, parent] @ body.joint_offsets[i]
            rotations[:, i] = rotations[:, parent] @ local
    return Pose(positions, rotations)


def points_in_world(pose: Pose, nodes: NDArray[np.int64], local: Array) -> Array:
    """Return world positions (F, P, 3) of points given by node index (P,) and offset (P, 3)."""
    turned = np.einsum("fpab,pb->fpa", pose.rotations[:, nodes], local)
    return pose.positions[:, nodes] + turned


def contact_points(body: Body, pose: Pose) -> Array:
    """Return world positions (F, 8, 3) of heels, balls and toes, in `layout.CONTACT_POINTS`."""
    return points_in_world(pose, np.array(CONTACT_POINT_NODES), body.geometry.contact_points)


def end_points(body: Body, pose: Pose) -> Array:
    """Return world positions (F, 3, 3) of the head's top and the two fingertips."""
    return points_in_world(pose, np.array(END_POINT_NODES), body.geometry.end_points)


def centre_of_mass(body: Body, pose: Pose) -> Array:
    """Return the whole body's centre of mass, (F, 3), m."""
    coms = points_in_world(pose, np.arange(len(NODES)), body.coms)
    return np.einsum("n,fna->fa", body.masses, coms) / body.mass


def coordinate_axes(pose: Pose, coordinates: Array) -> Array:
    """Return the world axis of each coordinate, (F, 35, 3).

    A unit rate of coordinate j turns the nodes beyond it at this angular velocity; for the
    three root translations it is the direction of motion.
    """
    frames = len(coordinates)
    axes = np.empty((frames, len(COORDINATES), 3))
    axes[:, :3] = np.eye(3)
    axes[:, 3:6] = np.swapaxes(left_jacobian(coordinates[:, 3:6]), 1, 2)
    for i, (joint, block) in enumerate(zip(JOINTS, JOINT_SLICES, strict=True)):
        if joint.kind not in {"exponential", "hinges"}:
            continue
        parent = pose.rotations[:, PARENTS[i]]
        local = np.array(joint.axes)
        q = coordinates[:, block]
        if joint.kind == "exponential":
            in_parent = np.einsum("fab,kb->fka", left_jacobian(q @ local), local)
        else:
            in_parent = np.empty((frames, len(local), 3))
            turned = np.broadcast_to(np.eye(3), (frames, 3, 3))
            for k, axis in enumerate(local):
                in_parent[:, k] = turned @ axis
                turned = turned @ exponential(q[:, k : k + 1] * axis)
        axes[:, block] = np.einsum("fab,fkb->fka", parent, in_parent)
    return axes


def point_jacobian(
    pose: Pose,
    axes: Array,
    nodes: NDArray[np.int64],
    points: Array,
    columns: NDArray[np.int64] | None = None,
) -> Array:
    """Return ∂points/∂coordinates, (F, P, 3, C), for world points (F, P, 3) on `nodes` (P,).

    `axes` are those of `coordinate_axes`; `columns` (C,) picks coordinates, by default all 35.
    """
    if columns is None:
        columns = np.arange(len(COORDINATES))
    origins = pose.positions[:, np.array(COORDINATE_NODE)[columns]]
    x, y, z = (points[:, :, None, k] - origins[:, None, :, k] for k in range(3))
    a, b, c = (axes[:, None, columns, k] for k in range(3))
    jacobian = np.empty((*points.shape, len(columns)))
    jacobian[:, :, 0] = b * z - c * y
    jacobian[:, :, 1] = c * x - a * z
    jacobian[:, :, 2] = a * y - b * x
    translations = columns < 3
    jacobian[..., translations] = axes[:, None, columns[translations]].swapaxes(2, 3)
    jacobian *= MOVES_WITH[nodes][:, columns][None, :, None, :]
    return jacobian
