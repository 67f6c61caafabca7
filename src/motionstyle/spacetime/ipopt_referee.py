"""The same spacetime problem for IPOPT, as referee of our own solver.

Everything is lifted, which is what lets IPOPT converge: variables are per frame u = (q, q̇, q̈)
scaled by (1, 10, 100), λ/100 N, residuals z = √w·(Q_0, Q_m) and foot errors e, then the control
points. Constraints tie u to the splines (linear) and z, e to the dynamics; joint ranges and
clearance are bounds. First and second derivatives per frame are CasADi's, on its virtual machine,
assembled here because CasADi would colour the whole.
"""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from motionstyle.dynamics.inverse import foot_points, inverse_forces
from motionstyle.dynamics.symbols import BodyParameters
from motionstyle.errors import MotionStyleError
from motionstyle.spacetime.interior_point import InteriorPoint
from motionstyle.spacetime.solver_point import FORCE_UNIT, SolverSettings
from motionstyle.spacetime.spacetime_problem import COUNT, HEELS, POINTS, Evaluator

Array = NDArray[np.float64]
UNIT = np.repeat([1.0, 10.0, 100.0], COUNT)
N_U, N_L, N_Z, N_E = 3 * COUNT, 4 * POINTS, COUNT, 3 * POINTS
N_V = N_U + N_L + N_Z + N_E
N_G = N_U + N_Z + N_E + POINTS


@dataclass(frozen=True)
class RefereeResult:
    """What IPOPT ends with. optimality : its own scaled error; energy : E of eq. (13)."""

    status: str
    controls: Array
    coefficients: Array
    energy: float
    optimality: float
    iterations: int
    seconds: float


