"""The spacetime problem: Liu et al. 2005, eqs. (12)–(15), as residuals with exact derivatives.

Unknowns are the control points of cubic B-splines (K, 35) and the cone coefficients λ (F, 32) of
eq. (8). What is minimised, and what is the same for E(X_T) and E(X_S):

    E = Σ α_j Q_mj² + w_r Σ Q_0k²                      eq. (13), the energy that is reported
    + w_f Σ ‖C_p − target‖² over held points            footsteps; 1e7/m² holds them to 0.5 mm
    + w_λ Σ λ²                                          settles λ where eq. (8) leaves it open
    + ρ Σ (excess over joint ranges, depth below the clearance)², kept small by a barrier
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
from motionstyle.dynamics.passive import sigmoid_slopes
from motionstyle.dynamics.shoes import Shoes
from motionstyle.dynamics.symbols import parameter_vector
from motionstyle.errors import MotionStyleError
from motionstyle.spacetime.foot_constraints import FootConstraints
from motionstyle.spacetime.forces import cone_basis
from motionstyle.spacetime.frame_sums import Curvature
from motionstyle.spacetime.kernels import scatter
from motionstyle.spacetime.splines import SplineBasis
from motionstyle.spacetime.style import Style

Array = NDArray[np.float64]
COUNT, POINTS = 35, len(CONTACT_POINTS)
HEELS = tuple(i for i, name in enumerate(CONTACT_POINTS) if name.startswith("heel"))


@dataclass(frozen=True)
class SpacetimeSettings:
    """Weights of the problem; see the module's text. Rows of inequalities are scaled by 1/unit.

    sigmoid_gain : of γ in eq. (7), 1/rad. shoe_gain : of γ in eq. (9), 1/m.
    """

    root_weight: float = 100.0
    foot_weight: float = 1e7
    force_weight: float = 1e-6
    range_weight: float = 1e6
    clearance_weight: float = 1e7
    sigmoid_gain: float = 500.0
    shoe_gain: float = 500.0
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


def _places(rows: NDArray[np.int64], columns: NDArray[np.int64], wide: int) -> NDArray[np.int64]:
    """Return the places of a matrix's entries in its `wide` columns laid end to end."""
    return rows * wide + columns


def _filled(numbers: Array, places: NDArray[np.int64], rows: int, columns: int) -> Array:
    """Return matrices (F, rows, columns) with numbers (F, n) at places (n,), else 0."""
    found = np.zeros((len(numbers), rows, columns))
    scatter(numbers, places, found)
    return found


