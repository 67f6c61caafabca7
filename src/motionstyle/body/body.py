"""`Body`: one person's segment lengths, masses, inertias and contact points.

Liu et al. 2005, §3: ellipsoids with masses from de Leva 1996. Here the centre of mass lies at
de Leva's fraction of the segment, and the inertia comes from his radii of gyration ("table") or
from a uniform ellipsoid of the segment's length ("ellipsoid", the paper's way).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.anthropometry import (
    BALL_FRACTION,
    DE_LEVA,
    REARFOOT_MASS_FRACTION,
    TOES_COM_FRACTION,
    TRUNK_LENGTHS,
    Sex,
    total_mass,
)
from motionstyle.body.layout import CONTACT_POINTS, NODE_INDEX, NODES
from motionstyle.errors import MotionStyleError

Array = NDArray[np.float64]
InertiaModel = Literal["table", "ellipsoid"]
DENSITY = 1000.0  # kg/m³


@dataclass(frozen=True)
class BodyGeometry:
    """Measured lengths of one person, in metres, in the zero pose's axes.

    Attributes
    ----------
    joint_offsets : each node's joint centre in its parent's frame, (18, 3); the pelvis' is 0.
    contact_points : heel, ball (medial, lateral) and toe of each foot in the frame of the node
        they belong to, (8, 3), in the order of `layout.CONTACT_POINTS`.
    end_points : top of the head and fingertips in their nodes' frames, (3, 3).
    """

    joint_offsets: Array
    contact_points: Array
    end_points: Array


@dataclass(frozen=True)
class Body:
    """A body with masses (kg), centres of mass (m) and inertias (kg·m²) in the node frames.

    Attributes
    ----------
    geometry : lengths, see `BodyGeometry`.
    masses : (18,). coms : (18, 3). inertias : about the centres of mass, (18, 3, 3).
    semi_axes : of the uniform ellipsoids of the same inertia and mass, for drawing, (18, 3), m.
    sex, mass_source : whose table rows, and where the total mass comes from.
    """

    geometry: BodyGeometry
    masses: Array
    coms: Array
    inertias: Array
    semi_axes: Array
    sex: Sex
    mass_source: str

    @property
    def joint_offsets(self) -> Array:
        """Joint centres in the parents' frames, (18, 3), m."""
        return self.geometry.joint_offsets

    @property
    def mass(self) -> float:
        """Total mass in kg."""
        return float(self.masses.sum())

    @property
    def leg_length(self) -> float:
        """Mean hip-to-ankle length in m."""
        lengths = [
            np.linalg.norm(self.joint_offsets[NODE_INDEX[f"{node}_{side}"]])
            for side in "rl"
            for node in ("shank", "foot")
        ]
        return float(sum(lengths) / 2)


def _ends(geometry: BodyGeometry, sex: Sex) -> dict[str, tuple[str, Array, Array]]:
    """Map each node to (table row, first end, other end) in its own frame.

    The trunk's parts are cut where the table cuts them, in its proportions along the line from
    mid-hip to neck, and not at the spine joints, which every source skeleton puts elsewhere.
    """
    offset = {name: geometry.joint_offsets[i] for i, name in enumerate(NODES)}
    points = dict(zip(CONTACT_POINTS, geometry.contact_points, strict=True))
    head_top, *fingertips = geometry.end_points
    origin = np.zeros(3)
    mid_hip = (offset["thigh_r"] + offset["thigh_l"]) / 2
    thorax = offset["abdomen"] + offset["thorax"]
    neck = thorax + offset["head"]
    lower, middle, upper = TRUNK_LENGTHS[sex]
    whole = lower + middle + upper
    omphalion = mid_hip + lower / whole * (neck - mid_hip)
    xiphion = mid_hip + (lower + middle) / whole * (neck - mid_hip)
    ends = {
        "pelvis": ("lower_trunk", omphalion, mid_hip),
        "abdomen": ("middle_trunk", xiphion - offset["abdomen"], omphalion - offset["abdomen"]),
        "thorax": ("upper_trunk", neck - thorax, xiphion - thorax),
        "head": ("head", head_top, origin),
    }
    for side, fingertip in zip("rl", fingertips, strict=True):
        ends[f"thigh_{side}"] = ("thigh", origin, offset[f"shank_{side}"])
        ends[f"shank_{side}"] = ("shank", origin, offset[f"foot_{side}"])
        ends[f"foot_{side}"] = (
            "foot",
            points[f"heel_{side}"],
            offset[f"toes_{side}"] + points[f"toe_{side}"],
        )
        ends[f"toes_{side}"] = (
            "foot",
            points[f"heel_{side}"] - offset[f"toes_{side}"],
            points[f"toe_{side}"],
        )
        ends[f"upper_arm_{side}"] = ("upper_arm", origin, offset[f"forearm_{side}"])
        ends[f"forearm_{side}"] = ("forearm", origin, offset[f"hand_{side}"])
        ends[f"hand_{side}"] = ("hand", origin, fingertip)
    return ends