class IpoptReferee:
    """Builds IPOPT's problem once for a given structure; solves it from a start."""

    def __init__(self, evaluator: Evaluator, **options: object) -> None:
        self.evaluator = evaluator
        problem = evaluator.problem
        if problem.tracking is not None:
            raise MotionStyleError("the referee knows no tracking term")
        frames, controls = problem.frames, evaluator.basis.controls
        self.frames, self.n_c = frames, controls * COUNT
        g, jacobian, hessian, sizes = self._frame_functions()
        self.size = N_V * frames + self.n_c
        x, p = ca.MX.sym("x", self.size), ca.MX.sym("p", 0)
        v = ca.reshape(x[: N_V * frames], N_V, frames)
        per_frame = ca.DM(self._frame_data())
        basis = self._basis_matrix()
        nonlinear = g.map(frames)(v, per_frame)
        tied = ca.vec(v[:N_U, :]) - ca.mtimes(ca.DM(basis), x[N_V * frames :])
        rows = ca.vertcat(ca.reshape(tied, N_U, frames), nonlinear)
        constraint = ca.vec(rows)
        z, e, forces = (
            v[N_U + N_L : N_U + N_L + N_Z, :],
            v[N_U + N_L + N_Z :, :],
            v[N_U : N_U + N_L, :],
        )
        ridge = problem.settings.force_weight * FORCE_UNIT**2
        objective = 0.5 * (ca.sumsqr(z) + ca.sumsqr(e) + ridge * ca.sumsqr(forces))
        gradient = ca.gradient(objective, x)
        nz = ca.vec(jacobian.map(frames)(v, per_frame))
        jac = self._scatter_jacobian(nz, sizes["jacobian"], basis)
        lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", constraint.numel())
        multipliers = ca.reshape(lam_g, N_G, frames)[N_U:, :]
        bent = ca.vec(hessian.map(frames)(v, multipliers, per_frame))
        hess = self._scatter_hessian(bent, sizes["hessian"], lam_f, ridge)
        self.solver = ca.nlpsol(
            "spacetime", "ipopt", {"x": x, "p": p, "f": objective, "g": constraint},
            {
                "grad_f": ca.Function("grad_f", [x, p], [objective, gradient]),
                "jac_g": ca.Function("jac_g", [x, p], [constraint, jac]),
                "hess_lag": ca.Function("hess_lag", [x, p, lam_f, lam_g], [hess]),
                "no_nlp_grad": True, "calc_lam_p": False, "calc_f": False, "calc_g": False,
                "print_time": False,
                "ipopt": {
                    "linear_solver": "mumps", "mu_strategy": "adaptive", "mu_init": 0.1,
                    "tol": 1e-6, "nlp_scaling_method": "none", "print_level": 0, "sb": "yes",
                    "max_iter": 300, **options,
                },
            },
        )  # fmt: skip

    def _frame_functions(self) -> tuple[ca.Function, ca.Function, ca.Function, dict]:
        """Return one frame's nonlinear constraints, and the nonzeros of their derivatives."""
        problem, evaluator = self.evaluator.problem, self.evaluator
        v = ca.SX.sym("v", N_V)
        d = ca.SX.sym("d", 32 * 3 + 9 * POINTS + 3 * N_E)
        u = v[:N_U] * ca.DM(UNIT)
        q, qd, qdd = u[:COUNT], u[COUNT : 2 * COUNT], u[2 * COUNT :]
        cone = ca.reshape(d[:96], 3, 32)
        normals, ground = ca.reshape(d[96:120], 3, 8), ca.reshape(d[120:144], 3, 8)
        targets, rows = ca.reshape(d[144:168], 3, 8), d[168:]
        body = BodyParameters.symbolic()
        numbers = ca.DM(evaluator.parameters)
        points = ca.reshape(foot_points(q, body), 3, POINTS)
        heights = ca.sum1((points - ground) * normals).T
        style, gain = problem.style, problem.settings.sigmoid_gain
        pushes = []
        for k in range(POINTS):
            force = cone[:, 4 * k : 4 * k + 4] @ v[N_U + 4 * k : N_U + 4 * k + 4] * FORCE_UNIT
            if k in HEELS and style.shoe_stiffness > 0:
                squeeze = style.shoe_rest_length - heights[k]
                on = 0.5 * (ca.tanh(problem.settings.shoe_gain * squeeze) + 1)
                force += on * style.shoe_stiffness * squeeze * normals[:, k]
            pushes.append(force)
        tau = inverse_forces(q, qd, qdd, ca.vertcat(*pushes), body)
        away = q[6:] - ca.DM(style.passive.rest_angle)
        above = 0.5 * (ca.tanh(gain * away) + 1)
        stiffness = ca.DM(style.passive.stiffness_below) + above * ca.DM(
            style.passive.stiffness_above - style.passive.stiffness_below
        )
        spring = stiffness * away + ca.DM(style.passive.damping) * qd[6:]
        residual = ca.DM(evaluator.scale) * ca.vertcat(tau[:6], tau[6:] + spring)
        split = [
            ca.reshape(rows[9 * k : 9 * k + 9], 3, 3).T @ (points[:, k] - targets[:, k])
            for k in range(POINTS)
        ]
        z, e = v[N_U + N_L : N_U + N_L + N_Z], v[N_U + N_L + N_Z :]
        parts = ca.vertcat(residual - z, ca.vertcat(*split) - e, heights)
        parts = ca.substitute(parts, body.vector, ca.SX(numbers))
        lam = ca.SX.sym("lam", N_Z + N_E + POINTS)
        slope = ca.jacobian(parts, v)
        bend = ca.triu(ca.hessian(ca.dot(lam, parts), v)[0])
        return (
            ca.Function("g", [v, d], [parts], {"cse": True}),
            ca.Function("j", [v, d], [ca.vertcat(*slope.nonzeros())], {"cse": True}),
            ca.Function("h", [v, lam, d], [ca.vertcat(*bend.nonzeros())], {"cse": True}),
            {"jacobian": slope.sparsity(), "hessian": bend.sparsity()},
        )

    def _frame_data(self) -> Array:
        """Return cones, planes, targets and foot rows of all frames as columns."""
        feet, frames = self.evaluator.problem.feet, self.frames
        parts = [
            self.evaluator.cone.reshape(frames, -1),
            feet.normals.reshape(frames, -1),
            feet.ground.reshape(frames, -1),
            feet.targets.reshape(frames, -1),
            self.evaluator.foot_rows.reshape(frames, -1),
        ]
        return np.concatenate(parts, axis=1).T

    def _basis_matrix(self) -> ca.DM:
        """Return B with u = B c: frames' (q, q̇, q̈)/unit by control points, sparse."""
        basis = self.evaluator.basis
        rows, columns, values = [], [], []
        for t in range(self.frames):
            for d in range(3):
                for c in range(4):
                    for j in range(COUNT):
                        rows.append(t * N_U + d * COUNT + j)
                        columns.append((basis.first[t] + c) * COUNT + j)
                        values.append(basis.weights[t, d, c] / UNIT[d * COUNT])
        return ca.DM.triplet(rows, columns, ca.DM(values), self.frames * N_U, self.n_c)

    def _scatter_jacobian(self, nz: ca.MX, pattern: ca.Sparsity, basis: ca.DM) -> ca.MX:
        own_rows, own_columns = (np.array(a) for a in pattern.get_triplet())
        frames = np.arange(self.frames)[:, None]
        rows = [(frames * N_G + N_U + own_rows).ravel()]
        columns = [(frames * N_V + own_columns).ravel()]
        rows.append((frames * N_G + np.arange(N_U)).ravel())
        columns.append((frames * N_V + np.arange(N_U)).ravel())
        b_rows, b_columns = (np.array(a) for a in basis.sparsity().get_triplet())
        rows.append(b_rows // N_U * N_G + b_rows % N_U)
        columns.append(self.frames * N_V + b_columns)
        constant = np.concatenate([np.ones(self.frames * N_U), -np.array(basis.nonzeros())])
        values = ca.vertcat(nz, ca.DM(constant))
        return _sparse(rows, columns, values, self.frames * N_G, self.size)

    def _scatter_hessian(
        self, nz: ca.MX, pattern: ca.Sparsity, lam_f: ca.MX, ridge: float
    ) -> ca.MX:
        own_rows, own_columns = (np.array(a) for a in pattern.get_triplet())
        frames = np.arange(self.frames)[:, None]
        plain = np.arange(N_U, N_V)
        rows = [(frames * N_V + own_rows).ravel(), (frames * N_V + plain).ravel()]
        columns = [(frames * N_V + own_columns).ravel(), rows[1]]
        own = np.concatenate([np.full(N_L, ridge), np.ones(N_Z + N_E)])
        values = ca.vertcat(nz, lam_f * ca.DM(np.tile(own, self.frames)))
        return _sparse(rows, columns, values, self.size, self.size)

    def solve(self, controls: Array, coefficients: Array | None = None) -> RefereeResult:
        """Return IPOPT's optimum from control points (K, 35) and, if known, λ in N (F, 32)."""
        began = perf_counter()
        evaluator, frames = self.evaluator, self.frames
        if coefficients is None:
            start = InteriorPoint(evaluator, SolverSettings()).start(controls)
            coefficients = start.coefficients * FORCE_UNIT
        values = evaluator.values(controls, coefficients)
        state = np.concatenate(
            [values.coordinates, values.rates / UNIT[COUNT], values.accelerations / UNIT[-1]],
            axis=1,
        )
        v = np.concatenate(
            [state, coefficients / FORCE_UNIT, values.residuals, values.foot_residuals], axis=1
        )
        low, high = np.full((frames, N_V), -np.inf), np.full((frames, N_V), np.inf)
        low[:, evaluator.limited], high[:, evaluator.limited] = evaluator.low, evaluator.high
        low[:, N_U : N_U + N_L] = 0.0
        high[:, N_U : N_U + N_L] = np.where(evaluator.bearing, np.inf, 0.0)
        g_low, g_high = np.zeros((frames, N_G)), np.zeros((frames, N_G))
        feet = evaluator.problem.feet
        g_low[:, -POINTS:] = np.where(feet.held, -np.inf, feet.clearance)
        g_high[:, -POINTS:] = np.inf
        free = np.full(self.n_c, np.inf)
        start = controls.ravel()
        keep = evaluator.problem.keep_ends * COUNT
        c_low, c_high = -free, free.copy()
        if keep:
            for part in (slice(0, keep), slice(self.n_c - keep, None)):
                c_low[part] = c_high[part] = start[part]
        found = self.solver(
            x0=np.concatenate([v.ravel(), start]),
            lbx=np.concatenate([low.ravel(), c_low]),
            ubx=np.concatenate([high.ravel(), c_high]),
            lbg=g_low.ravel(),
            ubg=g_high.ravel(),
        )
        stats = self.solver.stats()
        x = np.array(found["x"]).ravel()
        best = x[: N_V * frames].reshape(frames, N_V)
        end = x[N_V * frames :].reshape(-1, COUNT)
        coefficients = best[:, N_U : N_U + N_L] * FORCE_UNIT
        final = evaluator.values(end, coefficients)
        errors = stats.get("iterations")  # absent where IPOPT refuses an option
        optimality = max(errors["inf_pr"][-1], errors["inf_du"][-1]) if errors else np.inf
        return RefereeResult(
            str(stats["return_status"]), end, coefficients, final.energy, float(optimality),
            int(stats.get("iter_count", 0)), perf_counter() - began,
        )  # fmt: skip


def _sparse(
    rows: list[Array], columns: list[Array], values: ca.MX, height: int, width: int
) -> ca.MX:
    """Return a sparse matrix from triplets without repeats."""
    row, column = np.concatenate(rows), np.concatenate(columns)
    order = np.lexsort((row, column))
    pattern = ca.Sparsity.triplet(height, width, row[order].tolist(), column[order].tolist())
    return ca.MX(pattern, values[order.tolist()])
