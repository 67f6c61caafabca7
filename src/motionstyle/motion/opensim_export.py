"""Motions as OpenSim storage files: joint angles, joint moments and ground reaction forces.

Columns have the names and signs of the coordinates of Rajagopal's full-body model (2016), whose
axes are ours: x forward, y up, z to the right. Ball joints, exponential maps here, become Cardan
angles in the order z-x-y; the two joints of the spine become one, thorax in pelvis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.kinematics import Pose, contact_points
from motionstyle.body.layout import CONTACT_POINTS, COORDINATE_INDEX, NODE_INDEX
from motionstyle.errors import MotionStyleError
from motionstyle.files import atomic_write
from motionstyle.motion.bvh_export import euler_zxy
from motionstyle.motion.motion import Motion

Array = NDArray[np.float64]
PUSHING_N = 1e-6  # a foot that pushes with less has no centre of pressure


@dataclass(frozen=True)
class BallJoint:
    """Three coordinates of OpenSim: their names, the nodes they join, and the sign of each.

    node : whose joint of the body bears the moment; `child` is where the angles end.
    """

    names: tuple[str, str, str]
    parent: str | None
    node: str
    child: str
    signs: tuple[float, float, float] = (1.0, 1.0, 1.0)


def _sided(name: str, parent: str, node: str, parts: Sequence[str]) -> list[BallJoint]:
    return [
        BallJoint(
            tuple(f"{name}_{part}_{side}" for part in parts),  # type: ignore[arg-type]
            parent,
            f"{node}_{side}",
            f"{node}_{side}",
            (1.0, mirror, mirror),
        )
        for side, mirror in (("r", 1.0), ("l", -1.0))
    ]


PELVIS = BallJoint(("pelvis_tilt", "pelvis_list", "pelvis_rotation"), None, "pelvis", "pelvis")
BALL_JOINTS = (
    *_sided("hip", "pelvis", "thigh", ("flexion", "adduction", "rotation")),
    BallJoint(
        ("lumbar_extension", "lumbar_bending", "lumbar_rotation"), "pelvis", "abdomen", "thorax"
    ),
    *_sided("arm", "thorax", "upper_arm", ("flex", "add", "rot")),
)
TRANSLATIONS = ("pelvis_tx", "pelvis_ty", "pelvis_tz")
# OpenSim's name → ours, of joints that are hinges in both.
HINGES = {
    f"{theirs}_{side}": f"{ours}_{side}"
    for side in "rl"
    for theirs, ours in (
        ("knee_angle", "knee_flexion"),
        ("ankle_angle", "ankle_dorsiflexion"),
        ("subtalar_angle", "foot_inversion"),
        ("mtp_angle", "toes_extension"),
        ("elbow_flex", "elbow_flexion"),
    )
} | {name: name for name in ("head_flexion", "head_rotation")}


def _relative(pose: Pose, joint: BallJoint) -> Array:
    """Return the rotation of the joint's child in its parent, (F, 3, 3)."""
    child = pose.rotations[:, NODE_INDEX[joint.child]]
    if joint.parent is None:
        return child
    return np.swapaxes(pose.rotations[:, NODE_INDEX[joint.parent]], 1, 2) @ child


def cardan_axes(pose: Pose, joint: BallJoint) -> Array:
    """Return the world axis of each of a ball joint's three coordinates, (F, 3, 3).

    A moment's share along an axis is what works on that coordinate.
    """
    child = pose.rotations[:, NODE_INDEX[joint.child]]
    parent = (
        np.broadcast_to(np.eye(3), child.shape)
        if joint.parent is None
        else pose.rotations[:, NODE_INDEX[joint.parent]]
    )
    z = euler_zxy(_relative(pose, joint))[:, 0]
    line = np.stack([np.cos(z), np.sin(z), np.zeros_like(z)], axis=1)  # of nodes, in the parent
    middle = np.einsum("fab,fb->fa", parent, line)
    axes = np.stack([parent[..., 2], middle, child[..., 1]], axis=1)
    return axes * np.array(joint.signs)[:, None]


def opensim_angles(motion: Motion) -> dict[str, Array]:
    """Return OpenSim's coordinates by name, (F,) each: translations in m, angles in degrees."""
    pose = motion.pose()
    columns: dict[str, Array] = {}

    def put(joint: BallJoint) -> None:
        angles = np.unwrap(euler_zxy(_relative(pose, joint)), axis=0) * joint.signs
        columns.update(zip(joint.names, np.degrees(angles).T, strict=True))

    put(PELVIS)
    columns.update({n: motion.coordinates[:, COORDINATE_INDEX[n]] for n in TRANSLATIONS})
    for joint in BALL_JOINTS:
        put(joint)
    for theirs, ours in HINGES.items():
        columns[theirs] = np.degrees(motion.coordinates[:, COORDINATE_INDEX[ours]])
    return columns