class Evaluator:
    """Evaluates a problem; what does not change between evaluations is kept.

    Attributes
    ----------
    basis : of the splines. cone : edges of the friction cones, (F, 8, 4, 3).
    forces_of, heights_of : the cones as one matrix from λ to forces (F, 24, 32), and the normals
        as one from points to heights (F, 8, 24).
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
        # As matrices of mostly zeros, since a few larger products are faster than many small ones.
        each = np.arange(POINTS)
        forces_of = np.zeros((frames, POINTS, 3, POINTS, 4))
        forces_of[:, each, :, each] = self.cone.transpose(1, 0, 3, 2)
        self.forces_of = forces_of.reshape(frames, 3 * POINTS, 4 * POINTS)
        heights_of = np.zeros((frames, POINTS, POINTS, 3))
        heights_of[:, each, each] = feet.normals
        self.heights_of = heights_of.reshape(frames, POINTS, 3 * POINTS)
        self.heels = np.isin(each, HEELS)
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
        wide = 3 * COUNT
        self.slope_places = [
            _places(*slopes.pattern(k), wide) + k0 for k, k0 in ((1, 0), (2, COUNT), (3, 2 * COUNT))
        ]
        self.force_places = _places(*slopes.pattern(4), 3 * POINTS)
        self.point_places = _places(*problem.functions["foot_points"].pattern(1), COUNT)
        curvature = problem.functions["curvature"]
        self.curvature_pattern = curvature.pattern(0)
        rows, columns = self.curvature_pattern
        # Over q alone: the first numbers, as the pattern is an upper triangle's, by columns.
        rows, columns = rows[columns < COUNT], columns[columns < COUNT]
        self.place_places = _places(rows, columns, COUNT), _places(columns, rows, COUNT)
        self.cross_places = _places(*curvature.pattern(1), COUNT)
        rows, columns = problem.functions["foot_curvature"].pattern(0)
        self.bend_places = _places(rows, columns, COUNT), _places(columns, rows, COUNT)

    def contact_forces(self, coefficients: Array) -> Array:
        """Return the forces Vᵀλ on the foot points, (F, 8, 3), N."""
        forces = self.forces_of @ coefficients.reshape(-1, 4 * POINTS, 1)
        return forces.reshape(-1, POINTS, 3)

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
        above, steep, bend = sigmoid_slopes(away, gain)
        excess = p.stiffness_above - p.stiffness_below
        stiffness = p.stiffness_below + above * excess
        force = -stiffness * away - p.damping * qd[:, 6:]
        slope = stiffness + steep * excess * away
        return force, slope, (2 * steep + bend * away) * excess

    def _shoe(self, points: Array) -> tuple[Array, Array, Array]:
        """Return the shoes' forces (F, 8, 3), N, and d, d² of their size by height, (F, 8).

        Eq. (9) without ∂h/∂q: γ(h̄−h) k (h̄−h) along the normal, at the heels.
        """
        style, feet = self.problem.style, self.problem.feet
        shoes = Shoes(style.shoe_stiffness, style.shoe_rest_length, self.problem.settings.shoe_gain)
        height = ((points - feet.ground) * feet.normals).sum(axis=-1)
        size = self.heels * shoes.force(height)
        by_height = self.heels * shoes.force_by_height(height)
        by_height2 = self.heels * shoes.force_by_height_twice(height)
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
        for places, part in zip(self.slope_places, found[1:4], strict=True):
            scatter(part, places, by_state)
        by_force = _filled(found[4], self.force_places, COUNT, 3 * POINTS)
        given = self.problem.functions["foot_points"](values.coordinates, self.parameters)[1]
        points = _filled(given, self.point_places, 3 * POINTS, COUNT)
        point_slopes = points.reshape(frames, POINTS, 3, COUNT)
        heights = self.heights_of @ points
        if self.problem.style.shoe_stiffness > 0:
            _force, by_height, _bend = self._shoe(values.points)
            by_normal = by_force @ self.heights_of.swapaxes(1, 2)
            by_state[:, :, :COUNT] += (by_normal * by_height[:, None]) @ heights
        _passive, spring, _bend = self.passive(values.coordinates, values.rates)
        joints = np.arange(6, COUNT)
        by_state[:, joints, joints] += spring
        by_state[:, joints, joints + COUNT] += self.problem.style.passive.damping
        by_cone = by_force @ self.forces_of
        feet = (self.foot_rows @ point_slopes).reshape(frames, 3 * POINTS, COUNT)
        by_state *= self.scale[:, None]
        by_cone *= self.scale[:, None]
        by_cone *= self.bearing[:, None]
        return Slopes(
            by_state=by_state,
            by_coefficients=by_cone,
            feet=feet,
            heights=heights,
            by_force=by_force,
        )

    def curvature(
        self, values: Values, slopes: Slopes, lift: Array, foot_lift: Array, pushes: Array
    ) -> tuple[Curvature, Array]:
        """Return Σ multiplier × second derivative: over u, and q × λ (F, 35, 32).

        The first knows which part of it is concave bends of springs, see `Curvature`.

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
        cross = _filled(crossed, self.cross_places, 3 * POINTS, COUNT)
        pull = (weights[:, None] @ slopes.by_force).reshape(frames, POINTS, 3)
        _force, by_height, by_height2 = self._shoe(values.points)
        push = (pull * feet.normals).sum(axis=-1)
        held = (foot_lift.reshape(frames, POINTS, 1, 3) @ self.foot_rows)[:, :, 0]
        bends = held + (pushes + push * by_height)[..., None] * feet.normals
        bent = self.problem.functions["foot_curvature"](
            values.coordinates, bends.reshape(frames, -1), self.parameters
        )[0]
        place, point_part = np.zeros((2, frames, COUNT, COUNT))
        for places in self.place_places:
            scatter(found, places, place)
        for places in self.bend_places:
            scatter(bent, places, point_part)
        if self.problem.style.shoe_stiffness > 0:
            by_normal = (self.heights_of @ cross) * by_height[..., None]
            mixed = np.swapaxes(by_normal, 1, 2) @ slopes.heights
            point_part += mixed + np.swapaxes(mixed, 1, 2)
            scaled = (push * by_height2)[..., None] * slopes.heights
            point_part += np.swapaxes(slopes.heights, 1, 2) @ scaled
        place += point_part
        _passive, _spring, bend = self.passive(values.coordinates, values.rates)
        joints = np.arange(6, COUNT)
        bends_of_springs = weights[:, 6:] * bend
        place[:, joints, joints] += bends_of_springs
        concave = np.zeros((frames, COUNT))
        concave[:, 6:] = np.minimum(bends_of_springs, 0.0)
        mixed = (np.swapaxes(cross, 1, 2) @ self.forces_of) * self.bearing[:, None]
        return Curvature(found, self.curvature_pattern, place, concave), mixed


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
