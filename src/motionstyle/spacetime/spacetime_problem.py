"""The spacetime problem: Liu et al. 2005, eqs. (12)–(15), as residuals with exact derivatives.

Unknowns are the control points of cubic B-splines (K, 35) and the cone coefficients λ (F, 32) of
eq. (8). What is minimised, and what is the same for E(X_T) and E(X_S):

    E = Σ α_j Q_mj² + w_r Σ Q_0k²                      eq. (13), the energy that is reported
    + w_f Σ ‖C_p − target‖² over held points            footsteps; 1e7/m² holds them to 0.5 mm
    + w_λ Σ λ²                                          settles λ where eq. (8) leaves it open
    + ½ρ Σ (excess over joint ranges, depth below the clearance)², kept small by a barrier
    + Σ w (q − q̂)², only where a problem has a `Tracking`: learning keeps near its motion at first.

Ends are free, or the first and last poses of a motion are kept. Derivatives per frame are with
respect to u = (q, q̇, q̈), 105 numbers.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.body import Body
from motionstyle.body.layout import CONTACT_POINTS
from motionstyle.dynamics.codegen import FrameFunction
from motionstyle.dynamics.symbols import parameter_vector
from motionstyle.errors import MotionStyleError
from motionstyle.spacetime.foot_constraints import FootConstraints
from motionstyle.spacetime.forces import cone_basis
from motionstyle.spacetime.splines import SplineBasis
from motionstyle.spacetime.style import Style

Array = NDArray[np.float64]
COUNT, POINTS = 35, len(CONTACT_POINTS)
HEELS = tuple(i for i, name in enumerate(CONTACT_POINTS) if name.startswith("heel"))


@dataclass(frozen=True)
class SpacetimeSettings:
    """Weights of the problem; see the module's text. Rows of inequalities are scaled by 1/unit."""

    root_weight: float = 100.0
    foot_weight: float = 1e7
    force_weight: float = 1e-6
    range_weight: float = 1e6
    clearance_weight: float = 1e7
    sigmoid_gain: float = 500.0
    frames_per_knot: float = 2.0


@dataclass(frozen=True)
class Tracking:
    """A pull towards a motion: Σ weights (q − coordinates)² beside E.

    coordinates : (F, 35). weights : (35,), in units of E by m² (root's place) and rad².
    """

    coordinates: Array
    weights: Array


@dataclass(frozen=True)
class SpacetimeProblem:
    """What is to be solved: body, feet, style, ranges, ends.

    ranges : (35, 2), rad. keep_ends : control points at both ends that stay as in the start.
    tracking : a pull towards a motion, for learning; None in every synthesis.
    """

    body: Body
    rate_hz: float
    feet: FootConstraints
    ranges: Array
    style: Style
    functions: dict[str, FrameFunction]
    settings: SpacetimeSettings = field(default_factory=SpacetimeSettings)
    keep_ends: int = 0
    tracking: Tracking | None = None

    def __post_init__(self) -> None:
        if self.feet.frames < 8:
            raise MotionStyleError(f"{self.feet.frames} frames are too few for splines, need 8")
        if not (np.isfinite(self.body.masses).all() and self.body.mass > 0):
            raise MotionStyleError(f"the body's mass is {self.body.mass} kg, must be positive")

    @property
    def frames(self) -> int:
        """Number of frames."""
        return self.feet.frames

    def basis(self) -> SplineBasis:
        """Return the splines' basis."""
        return SplineBasis.uniform(self.frames, self.rate_hz, self.settings.frames_per_knot)


@dataclass(frozen=True)
class Values:
    """The problem at one point.

    coordinates, rates, accelerations : (F, 35). root, muscle : Q_0 (F, 6), Q_m (F, 29), N, N·m.
    passive : Q_p of springs and dampers, (F, 29), N·m.
    residuals : √w·(Q_0, Q_m), (F, 35). foot_residuals : √w_f·(C − target), (F, 24), 0 where free.
    inequalities : rows that should be ≥ 0, (F, R): q − low, high − q, heights − clearance.
    forces : of contact on the foot points (F, 8, 3), without shoes; shoe_forces : theirs, N.
    points : foot points in the world, (F, 8, 3), m.
    """

    coordinates: Array
    rates: Array
    accelerations: Array
    root: Array
    muscle: Array
    passive: Array
    residuals: Array
    foot_residuals: Array
    inequalities: Array
    forces: Array
    shoe_forces: Array
    points: Array

    @property
    def energy(self) -> float:
        """E of eq. (13)."""
        return float((self.residuals**2).sum())


