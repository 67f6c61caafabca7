"""Edits as data: what is changed in a body, its joint ranges, its shoes and the ground.

Liu et al. 2005, §7: a suitcase, a locked knee, a stiff hip, springier shoes, a skating rink,
another body. Gravity stays. An `Edits` value is applied piece by piece; each function returns a
new value.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.body import Body, BodyGeometry
from motionstyle.body.layout import COORDINATE_INDEX, JOINT_COORDINATES, NODE_INDEX
from motionstyle.body.ranges import joint_ranges
from motionstyle.errors import MotionStyleError, near_matches
from motionstyle.motion.motion import Motion
from motionstyle.spacetime.foot_constraints import FootConstraints

Array = NDArray[np.float64]

RANGE_MARGIN_DEG = 5.0  # joint ranges are widened to the example's own range and this much more
LOCK_HALF_WIDTH_DEG = 0.5  # a locked joint may move this much, so that an interior exists


@dataclass(frozen=True)
class Load:
    """A point mass (kg) fixed to a node, at `offset_m` (3) in the node's frame."""

    node: str
    mass_kg: float
    offset_m: tuple[float, float, float]


SUITCASE = Load("hand_r", 3.0, (0.0, -0.25, 0.0))  # the hand's frame has its origin at the wrist


@dataclass(frozen=True)
class Edits:
    """Changes to an example's world; the default changes nothing.

    Attributes
    ----------
    loads : point masses added to nodes.
    locked : angle in degrees by joint coordinate, e.g. `knee_flexion_l`.
    narrowed : factor by joint coordinate: the range seen in the example, scaled about its middle.
    shoe_stiffness, shoe_rest_length : factors of the style's shoes.
    friction : coefficient of the ground, for all points; None leaves it.
    length_scale, mass_scale : factors of the body's lengths and masses; inertias follow.
    """

    loads: tuple[Load, ...] = ()
    locked: Mapping[str, float] = field(default_factory=dict)
    narrowed: Mapping[str, float] = field(default_factory=dict)
    shoe_stiffness: float = 1.0
    shoe_rest_length: float = 1.0
    friction: float | None = None
    length_scale: float = 1.0
    mass_scale: float = 1.0

    def __post_init__(self) -> None:
        joints = [n for n, k in COORDINATE_INDEX.items() if k >= JOINT_COORDINATES.start]
        for name in (*self.locked, *self.narrowed):
            if name not in joints:
                near = near_matches(name, joints)
                raise MotionStyleError(f"edits: {name!r} is not a joint coordinate{near}")
        for load in self.loads:
            if load.node not in NODE_INDEX:
                near = near_matches(load.node, list(NODE_INDEX))
                raise MotionStyleError(f"edits: {load.node!r} is not a node of the body{near}")
            if not np.isfinite([load.mass_kg, *load.offset_m]).all():
                raise MotionStyleError(f"edits: the load at {load.node} has values not finite")
        factors = {
            "length_scale": self.length_scale,
            "mass_scale": self.mass_scale,
            **{f"narrow {name}": value for name, value in self.narrowed.items()},
        }
        for name, value in factors.items():
            if not 0 < value < np.inf:
                raise MotionStyleError(f"edits: {name} is {value}; it must be a factor above 0")
        for name, value in (
            ("shoe_stiffness", self.shoe_stiffness),
            ("shoe_rest_length", self.shoe_rest_length),
            ("friction", 0.0 if self.friction is None else self.friction),
        ):
            if not 0 <= value < np.inf:
                raise MotionStyleError(f"edits: {name} is {value}; it must not be negative")


def edit_body(body: Body, edits: Edits) -> Body:
    """Return the body with other lengths and masses, then with its loads.

    Lengths scale with `length_scale`, masses with `mass_scale`, inertias with both, as if density
    changed alone; loads are added by the parallel-axis theorem.

    Raises
    ------
    MotionStyleError
        If a node, or the body, is left without mass.
    """
    size, mass = edits.length_scale, edits.mass_scale
    geometry = BodyGeometry(
        body.geometry.joint_offsets * size,
        body.geometry.contact_points * size,
        body.geometry.end_points * size,
    )
    edited = replace(
        body,
        geometry=geometry,
        masses=body.masses * mass,
        coms=body.coms * size,
        inertias=body.inertias * mass * size**2,
        semi_axes=body.semi_axes * size,
    )
    for load in edits.loads:
        edited = _loaded(edited, load)
    if not (edited.masses > 0).all():
        node = list(NODE_INDEX)[int(np.argmin(edited.masses))]
        raise MotionStyleError(
            f"edits: {node} is left with {edited.masses.min():.3g} kg; masses must be positive"
        )
    if edits == Edits():
        return body
    return replace(edited, mass_source=f"{body.mass_source}, edited")


def _loaded(body: Body, load: Load) -> Body:
    """Return the body with a point mass fixed to one node."""
    i = NODE_INDEX[load.node]
    masses, coms, inertias = body.masses.copy(), body.coms.copy(), body.inertias.copy()
    place = np.array(load.offset_m)
    total = masses[i] + load.mass_kg
    if not total > 0:
        raise MotionStyleError(
            f"edits: {load.node} is left with {total:.3g} kg; masses must be positive"
        )
    centre = (masses[i] * coms[i] + load.mass_kg * place) / total
    inertias[i] = (
        inertias[i] + masses[i] * _about(coms[i] - centre) + load.mass_kg * _about(place - centre)
    )
    masses[i], coms[i] = total, centre
    return replace(body, masses=masses, coms=coms, inertias=inertias)


def _about(arm: Array) -> Array:
    """Return the inertia of a unit point mass at the end of an arm, (3, 3)."""
    return (arm @ arm) * np.eye(3) - np.outer(arm, arm)


def edit_ranges(example: Motion, edits: Edits) -> Array:
    """Return bounds of the coordinates, (35, 2): joint ranges, widened to the example, edited.

    Narrowed joints keep to the example's own range, scaled about its middle; locked ones stay
    within half a degree of their angle. The six root coordinates are unbounded.
    """
    ranges = joint_ranges()
    low, high = example.coordinates.min(axis=0), example.coordinates.max(axis=0)
    margin = np.radians(RANGE_MARGIN_DEG)
    ranges[:, 0] = np.minimum(ranges[:, 0], low - margin)
    ranges[:, 1] = np.maximum(ranges[:, 1], high + margin)
    for name, factor in edits.narrowed.items():
        k = COORDINATE_INDEX[name]
        middle, half = (low[k] + high[k]) / 2, factor * (high[k] - low[k]) / 2
        ranges[k] = middle - half, middle + half
    for name, degrees in edits.locked.items():
        width = LOCK_HALF_WIDTH_DEG
        ranges[COORDINATE_INDEX[name]] = np.radians([degrees - width, degrees + width])
    return ranges


def edit_constraints(constraints: FootConstraints, edits: Edits) -> FootConstraints:
    """Return the constraints on ground of another friction."""
    if edits.friction is None:
        return constraints
    return replace(constraints, friction=np.full_like(constraints.friction, edits.friction))


def edit_shoes(stiffness: float, rest_length: float, edits: Edits) -> tuple[float, float]:
    """Return k_shoe (N/m) and h̄ (m) of the edited shoes."""
    return stiffness * edits.shoe_stiffness, rest_length * edits.shoe_rest_length


def into_ranges(coordinates: Array, ranges: Array) -> Array:
    """Return coordinates (F, 35) clipped to bounds (35, 2): a start that a locked joint allows."""
    return np.clip(coordinates, ranges[:, 0], ranges[:, 1])
