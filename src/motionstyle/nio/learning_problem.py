"""The learning problem: one captured motion X_T, made feasible, and what min E is held against.

X_T as it comes from the physics fit obeys its own contacts and ground to a few millimetres, not
this problem's to the last newton, and a root residual of 2 N is already 2·10⁵ in E (feasibility
study, pitfall 4). So X_T is projected first: of the motions that the constraints allow, the one
that follows it most closely, ties broken towards small joint torques (no style enters). The
projected motion is X_T from there on, the same in E(X_T) and as the start of E(X_S).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.layout import JOINT_COORDINATES
from motionstyle.dynamics.codegen import FrameFunction
from motionstyle.dynamics.passive import PassiveParameters
from motionstyle.errors import MotionStyleError
from motionstyle.motion.difference import joint_rms_deg
from motionstyle.motion.motion import Motion
from motionstyle.motion.resample import resample
from motionstyle.spacetime.edits import Edits, edit_ranges
from motionstyle.spacetime.foot_constraints import FootConstraints
from motionstyle.spacetime.footprint_constraints import captured_constraints
from motionstyle.spacetime.interior_point import InteriorPoint
from motionstyle.spacetime.objective import best_coefficients, objective_terms
from motionstyle.spacetime.solver_point import (
    FORCE_UNIT,
    InteriorPointResult,
    Point,
    SolverSettings,
)
from motionstyle.spacetime.spacetime_problem import (
    COUNT,
    Evaluator,
    SpacetimeProblem,
    SpacetimeSettings,
    Tracking,
    Values,
)
from motionstyle.spacetime.style import JOINTS_29, Style, initial_style
from motionstyle.spacetime.synthesis import USUAL_SHOES

Array = NDArray[np.float64]

RATE_HZ = 30.0  # of the paper
PLACE_BY_ANGLE = 30.0  # weight of 1 m² of the root against 1 rad²: 1 cm counts as 3°
CLOSENESS = 3e4  # of the projection: 1 rad² against (1 N·m)² of the mean joint torque
ROOT_LIMIT_N = 1.0  # root residual that a projected motion may keep, N and N·m


@dataclass(frozen=True)
class Projection:
    """How far X_T was moved to be feasible.

    status, optimality : of its solve. angle_rms_deg, place_rms_mm : from the captured motion.
    root_n : largest root residual left, N or N·m.
    """

    status: str
    optimality: float
    angle_rms_deg: float
    place_rms_mm: float
    root_n: float


@dataclass(frozen=True)
class LearningProblem:
    """Everything of NIO but θ.

    Attributes
    ----------
    captured : the motion as it was fitted, at 30 Hz. target : X_T, projected.
    controls : X_T's control points, (K, 35). coordinates : X_T, (F, 35).
    feet, ranges : constraints C that X_T keeps. start : θ that learning starts from (nio.md A3).
    """

    captured: Motion
    target: Motion
    controls: Array
    coordinates: Array
    feet: FootConstraints
    ranges: Array
    start: Style
    projection: Projection
    functions: Mapping[str, FrameFunction]
    settings: SpacetimeSettings

    def problem(
        self, style: Style, *, closeness: float = 0.0, gain: float | None = None
    ) -> SpacetimeProblem:
        """Return the spacetime problem of a style.

        Parameters
        ----------
        closeness : weight of a pull towards X_T, per rad². gain : of the springs' sigmoid, 1/rad,
            where it is not the paper's.
        """
        settings = self.settings if gain is None else replace(self.settings, sigmoid_gain=gain)
        return SpacetimeProblem(
            body=self.target.body,
            rate_hz=self.target.rate_hz,
            feet=self.feet,
            ranges=self.ranges,
            style=style,
            functions=dict(self.functions),
            settings=settings,
            tracking=_tracking(self.coordinates, closeness),
        )

    def joint_error_deg(self, coordinates: Array) -> float:
        """Return the rms difference of joint angles (F, 35) from X_T, degrees."""
        return joint_rms_deg(coordinates, self.coordinates)


@dataclass(frozen=True)
class Cost:
    """What is minimised, at one motion.

    total : E and the constraints' terms. energy : E of eq. (13). muscle, root : its parts.
    values : the problem there.
    """

    total: float
    energy: float
    muscle: float
    root: float
    values: Values


def learning_problem(
    motion: Motion,
    functions: Mapping[str, FrameFunction],
    *,
    shoes: tuple[float, float] = USUAL_SHOES,
    settings: SpacetimeSettings | None = None,
) -> LearningProblem:
    """Return the learning problem of a physical motion.

    Parameters
    ----------
    shoes : k_shoe (N/m) and h̄ (m) to start from.

    Raises
    ------
    MotionStyleError
        If contact forces are unknown, or no motion near the captured one obeys the dynamics.
    """
    if motion.contact_forces is None:
        raise MotionStyleError(
            f"motion {motion.id}: no contact forces; a style needs a physical one"
        )
    settings = settings or SpacetimeSettings()
    captured = resample(motion, RATE_HZ)
    feet = captured_constraints(captured, "path")
    ranges = edit_ranges(captured, Edits())
    found = _project(captured, feet, ranges, functions, shoes, settings)
    values = found.values
    away = values.coordinates - captured.coordinates
    projection = Projection(
        status=found.status,
        optimality=found.optimality,
        angle_rms_deg=joint_rms_deg(values.coordinates, captured.coordinates),
        place_rms_mm=1000 * float(np.sqrt((away[:, :3] ** 2).sum(axis=1).mean())),
        root_n=float(np.abs(values.root).max()),
    )
    if not projection.root_n <= ROOT_LIMIT_N:
        raise MotionStyleError(
            f"motion {motion.id}: no motion near it obeys the dynamics in its contacts: "
            f"{projection.root_n:.1f} N are left at the root (limit {ROOT_LIMIT_N} N); choose a "
            "window without wrong contacts"
        )
    joints = JOINT_COORDINATES
    style = initial_style(
        values.coordinates[:, joints], values.rates[:, joints], values.muscle, shoes
    )
    about = {"recipe": "initial", "clip": motion.id, "body_mass_kg": motion.body.mass}
    target = replace(
        captured,
        coordinates=values.coordinates,
        contact_forces=values.forces + values.shoe_forces,
        rebranched=(),
    )
    return LearningProblem(
        captured=captured,
        target=target,
        controls=found.point.controls,
        coordinates=values.coordinates,
        feet=_kept_by(feet, values.points),
        ranges=ranges,
        start=replace(style, about=about),
        projection=projection,
        functions=functions,
        settings=settings,
    )


def _tracking(coordinates: Array, closeness: float) -> Tracking | None:
    if closeness == 0:
        return None
    weights = np.full(COUNT, float(closeness))
    weights[:3] *= PLACE_BY_ANGLE
    return Tracking(coordinates, weights)


def _kept_by(feet: FootConstraints, points: Array) -> FootConstraints:
    """Return constraints whose targets and clearance are those of foot points (F, 8, 3), m.

    The ground under swinging feet stays as it was: found anew it would lie some tenths of a
    millimetre elsewhere, which a shoe answers with newtons that nothing balances in flight.
    """
    held = feet.held[..., None]
    heights = ((points - feet.ground) * feet.normals).sum(axis=-1)
    return replace(
        feet,
        targets=np.where(held, points, feet.targets),
        clearance=np.where(feet.held, 0.0, np.minimum(heights, 0.0)),
    )


def _project(
    captured: Motion,
    feet: FootConstraints,
    ranges: Array,
    functions: Mapping[str, FrameFunction],
    shoes: tuple[float, float],
    settings: SpacetimeSettings,
) -> InteriorPointResult:
    """Return the feasible motion closest to a captured one."""
    count = len(JOINTS_29)
    limp = Style(np.full(count, 1 / count), PassiveParameters(*np.zeros((4, count))), *shoes)
    problem = SpacetimeProblem(
        captured.body, captured.rate_hz, feet, ranges, limp, dict(functions), settings
    )
    evaluator = Evaluator(problem)
    controls = evaluator.basis.fit(captured.coordinates)
    tracking = _tracking(evaluator.basis.evaluate(controls)[0], CLOSENESS)
    evaluator = Evaluator(replace(problem, tracking=tracking))
    solver = InteriorPoint(evaluator, SolverSettings(barrier=1e-2))
    return solver.solve(solver.start(controls, near=True))


def cost_at(problem: SpacetimeProblem, controls: Array, coefficients: Array) -> Cost:
    """Return what is minimised at control points (K, 35) and λ in N (F, 32), tracking apart.

    Every constraint of the problem is a price (see `spacetime_problem`), so this is defined, and
    no less than its minimum, for any motion, converged or not.
    """
    evaluator = Evaluator(problem)
    values = evaluator.values(controls, coefficients)
    terms = objective_terms(evaluator, values, coefficients)
    muscle, root = terms["muscles"], terms["root"]
    return Cost(sum(terms.values()), muscle + root, muscle, root, values)


def cost_of_point(problem: SpacetimeProblem, point: Point) -> Cost:
    """Return what is minimised at a solver's point."""
    return cost_at(problem, point.controls, point.coefficients * FORCE_UNIT)


def motion_cost(problem: SpacetimeProblem, controls: Array) -> Cost:
    """Return what is minimised at a motion, with the contact forces that suit it best.

    λ of a given motion is a nuisance: found anew at every θ, G ≥ 0 and the envelope gradient hold.
    """
    return cost_at(problem, controls, best_coefficients(Evaluator(problem), controls))


def target_cost(learning: LearningProblem, style: Style, gain: float | None = None) -> Cost:
    """Return E(X_T; θ)."""
    return motion_cost(learning.problem(style, gain=gain), learning.controls)