class Evaluator:
    """Evaluates a problem; what does not change between evaluations is kept.

    Attributes
    ----------
    basis : of the splines. cone : edges of the friction cones, (F, 8, 4, 3).
    bearing : coefficients that may push, (F, 32). scale : √w of the residuals, (35,).
    foot_rows : √w_f times what held points must keep to, (F, 8, 3, 3).
    limited : coordinates with ranges, and their low and high.
    row_scale, row_weight : of the inequality rows, (R,). row_active : which count, (F, R).
    """

    def __init__(self, problem: SpacetimeProblem) -> None:
        self.problem = problem
        settings, feet = problem.settings, problem.feet
        self.basis = problem.basis()
        self.parameters = parameter_vector(problem.body)
        frames = problem.frames
        self.cone = np.stack(
            [cone_basis(feet.normals[:, p : p + 1], 1.0)[:, 0] for p in range(POINTS)], axis=1
        )
        middle = feet.normals[:, :, None]
        self.cone = middle + feet.friction[..., None, None] * (self.cone - middle)
        self.bearing = np.repeat(feet.held, 4, axis=1)
        self.scale = np.sqrt(
            np.concatenate([np.full(6, settings.root_weight), problem.style.preferences])
        )
        along = feet.normals[..., :, None] * feet.normals[..., None, :]
        every = np.broadcast_to(np.eye(3), along.shape)
        kept = np.where(feet.sliding[..., None, None], along, every)
        self.foot_rows = np.sqrt(settings.foot_weight) * kept * feet.held[..., None, None]
        self.limited = np.flatnonzero(np.isfinite(problem.ranges).all(axis=1))
        low, high = problem.ranges[self.limited].T
        self.low, self.high = low, high
        n = len(self.limited)
        self.rows = 2 * n + POINTS
        self.row_scale = np.concatenate([np.full(2 * n, 10.0), np.full(POINTS, 100.0)])
        weights = np.concatenate(
            [np.full(2 * n, settings.range_weight), np.full(POINTS, settings.clearance_weight)]
        )
        self.row_weight = weights / self.row_scale**2
        self.row_active = np.ones((frames, self.rows), dtype=bool)
        self.row_active[:, 2 * n :] = ~feet.held
        slopes = problem.functions["forces_and_slopes"]
        self.slope_patterns = [slopes.pattern(k) for k in range(1, 5)]
        self.point_pattern = problem.functions["foot_points"].pattern(1)
        curvature = problem.functions["curvature"]
        self.curvature_patterns = [curvature.pattern(k) for k in range(2)]
        self.bend_pattern = problem.functions["foot_curvature"].pattern(0)

    def contact_forces(self, coefficients: Array) -> Array:
        """Return the forces Vᵀλ on the foot points, (F, 8, 3), N."""
        split = coefficients.reshape(-1, POINTS, 4)
        return np.einsum("fpc,fpca->fpa", split, self.cone)

    def values(self, controls: Array, coefficients: Array) -> Values:
        """Return the problem's values at control points (K, 35) and coefficients (F, 32)."""
        return self.at(*self.basis.evaluate(controls), coefficients)

    def at(self, q: Array, qd: Array, qdd: Array, coefficients: Array) -> Values:
        """Return the problem's values at coordinates and their rates, (F, 35) each."""
        points = self.problem.functions["foot_points"](q, self.parameters)[0]
        points = points.reshape(-1, POINTS, 3)
        forces = self.contact_forces(coefficients)
        shoe = self._shoe(points)[0]
        total = (forces + shoe).reshape(len(q), -1)
        tau = self.problem.functions["forces"](q, qd, qdd, total, self.parameters)[0]
        return self._gather(q, qd, qdd, points, forces, shoe, tau)

    def _gather(
        self, q: Array, qd: Array, qdd: Array, points: Array, forces: Array, shoe: Array, tau: Array
    ) -> Values:
        feet, passive = self.problem.feet, self.passive(q, qd)[0]
        effort = tau[:, 6:] - passive
        residuals = self.scale * np.concatenate([tau[:, :6], effort], axis=1)
        away = points - np.where(feet.held[..., None], feet.targets, points)
        foot = (self.foot_rows @ away[..., None])[..., 0].reshape(len(q), -1)
        height = ((points - feet.ground) * feet.normals).sum(axis=-1) - feet.clearance
        inside = q[:, self.limited]
        rows = np.concatenate([inside - self.low, self.high - inside, height], axis=1)
        rows = rows * self.row_scale
        return Values(
            q, qd, qdd, tau[:, :6], effort, passive, residuals, foot, rows, forces, shoe, points
        )

    def passive(self, q: Array, qd: Array) -> tuple[Array, Array, Array]:
        """Return Q_p of eqs. (6), (7) (F, 29), and −∂Q_p/∂q, −∂²Q_p/∂q²."""
        p, gain = self.problem.style.passive, self.problem.settings.sigmoid_gain
        away = q[:, 6:] - p.rest_angle
        turn = np.tanh(gain * away)
        above, steep = 0.5 * (turn + 1), 0.5 * gain * (1 - turn**2)
        bend = -2 * gain * turn * steep
        excess = p.stiffness_above - p.stiffness_below
        stiffness = p.stiffness_below + above * excess
        force = -stiffness * away - p.damping * qd[:, 6:]
        slope = stiffness + steep * excess * away
        return force, slope, (2 * steep + bend * away) * excess

    def _shoe(self, points: Array) -> tuple[Array, Array, Array]:
        """Return the shoes' forces (F, 8, 3), N, and d, d² of their size by height, (F, 8).

        Eq. (9) without ∂h/∂q: γ(h̄−h) k (h̄−h) along the normal, at the heels.
        """
        style, feet, gain = (
            self.problem.style,
            self.problem.feet,
            self.problem.settings.sigmoid_gain,
        )
        height = ((points - feet.ground) * feet.normals).sum(axis=-1)
        squeeze = style.shoe_rest_length - height
        turn = np.tanh(gain * squeeze)
        on, steep = 0.5 * (turn + 1), 0.5 * gain * (1 - turn**2)
        bend = -2 * gain * turn * steep
        heel = np.isin(np.arange(POINTS), HEELS) * style.shoe_stiffness
        size = heel * on * squeeze
        by_height = -heel * (on + steep * squeeze)
        by_height2 = heel * (2 * steep + bend * squeeze)
        return size[..., None] * feet.normals, by_height, by_height2

    def tracking_pull(self, coordinates: Array) -> Array:
        """Return half the slope of the tracking term by q, (F, 35)."""
        tracking = self.problem.tracking
        if tracking is None:
            return np.zeros_like(coordinates)
        return tracking.weights * (coordinates - tracking.coordinates)

    def slopes(self, values: Values) -> Slopes:
        """Return the first derivatives at a point."""
        total = (values.forces + values.shoe_forces).reshape(self.problem.frames, -1)
        call = self.problem.functions["forces_and_slopes"]
        found = call(values.coordinates, values.rates, values.accelerations, total, self.parameters)
        frames = self.problem.frames
        by_state = np.zeros((frames, COUNT, 3 * COUNT))
        for k in range(3):
            rows, columns = self.slope_patterns[k]
            by_state[:, rows, columns + k * COUNT] = found[k + 1]
        by_force = np.zeros((frames, COUNT, 3 * POINTS))
        by_force[:, self.slope_patterns[3][0], self.slope_patterns[3][1]] = found[4]
        points = np.zeros((frames, 3 * POINTS, COUNT))
        given = self.problem.functions["foot_points"](values.coordinates, self.parameters)[1]
        points[:, self.point_pattern[0], self.point_pattern[1]] = given
        point_slopes = points.reshape(frames, POINTS, 3, COUNT)
        heights = np.einsum("fpa,fpaq->fpq", self.problem.feet.normals, point_slopes)
        _force, by_height, _bend = self._shoe(values.points)
        by_force4 = by_force.reshape(frames, COUNT, POINTS, 3)
        by_normal = np.einsum("frpa,fpa->frp", by_force4, self.problem.feet.normals)
        if self.problem.style.shoe_stiffness > 0:
            by_state[:, :, :COUNT] += (by_normal * by_height[:, None]) @ heights
        _passive, spring, _bend = self.passive(values.coordinates, values.rates)
        joints = np.arange(6, COUNT)
        by_state[:, joints, joints] += spring
        by_state[:, joints, joints + COUNT] += self.problem.style.passive.damping
        by_cone = np.einsum("frpa,fpca->frpc", by_force4, self.cone).reshape(frames, COUNT, -1)
        feet = (self.foot_rows @ point_slopes).reshape(frames, 3 * POINTS, COUNT)
        return Slopes(
            by_state=by_state * self.scale[:, None],
            by_coefficients=by_cone * self.scale[:, None] * self.bearing[:, None],
            feet=feet,
            heights=heights,
            by_force=by_force,
        )

    def curvature(
        self, values: Values, slopes: Slopes, lift: Array, foot_lift: Array, pushes: Array
    ) -> tuple[Array, Array]:
        """Return Σ multiplier × second derivative: over u (F, 105, 105), and u × λ (F, 105, 32).

        Parameters
        ----------
        lift, foot_lift : multipliers of the residuals (F, 35) and foot residuals (F, 24).
        pushes : multipliers of the clearance rows, with the sign of the Lagrangian, (F, 8).
        """
        frames, feet = self.problem.frames, self.problem.feet
        weights = lift * self.scale
        total = (values.forces + values.shoe_forces).reshape(frames, -1)
        found, crossed = self.problem.functions["curvature"](
            values.coordinates, values.rates, values.accelerations, total, weights, self.parameters
        )
        hessian = np.zeros((frames, 3 * COUNT, 3 * COUNT))
        rows, columns = self.curvature_patterns[0]
        hessian[:, rows, columns] = found
        hessian[:, columns, rows] = found
        cross = np.zeros((frames, 3 * POINTS, COUNT))
        cross[:, self.curvature_patterns[1][0], self.curvature_patterns[1][1]] = crossed
        pull = np.einsum("fr,frx->fx", weights, slopes.by_force).reshape(frames, POINTS, 3)
        _force, by_height, by_height2 = self._shoe(values.points)
        push = (pull * feet.normals).sum(axis=-1)
        split = cross.reshape(frames, POINTS, 3, COUNT)
        held = (foot_lift.reshape(frames, POINTS, 1, 3) @ self.foot_rows)[:, :, 0]
        bends = held + (pushes + push * by_height)[..., None] * feet.normals
        bent = self.problem.functions["foot_curvature"](
            values.coordinates, bends.reshape(frames, -1), self.parameters
        )[0]
        rows, columns = self.bend_pattern
        point_part = np.zeros((frames, COUNT, COUNT))
        point_part[:, rows, columns] = bent
        point_part[:, columns, rows] = bent
        if self.problem.style.shoe_stiffness > 0:
            by_normal = np.einsum("fpa,fpaq->fpq", feet.normals, split) * by_height[..., None]
            mixed = np.swapaxes(by_normal, 1, 2) @ slopes.heights
            point_part += mixed + np.swapaxes(mixed, 1, 2)
            scaled = (push * by_height2)[..., None] * slopes.heights
            point_part += np.swapaxes(slopes.heights, 1, 2) @ scaled
        hessian[:, :COUNT, :COUNT] += point_part
        _passive, _spring, bend = self.passive(values.coordinates, values.rates)
        joints = np.arange(6, COUNT)
        hessian[:, joints, joints] += weights[:, 6:] * bend
        mixed = np.zeros((frames, 3 * COUNT, 4 * POINTS))
        by_cone = np.einsum("fpaq,fpca->fqpc", split, self.cone).reshape(frames, COUNT, -1)
        mixed[:, :COUNT] = by_cone * self.bearing[:, None]
        return hessian, mixed


@dataclass(frozen=True)
class Slopes:
    """First derivatives: of residuals by u (F, 35, 105) and λ (F, 35, 32), of foot residuals by q.

    feet : (F, 24, 35). heights : of the foot points above their planes by q, (F, 8, 35).
    by_force : ∂τ/∂f unscaled, (F, 35, 24).
    """

    by_state: Array
    by_coefficients: Array
    feet: Array
    heights: Array
    by_force: Array
