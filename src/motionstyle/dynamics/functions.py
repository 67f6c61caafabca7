"""The functions of one frame that the optimisers call: inverse dynamics and foot points."""

from __future__ import annotations

from functools import cache

import casadi as ca

from motionstyle.body.layout import CONTACT_POINTS, COORDINATES
from motionstyle.dynamics.inverse import inverse_dynamics
from motionstyle.dynamics.symbols import BodyParameters

COUNT, POINTS = len(COORDINATES), len(CONTACT_POINTS)


@cache
def dynamics_functions() -> tuple[ca.Function, ...]:
    """Return `forces` (τ alone) and `forces_and_slopes` (τ and its Jacobians).

    Arguments of both: q, q̇, q̈ (35), contact forces (24), body parameters. Outputs: τ (35), then
    ∂τ/∂q, ∂τ/∂q̇, ∂τ/∂q̈ (35, 35) and ∂τ/∂f (35, 24).
    """
    q, qd, qdd = (ca.SX.sym(name, COUNT) for name in ("q", "qd", "qdd"))
    f, body = ca.SX.sym("f", 3 * POINTS), BodyParameters.symbolic()
    found = inverse_dynamics(q, qd, qdd, f, body)
    arguments = [q, qd, qdd, f, body.vector]
    slopes = [found.by_q, found.by_qd, found.by_qdd, found.by_force]
    return (
        ca.Function("forces", arguments, [ca.densify(found.tau)]),
        ca.Function("forces_and_slopes", arguments, [ca.densify(found.tau), *slopes]),
    )
