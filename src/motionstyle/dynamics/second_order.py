"""Second derivatives for Newton's method: of the dynamics and of the foot points.

Both are Hessians of a scalar, a row of multipliers times the function, by automatic
differentiation of the symbolic dynamics; exact, and compiled apart from the first derivatives
because the compiler takes a minute over them.
"""

from __future__ import annotations

from functools import cache

import casadi as ca

from motionstyle.body.layout import CONTACT_POINTS, COORDINATES
from motionstyle.dynamics.inverse import foot_points, inverse_forces
from motionstyle.dynamics.symbols import BodyParameters

COUNT, POINTS = len(COORDINATES), len(CONTACT_POINTS)


@cache
def second_order_functions() -> tuple[ca.Function, ...]:
    """Return `curvature`, `foot_points` and `foot_curvature`.

    curvature(q, q̇, q̈, f, y, body) : ∂²(yᵀτ)/∂u² of u = (q, q̇, q̈), upper triangle (105, 105),
        and ∂²(yᵀτ)/∂f∂q (24, 35); f are the contact forces (24).
    foot_points(q, body) : the eight foot points in the world (24) and ∂/∂q (24, 35).
    foot_curvature(q, w, body) : ∂²(wᵀp)/∂q², upper triangle (35, 35).
    """
    q, qd, qdd = (ca.SX.sym(name, COUNT) for name in ("q", "qd", "qdd"))
    f, y, w = ca.SX.sym("f", 3 * POINTS), ca.SX.sym("y", COUNT), ca.SX.sym("w", 3 * POINTS)
    body = BodyParameters.symbolic()
    work = ca.dot(y, inverse_forces(q, qd, qdd, f, body))
    by_state = ca.triu(ca.hessian(work, ca.vertcat(q, qd, qdd))[0])
    by_force = ca.jacobian(ca.gradient(work, f), q)
    points = foot_points(q, body)
    bend = ca.triu(ca.hessian(ca.dot(w, points), q)[0])
    cse = {"cse": True}
    return (
        ca.Function("curvature", [q, qd, qdd, f, y, body.vector], [by_state, by_force], cse),
        ca.Function(
            "foot_points", [q, body.vector], [ca.densify(points), ca.jacobian(points, q)], cse
        ),
        ca.Function("foot_curvature", [q, w, body.vector], [bend], cse),
    )