def _foot_split(node: str) -> tuple[float, float, float]:
    """Return (mass share, centre of mass fraction, length share) of the rear foot or the toes."""
    if node.startswith("toes"):
        return 1 - REARFOOT_MASS_FRACTION, TOES_COM_FRACTION, 1 - BALL_FRACTION
    return REARFOOT_MASS_FRACTION, float("nan"), BALL_FRACTION


def build_body(
    geometry: BodyGeometry,
    mass_kg: float,
    sex: Sex = "male",
    *,
    mass_source: str = "given",
    inertia: InertiaModel = "table",
) -> Body:
    """Give a geometry its masses and inertias (de Leva 1996; Liu et al. 2005, §3).

    Parameters
    ----------
    geometry : lengths in m.
    mass_kg : total body mass.
    sex : which half of de Leva's table.
    mass_source : where the mass comes from, kept for tables.
    inertia : radii of gyration from the table, or uniform ellipsoids of density 1000 kg/m³.

    Raises
    ------
    MotionStyleError
        If the mass is not positive or a segment has no length.
    """
    if not (np.isfinite(mass_kg) and mass_kg > 0):
        raise MotionStyleError(f"body mass is {mass_kg} kg; it must be a positive number")
    table, whole = DE_LEVA[sex], total_mass(sex)
    count = len(NODES)
    masses, coms = np.zeros(count), np.zeros((count, 3))
    inertias, semi_axes = np.zeros((count, 3, 3)), np.zeros((count, 3))
    for node, (row_name, first, other) in _ends(geometry, sex).items():
        i, row = NODE_INDEX[node], table[row_name]
        along = other - first
        length = float(np.linalg.norm(along))
        if not length > 1e-3:
            raise MotionStyleError(f"segment {node} has no length ({length:.4f} m)")
        mass, com = row.mass / whole * mass_kg, row.com
        gyration = np.array([row.sagittal, row.longitudinal, row.transverse]) * length
        if row_name == "foot":
            share, split_com, length_share = _foot_split(node)
            toes_share = 1 - REARFOOT_MASS_FRACTION
            rear_com = (row.com - toes_share * TOES_COM_FRACTION) / REARFOOT_MASS_FRACTION
            com = split_com if node.startswith("toes") else rear_com
            mass *= share
            # the foot's long axis is horizontal; its parts keep its cross-section
            squared = (np.array([row.longitudinal, row.transverse, row.sagittal]) * length) ** 2
            spread = squared.sum() / 2 - squared  # mean squares of x, y and z
            spread[0] *= length_share**2
            gyration = np.sqrt(spread.sum() - spread)
            length *= length_share
        direction = along / np.linalg.norm(along)
        if inertia == "ellipsoid":
            major = length / 2
            minor = np.sqrt(3 * mass / (4 * np.pi * DENSITY * major))
            axes_squared = np.full(3, minor**2)
            axes_squared[int(np.argmax(np.abs(direction)))] = major**2
            moments = mass / 5 * (axes_squared.sum() - axes_squared)
        else:
            moments = mass * gyration**2
        masses[i], coms[i] = mass, first + com * along
        if row_name == "foot":  # halfway between the sole and the joint above it
            coms[i, 1] /= 2
        inertias[i] = np.diag(moments)
        semi_axes[i] = np.sqrt(
            np.maximum(5 / (2 * mass) * (moments.sum() - 2 * moments), (0.1 * length) ** 2)
        )
    return Body(geometry, masses, coms, inertias, semi_axes, sex, mass_source)
