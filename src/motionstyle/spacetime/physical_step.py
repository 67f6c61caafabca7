"""Cost and residuals of the physics fit at some control points, and one Gauss–Newton step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.kinematics import (
    Pose,
    contact_points,
    coordinate_axes,
    forward_kinematics,
    point_jacobian,
    points_in_world,
)
from motionstyle.body.layout import CONTACT_POINT_NODES, CONTACT_POINTS
from motionstyle.dynamics.inverse import GRAVITY
from motionstyle.dynamics.shoes import Shoes
from motionstyle.spacetime.forces import Eliminated, eliminate_forces
from motionstyle.spacetime.physical_problem import COUNT, FEET, Problem
from motionstyle.spacetime.splines import BandedSystem, Border

Array = NDArray[np.float64]
POINTS = len(CONTACT_POINTS)
HEELS = [CONTACT_POINTS.index(f"heel_{side}") for side in "rl"]
# Rows of the weighted residual: root and joints, what each foot bears, what each point bears.
SHARE_ROWS = slice(COUNT, COUNT + len(FEET))
POINT_ROWS = slice(COUNT + len(FEET), COUNT + len(FEET) + POINTS)
ROWS = POINT_ROWS.stop
LARGEST_DAMPING = 1e6
STIFFEST, LONGEST_REST = 1e5, 0.04  # N/m and m, of a shoe
SHOE_SCALE = np.array([1e4, 0.003])  # how far shoes are likely from those to start from


@dataclass(frozen=True)
class Variables:
    """Unknowns of the fit: control points (K, 35), and the shoes where there are any."""

    controls: Array
    shoes: Shoes | None

    def moved(self, step: Array, shoe_step: Array) -> Variables:
        """Return the variables after a step."""
        shoes = self.shoes
        if shoes is not None:
            stiffness, rest = shoes.stiffness + shoe_step[0], shoes.rest_length + shoe_step[1]
            shoes = Shoes(float(stiffness), float(rest))
        return Variables(self.controls + step, shoes)

    def room(self) -> tuple[Array, Array]:
        """Return how far the shoes may go down and up, in units of `SHOE_SCALE`, two of (2,)."""
        shoes = self.shoes or Shoes(0.0, 0.0)
        here = np.array([shoes.stiffness, shoes.rest_length]) / SHOE_SCALE
        return -here, np.array([STIFFEST, LONGEST_REST]) / SHOE_SCALE - here


@dataclass(frozen=True)
class State:
    """Everything at some variables.

    coordinates, rates, accelerations : (F, 35). contact_forces : of cones, (F, 8, 3), N.
    shoe_forces : at the heels, (F, 8, 3), N. root : residual of eq. (11), (F, 6), N and N·m.
    torques : Q_m + Q_p of the joints, (F, 29), N·m. solved : with weighted residuals (F, 45).
    """

    cost: float
    coordinates: Array
    rates: Array
    accelerations: Array
    contact_forces: Array
    shoe_forces: Array
    root: Array
    torques: Array
    solved: Eliminated


@dataclass(frozen=True)
class Kinematic:
    """What the pose alone says.

    points : of the feet, (F, 8, 3), m. misses : of markers, (F, M, 3), m. held : of foot points
    from where stances hold them, (F, 8, 3), m. clearance, normals : above the ground, (F, 8), m,
    and its normals, (F, 8, 3). excess : over joint ranges, (F, 35).
    """

    pose: Pose
    points: Array
    misses: Array
    held: Array
    clearance: Array
    normals: Array
    excess: Array

    @property
    def sunken(self) -> Array:
        """How far points are below the ground, (F, 8), ≤ 0, m."""
        return np.minimum(self.clearance, 0.0)


def kinematic(problem: Problem, q: Array) -> Kinematic:
    """Return what coordinates (F, 35) say without dynamics."""
    body, handles = problem.motion.body, problem.handles
    pose = forward_kinematics(body, q)
    points = contact_points(body, pose)
    low, high = problem.ranges.T
    clearance, normals = problem.ground.clearance(points)
    return Kinematic(
        pose=pose,
        points=points,
        misses=points_in_world(pose, handles.nodes, handles.local) - handles.targets,
        held=points - problem.ground.targets,
        clearance=clearance,
        normals=normals,
        excess=np.minimum(q - low, 0.0) + np.maximum(q - high, 0.0),
    )


def kinematic_costs(problem: Problem, q: Array, shown: Kinematic) -> dict[str, float]:
    """Return the cost's terms that forces have no part in."""
    settings = problem.settings
    hold = problem.ground.hold[..., None] / settings.slip_m**2
    return {
        "markers": 0.5 * float((problem.handles.precision[..., None] * shown.misses**2).sum()),
        "held feet": 0.5 * float((hold * shown.held**2).sum()),
        "sinking": 0.5 * float((shown.sunken**2).sum()) / settings.sink_m**2,
        "joint ranges": 0.5 * float((shown.excess**2).sum()) / settings.range_rad**2,
        "kinematic prior": 0.5 * float((problem.prior_weights * (q - problem.prior) ** 2).sum()),
    }


