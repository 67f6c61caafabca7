"""A body that is 35 sliding masses: the spacetime solver on dynamics with known solutions.

Each coordinate is a point mass on a rail of its own, without gravity and without contact: τ = m q̈.
The functions have the signatures of the real ones, so that splines, residuals, springs, barrier
and Newton steps of the solver are all the real ones.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import casadi as ca

from motionstyle.dynamics.functions import COUNT, POINTS
from motionstyle.dynamics.symbols import BodyParameters


def sliding_mass_functions(mass_kg: float) -> Callable[[], Sequence[ca.Function]]:
    """Return a builder of all functions that a spacetime problem calls, see `load_functions`."""

    def build() -> Sequence[ca.Function]:
        q, qd, qdd = (ca.SX.sym(name, COUNT) for name in ("q", "qd", "qdd"))
        f, y, w = ca.SX.sym("f", 3 * POINTS), ca.SX.sym("y", COUNT), ca.SX.sym("w", 3 * POINTS)
        body = BodyParameters.symbolic().vector
        tau = mass_kg * qdd
        points = ca.SX.zeros(3 * POINTS)
        state = [q, qd, qdd, f, body]
        slopes = [ca.jacobian(tau, x) for x in (q, qd, qdd, f)]
        return (
            ca.Function("forces", state, [ca.densify(tau)]),
            ca.Function("forces_and_slopes", state, [ca.densify(tau), *slopes]),
            ca.Function(
                "curvature", [q, qd, qdd, f, y, body],
                [ca.SX(3 * COUNT, 3 * COUNT), ca.SX(3 * POINTS, COUNT)],
            ),
            ca.Function("foot_points", [q, body], [points, ca.SX(3 * POINTS, COUNT)]),
            ca.Function("foot_curvature", [q, w, body], [ca.SX(COUNT, COUNT)]),
        )  # fmt: skip

    return build
