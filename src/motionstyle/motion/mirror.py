"""Left–right mirrored motions: reflection in the sagittal plane z = 0."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.body import Body, BodyGeometry
from motionstyle.body.layout import CONTACT_POINTS, END_POINTS, NODES, mirrored_coordinates
from motionstyle.motion.motion import Motion

_REFLECT = np.array([1.0, 1.0, -1.0])


def _swap_sides(names: Sequence[str]) -> NDArray[np.int64]:
    """Return the order of `names` with `_r` and `_l` exchanged."""
    other = {"_r": "_l", "_l": "_r"}
    return np.array([names.index(n[:-2] + other.get(n[-2:], n[-2:])) for n in names])


_NODES = _swap_sides(NODES)
_CONTACTS = _swap_sides(CONTACT_POINTS)
_ENDS = _swap_sides(END_POINTS)


def mirror_body(body: Body) -> Body:
    """Return the body whose left side is the right side of `body`, and the other way round.

    Lengths in m, masses in kg; of the inertias (kg·m²) the products with z change sign.
    """
    geometry = BodyGeometry(
        joint_offsets=body.geometry.joint_offsets[_NODES] * _REFLECT,
        contact_points=body.geometry.contact_points[_CONTACTS] * _REFLECT,
        end_points=body.geometry.end_points[_ENDS] * _REFLECT,
    )
    return replace(
        body,
        geometry=geometry,
        masses=body.masses[_NODES],
        coms=body.coms[_NODES] * _REFLECT,
        inertias=body.inertias[_NODES] * np.outer(_REFLECT, _REFLECT),
        semi_axes=body.semi_axes[_NODES],
    )


def mirror_motion(motion: Motion) -> Motion:
    """Return the left–right mirrored motion, named `<id>_mirror`.

    The person, the coordinates and which of them are observed, contacts, normals and forces are
    those seen in a mirror at the plane z = 0. The mirror image of a mirror image is the original
    motion, name included.
    """
    order, sign = mirrored_coordinates()
    forces = motion.contact_forces
    provenance = dict(motion.provenance)
    if provenance.pop("mirrored", False):
        name = motion.id.removesuffix("_mirror")
    else:
        name = f"{motion.id}_mirror"
        provenance["mirrored"] = True
    return replace(
        motion,
        id=name,
        coordinates=motion.coordinates[:, order] * sign,
        body=mirror_body(motion.body),
        contacts=motion.contacts[:, _CONTACTS],
        contact_normals=motion.contact_normals[:, _CONTACTS] * _REFLECT,
        contact_forces=None if forces is None else forces[:, _CONTACTS] * _REFLECT,
        observed=motion.observed[order],
        provenance=provenance,
    )