def force_costs(problem: Problem, state: State) -> dict[str, float]:
    """Return the cost's terms that come from dynamics."""
    squared = 0.5 * (state.solved.residuals**2).sum(axis=0)
    terms = {
        "root residual": squared[:6],
        "joint torques": squared[6:COUNT],
        "share of the feet": squared[SHARE_ROWS],
        "normal forces": squared[POINT_ROWS],
    }
    return {name: float(values.sum()) for name, values in terms.items()}


def _row_scale(problem: Problem) -> Array:
    torque = problem.settings.torque_nm
    return np.concatenate([np.full(6, 1 / problem.root_n), np.full(COUNT - 6, 1 / torque)])


def _dense(values: Array, pattern: tuple, shape: tuple[int, int]) -> Array:
    full = np.zeros((len(values), *shape))
    full[:, pattern[0], pattern[1]] = values
    return full


def _share_scale(problem: Problem) -> tuple[Array, Array]:
    """Return expected normal forces (F, 2) with 0 where unknown, and 1/σ or 0, (F, 2)."""
    known = np.isfinite(problem.expected)
    weight = problem.motion.body.mass * GRAVITY
    return np.where(known, problem.expected, 0.0), known / (problem.settings.share_bw * weight)


def _shoe_forces(shoes: Shoes | None, shown: Kinematic) -> Array:
    """Return the shoes' forces at the contact points, (F, 8, 3), N."""
    forces = np.zeros_like(shown.points)
    if shoes is not None:
        pressed = shoes.force(shown.clearance[:, HEELS])
        forces[:, HEELS] = pressed[..., None] * shown.normals[:, HEELS]
    return forces


def _columns(problem: Problem, by_force: Array) -> Array:
    """Return the response of the weighted residual to cone coefficients, (F, 45, 32)."""
    frames = len(by_force)
    columns = np.zeros((frames, ROWS, POINTS, 4))
    response = by_force.reshape(frames, COUNT, POINTS, 3)
    columns[:, :COUNT] = np.einsum("frpa,fpca->frpc", response, problem.cone, optimize=True)
    columns[:, :COUNT] *= _row_scale(problem)[:, None, None]
    _expected, scale = _share_scale(problem)
    for side, foot in enumerate(FEET):
        share = scale[:, side, None, None] * problem.lift[:, foot]
        columns[:, COUNT + side, foot] = share
    each = np.arange(POINTS)
    price = np.sqrt(problem.prices)[..., None] * problem.lift
    columns[:, POINT_ROWS.start + each, each] = price
    return columns.reshape(frames, ROWS, 4 * POINTS)


