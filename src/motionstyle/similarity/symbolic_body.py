"""Forward kinematics of one frame for CasADi: foot points and centres of mass."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from motionstyle.body.body import Body
from motionstyle.body.layout import (
    CONTACT_POINT_NODES,
    COORDINATES,
    JOINT_SLICES,
    JOINTS,
    NODES,
    PARENTS,
)
from motionstyle.dynamics.symbols import exponential_map


@dataclass(frozen=True)
class SymbolicPose:
    """Foot points (3, 8) and node centres of mass (3, 18), m, and the pelvis' forward axis (3)."""

    points: ca.SX
    coms: ca.SX
    forward: ca.SX


def _hinge(axis: np.ndarray, angle: ca.SX) -> ca.SX:
    """Return the rotation about a fixed unit axis."""
    cross = ca.skew(ca.DM(axis))
    return ca.DM.eye(3) + ca.sin(angle) * cross + (1 - ca.cos(angle)) * cross @ cross


def symbolic_pose(body: Body, q: ca.SX) -> SymbolicPose:
    """Return where a body's foot points and masses are for coordinates q (35)."""
    rotations: list[ca.SX] = []
    places: list[ca.SX] = []
    still = ca.SX.zeros(3)
    for i, (joint, block) in enumerate(zip(JOINTS, JOINT_SLICES, strict=True)):
        own = q[block.start : block.stop]
        axes = np.array(joint.axes).reshape(-1, 3)
        if joint.kind == "free":
            rotations.append(exponential_map(own[3:], still).rotation)
            places.append(own[:3])
            continue
        if joint.kind == "exponential":
            local = exponential_map(ca.DM(axes.T) @ own, still).rotation
        else:
            local = ca.SX.eye(3)
            for k, axis in enumerate(axes if joint.kind == "hinges" else []):
                local = local @ _hinge(axis, own[k])
        parent = PARENTS[i]
        places.append(places[parent] + rotations[parent] @ ca.DM(body.joint_offsets[i]))
        rotations.append(rotations[parent] @ local)
    points = [
        places[node] + rotations[node] @ ca.DM(local)
        for node, local in zip(CONTACT_POINT_NODES, body.geometry.contact_points, strict=True)
    ]
    coms = [places[i] + rotations[i] @ ca.DM(body.coms[i]) for i in range(len(NODES))]
    return SymbolicPose(ca.horzcat(*points), ca.horzcat(*coms), rotations[0][:, 0])


def pose_function(body: Body) -> ca.Function:
    """Return q (35) → foot points (3, 8), centres of mass (3, 18), forward axis (3)."""
    q = ca.SX.sym("q", len(COORDINATES))
    pose = symbolic_pose(body, q)
    return ca.Function("pose", [q], [pose.points, pose.coms, pose.forward])