def ground_reactions(motion: Motion) -> dict[str, Array]:
    """Return force, point and torque under each foot by OpenSim's names of external loads.

    ground_force_r_vx … N on the person; ground_force_r_px … the centre of pressure, m, the mean
    of the foot's points weighted by their vertical force; ground_torque_r_x … N·m about it, so
    that force and torque together are the wrench of all points. A foot that does not push has
    zeros throughout.

    Raises
    ------
    MotionStyleError
        If the motion has no contact forces.
    """
    need_forces(motion)
    points = contact_points(motion.body, motion.pose())
    columns: dict[str, Array] = {}
    for side in "rl":
        own = [i for i, name in enumerate(CONTACT_POINTS) if name.endswith(f"_{side}")]
        forces, places = motion.contact_forces[:, own], points[:, own]
        total = forces.sum(axis=1)
        pushing = total[:, 1:2] > PUSHING_N
        weights = forces[..., 1:2]
        centre = (weights * places).sum(axis=1) / np.where(pushing, total[:, 1:2], 1.0)
        centre = np.where(pushing, centre, 0.0)
        torque = np.cross(places - centre[:, None], forces).sum(axis=1)
        for kind, values in (("force_{}_v", total), ("force_{}_p", centre), ("torque_{}_", torque)):
            for axis, letter in enumerate("xyz"):
                columns[f"ground_{kind.format(side)}{letter}"] = values[:, axis]
    return columns


def need_forces(motion: Motion) -> None:
    """Refuse a motion without contact forces.

    Raises
    ------
    MotionStyleError
        Saying where such a motion comes from.
    """
    if motion.contact_forces is None:
        raise MotionStyleError(
            f"motion {motion.id}: it has no contact forces, so no moments and no ground "
            f"reactions; ask for the physical motion ({motion.id}_physical) instead"
        )


def write_storage(
    path: str | Path, name: str, times: Array, columns: dict[str, Array], *, in_degrees: bool
) -> None:
    """Write columns (F,) as an OpenSim storage file (.mot, .sto), atomically.

    Parameters
    ----------
    name : the table's name, its first line. times : s, (F,).
    in_degrees : what the header says of the angles among the columns.
    """
    header = [
        name,
        "version=1",
        f"nRows={len(times)}",
        f"nColumns={1 + len(columns)}",
        f"inDegrees={'yes' if in_degrees else 'no'}",
        "endheader",
        "\t".join(["time", *columns]),
    ]
    rows = np.column_stack([times, *columns.values()]) + 0.0
    with atomic_write(path) as handle:
        handle.writelines(f"{line}\n" for line in header)
        handle.writelines("\t".join(f"{v:.9g}" for v in row) + "\n" for row in rows)


def write_no_motion(path: str | Path, reason: str) -> None:
    """Write a storage file without rows whose first line says why the motion is not there."""
    write_storage(path, f"no motion: {reason}", np.zeros(0), {}, in_degrees=False)


def write_external_loads(path: str | Path, forces_file: str) -> None:
    """Write OpenSim's description of which columns of `forces_file` push which body.

    With it, the storage files of `write_storage` and a scaled model, OpenSim's own inverse
    dynamics tool runs. The heel and its joint carry the whole foot's force (`calcn`).
    """
    feet = "".join(
        f"""      <ExternalForce name="{side}">
        <applied_to_body>calcn_{side}</applied_to_body>
        <force_expressed_in_body>ground</force_expressed_in_body>
        <point_expressed_in_body>ground</point_expressed_in_body>
        <force_identifier>ground_force_{side}_v</force_identifier>
        <point_identifier>ground_force_{side}_p</point_identifier>
        <torque_identifier>ground_torque_{side}_</torque_identifier>
      </ExternalForce>
"""
        for side in "rl"
    )
    with atomic_write(path) as handle:
        handle.write(
            '<?xml version="1.0" encoding="UTF-8"?>\n<OpenSimDocument Version="40000">\n'
            '  <ExternalLoads name="ground_reactions">\n    <objects>\n'
            f"{feet}    </objects>\n    <datafile>{forces_file}</datafile>\n"
            "  </ExternalLoads>\n</OpenSimDocument>\n"
        )