def evaluate(problem: Problem, variables: Variables) -> State:
    """Return cost, forces and residuals at some variables; cone forces are eliminated."""
    q, qd, qdd = problem.basis.evaluate(variables.controls)
    frames = len(q)
    shown = kinematic(problem, q)
    shoe = _shoe_forces(variables.shoes, shown)
    values = problem.slopes(q, qd, qdd, shoe.reshape(frames, -1), problem.parameters)
    by_force = _dense(values[4], problem.patterns[3], (COUNT, 3 * POINTS))
    scale = _row_scale(problem)
    expected, share_scale = _share_scale(problem)
    normal_shoe = (shoe * shown.normals).sum(axis=-1)
    residuals = np.zeros((frames, ROWS))
    residuals[:, :COUNT] = values[0]
    residuals[:, :6] += problem.shift
    residuals[:, :COUNT] *= scale
    borne = np.stack([normal_shoe[:, foot].sum(axis=1) for foot in FEET], axis=1)
    residuals[:, SHARE_ROWS] = (borne - expected) * share_scale
    residuals[:, POINT_ROWS] = -problem.settled * np.sqrt(problem.prices)
    ridge = np.full((frames, 4 * POINTS), problem.settings.ridge_n**-2.0)
    solved = eliminate_forces(residuals, _columns(problem, by_force), problem.bearing, ridge)
    lambdas = solved.coefficients.reshape(frames, POINTS, 4)
    cost = float(solved.cost.sum()) + sum(kinematic_costs(problem, q, shown).values())
    cost += 0.5 * float((_shoe_prior(problem, variables.shoes) ** 2).sum())
    return State(
        cost=cost,
        coordinates=q,
        rates=qd,
        accelerations=qdd,
        contact_forces=np.einsum("fpc,fpca->fpa", lambdas, problem.cone),
        shoe_forces=shoe,
        root=solved.residuals[:, :6] / scale[:6] - problem.shift,
        torques=solved.residuals[:, 6:COUNT] / scale[6:],
        solved=solved,
    )


def _shoe_prior(problem: Problem, shoes: Shoes | None) -> Array:
    """Return how far the shoes are from those to start from, in units of `SHOE_SCALE`, (2,)."""
    first = problem.shoes
    if shoes is None or first is None:
        return np.zeros(2)
    away = [shoes.stiffness - first.stiffness, shoes.rest_length - first.rest_length]
    return np.array(away) / SHOE_SCALE


@dataclass(frozen=True)
class _Model:
    """Quadratic model of the cost: per frame over (q, q̇, q̈), and over the shoes."""

    hessians: Array
    gradients: Array
    shoe_cross: Array
    shoe_hessian: Array
    shoe_gradient: Array


def _model(problem: Problem, variables: Variables, state: State) -> _Model:
    q, frames, shoes = state.coordinates, len(state.coordinates), variables.shoes
    forces = (state.contact_forces + state.shoe_forces).reshape(frames, -1)
    values = problem.slopes(q, state.rates, state.accelerations, forces, problem.parameters)
    blocks = [_dense(values[k + 1], problem.patterns[k], (COUNT, COUNT)) for k in range(3)]
    shown = kinematic(problem, q)
    axes = coordinate_axes(shown.pose, q)
    touch = point_jacobian(shown.pose, axes, np.array(CONTACT_POINT_NODES), shown.points)
    jacobian = np.zeros((frames, ROWS, 3 * COUNT))
    by_shoes = np.zeros((frames, ROWS, 2))
    if shoes is not None:
        by_force = _dense(values[4], problem.patterns[3], (COUNT, 3 * POINTS))
        by_force = by_force.reshape(frames, COUNT, POINTS, 3)
        _expected, share_scale = _share_scale(problem)
        heights = shown.clearance[:, HEELS]
        slope, by_parameter = shoes.force_by_height(heights), shoes.force_by_parameters(heights)
        for side, heel in enumerate(HEELS):
            normal = shown.normals[:, heel]
            pressed = np.einsum("fra,fa->fr", by_force[:, :, heel], normal)
            climbs = np.einsum("fa,fac->fc", normal, touch[:, heel])
            by_height = pressed[:, :, None] * climbs[:, None]
            blocks[0] = blocks[0] + slope[:, side, None, None] * by_height
            by_shoes[:, :COUNT] += pressed[:, :, None] * by_parameter[:, side, None]
            share = share_scale[:, side]
            jacobian[:, COUNT + side, :COUNT] = (share * slope[:, side])[:, None] * climbs
            by_shoes[:, COUNT + side] = share[:, None] * by_parameter[:, side]
    scale = _row_scale(problem)[:, None]
    jacobian[:, :COUNT] = np.concatenate(blocks, axis=2) * scale
    by_shoes[:, :COUNT] *= scale
    by_shoes *= SHOE_SCALE
    weights, residuals = state.solved.weights, state.solved.residuals
    weighted = weights @ jacobian
    hessians = np.swapaxes(jacobian, 1, 2) @ weighted
    gradients = np.einsum("frc,fr->fc", jacobian, residuals)
    own, pull = _kinematic_model(problem, q, shown, axes, touch)
    hessians[:, :COUNT, :COUNT] += own
    gradients[:, :COUNT] += pull
    cross = np.einsum("frc,frs->fcs", weighted, by_shoes)
    shoe_hessian = np.einsum("frs,frq,fqt->st", by_shoes, weights, by_shoes, optimize=True)
    shoe_gradient = np.einsum("frs,fr->s", by_shoes, residuals)
    shoe_gradient += _shoe_prior(problem, shoes)
    return _Model(hessians, gradients, cross, shoe_hessian + np.eye(2), shoe_gradient)


