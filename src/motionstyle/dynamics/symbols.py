"""Symbolic building blocks: exponential maps without branches or singularities, body parameters.

The exponential map R(v) and its right Jacobian need c1 = (1−cos θ)/θ² and c2 = (θ−sin θ)/θ³ of
θ = ‖v‖; as power series in s = θ² they are smooth at zero. TERMS terms are exact to rounding up to
θ = 5.5 rad, the largest angle `body.rotations.unroll` lets through.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from motionstyle.body.body import Body
from motionstyle.body.layout import CONTACT_POINTS, NODES

TERMS = 18
INERTIA_ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def _series(s: ca.SX, coefficients: list[float]) -> ca.SX:
    value = ca.SX(coefficients[-1])
    for coefficient in reversed(coefficients[:-1]):
        value = coefficient + s * value
    return value


@dataclass(frozen=True)
class ExponentialMap:
    """R(v), the right Jacobian J with child-frame angular velocity ω = J v̇, and J̇ v̇."""

    rotation: ca.SX
    jacobian: ca.SX
    jacobian_rate: ca.SX


def exponential_map(v: ca.SX, v_dot: ca.SX) -> ExponentialMap:
    """Return the exponential map of v (3) and its rates for v̇ (Grassia 1998).

    R = I + (1 − s c2)[v]× + c1[v]×², J = I − c1[v]× + c2[v]×².
    """
    s = ca.dot(v, v)
    c1_terms = [(-1) ** k / factorial(2 * k + 2) for k in range(TERMS)]
    c2_terms = [(-1) ** k / factorial(2 * k + 3) for k in range(TERMS)]
    c1, c2 = _series(s, c1_terms), _series(s, c2_terms)
    slope1 = _series(s, [k * c for k, c in enumerate(c1_terms)][1:])
    slope2 = _series(s, [k * c for k, c in enumerate(c2_terms)][1:])
    outer, square = v @ v.T, s * ca.SX.eye(3)
    cross, cross_squared = ca.skew(v), outer - square
    rotation = ca.SX.eye(3) + (1 - s * c2) * cross + c1 * cross_squared
    jacobian = ca.SX.eye(3) - c1 * cross + c2 * cross_squared
    s_dot = 2 * ca.dot(v, v_dot)
    turned = ca.cross(v, v_dot)
    rate = (
        -slope1 * s_dot * turned
        + slope2 * s_dot * ca.cross(v, turned)
        + c2 * ca.cross(v_dot, turned)
    )
    return ExponentialMap(rotation, jacobian, rate)


@dataclass(frozen=True)
class BodyParameters:
    """What the dynamics need to know of a body, as one vector: lengths m, masses kg, kg·m².

    Order: joint offsets (18·3), masses (18), centres of mass (18·3), inertias about them
    (18·6: xx yy zz xy xz yz), contact points (8·3).
    """

    vector: ca.SX
    offsets: list[ca.SX]
    masses: list[ca.SX]
    coms: list[ca.SX]
    inertias: list[ca.SX]
    points: list[ca.SX]

    @staticmethod
    def symbolic() -> BodyParameters:
        """Return symbols for all parameters."""
        count = len(NODES)
        offsets, masses = ca.SX.sym("r", 3, count), ca.SX.sym("m", count)
        coms, inertias = ca.SX.sym("c", 3, count), ca.SX.sym("I", 6, count)
        points = ca.SX.sym("p", 3, len(CONTACT_POINTS))
        vector = ca.vertcat(*(ca.vec(x) for x in (offsets, masses, coms, inertias, points)))
        return BodyParameters(
            vector,
            [offsets[:, i] for i in range(count)],
            [masses[i] for i in range(count)],
            [coms[:, i] for i in range(count)],
            [_symmetric(inertias[:, i]) for i in range(count)],
            [points[:, i] for i in range(len(CONTACT_POINTS))],
        )


def _symmetric(entries: ca.SX) -> ca.SX:
    xx, yy, zz, xy, xz, yz = (entries[k] for k in range(6))
    return ca.vertcat(ca.horzcat(xx, xy, xz), ca.horzcat(xy, yy, yz), ca.horzcat(xz, yz, zz))


def parameter_vector(body: Body) -> NDArray[np.float64]:
    """Return a body's parameters in the order of `BodyParameters`."""
    inertias = np.array([[i[a, b] for a, b in INERTIA_ENTRIES] for i in body.inertias])
    return np.concatenate(
        [
            body.joint_offsets.ravel(),
            body.masses,
            body.coms.ravel(),
            inertias.ravel(),
            body.geometry.contact_points.ravel(),
        ]
    )