def _kinematic_model(
    problem: Problem, q: Array, shown: Kinematic, axes: Array, touch: Array
) -> tuple[Array, Array]:
    """Return Hessian (F, 35, 35) and gradient (F, 35) of the terms without forces."""
    settings, handles, frames = problem.settings, problem.handles, len(q)
    points = points_in_world(shown.pose, handles.nodes, handles.local)
    slope = point_jacobian(shown.pose, axes, handles.nodes, points).reshape(frames, -1, COUNT)
    precision = np.repeat(handles.precision, 3, axis=1)
    own = np.swapaxes(slope, 1, 2) @ (precision[..., None] * slope)
    pull = np.einsum("fmc,fm->fc", slope, precision * shown.misses.reshape(frames, -1))
    hold = np.repeat(problem.ground.hold, 3, axis=1) / settings.slip_m**2
    slope = touch.reshape(frames, -1, COUNT)
    own += np.swapaxes(slope, 1, 2) @ (hold[..., None] * slope)
    pull += np.einsum("fmc,fm->fc", slope, hold * shown.held.reshape(frames, -1))
    lift = (shown.sunken < 0) / settings.sink_m**2
    climb = np.einsum("fpa,fpac->fpc", shown.normals, touch)
    own += np.swapaxes(climb, 1, 2) @ (lift[..., None] * climb)
    pull += np.einsum("fpc,fp->fc", climb, lift * shown.sunken)
    beyond = 1 / settings.range_rad**2
    own[:, np.arange(COUNT), np.arange(COUNT)] += problem.prior_weights + (
        (shown.excess != 0) * beyond
    )
    pull += problem.prior_weights * (q - problem.prior) + shown.excess * beyond
    return own, pull


@dataclass(frozen=True)
class Step:
    """A step that was taken: where it led, the damping, and the fall of cost the model promised."""

    variables: Variables
    state: State
    damping: float
    promised: float


def step(problem: Problem, variables: Variables, state: State, damping: float) -> Step:
    """Take one damped Gauss–Newton step that lowers the cost, or none."""
    model = _model(problem, variables, state)
    system = BandedSystem(problem.basis, COUNT)
    band, gradient = system.assemble(model.hessians, model.gradients)
    border, shoe_move = None, np.zeros(2)
    if variables.shoes is not None:
        border = Border(
            system.gather(model.shoe_cross),
            model.shoe_hessian,
            model.shoe_gradient,
            variables.room(),
        )
    metric = np.full(band.shape[1], 1 / problem.settings.marker_m**2)
    promised = 0.0
    while damping < LARGEST_DAMPING:
        if border is None:
            move = system.solve(band, gradient, damping * metric)
        else:
            move, shoe_move = system.solve_bordered(band, gradient, damping * metric, border)
        slope = -float((gradient * move).sum()) - float(model.shoe_gradient @ shoe_move)
        promised = max(promised, 0.5 * slope)
        trial = variables.moved(move, shoe_move * SHOE_SCALE)
        found = evaluate(problem, trial)
        if found.cost <= state.cost:
            return Step(trial, found, max(damping * 0.2, 1e-9), promised)
        damping *= 8
    return Step(variables, state, damping, promised)
