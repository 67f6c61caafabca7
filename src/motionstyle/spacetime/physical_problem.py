"""The problem behind the physics fit: its cost, contact forces, and one Gauss–Newton step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.body import Body
from motionstyle.body.kinematics import (
    contact_points,
    coordinate_axes,
    forward_kinematics,
    point_jacobian,
    points_in_world,
)
from motionstyle.body.layout import CONTACT_POINT_NODES, NODES
from motionstyle.body.ranges import joint_ranges
from motionstyle.dynamics.codegen import FrameFunction
from motionstyle.dynamics.symbols import parameter_vector
from motionstyle.errors import MotionStyleError
from motionstyle.motion.motion import Motion
from motionstyle.spacetime.forces import Eliminated, cone_basis, eliminate_forces
from motionstyle.spacetime.splines import BandedSystem, SplineBasis

Array = NDArray[np.float64]
COUNT = 35
MARKER_ARM = 0.10  # m


@dataclass(frozen=True)
class PhysicalSettings:
    """Weights as the error each term is allowed (one standard deviation), and solver limits."""

    frames_per_knot: float = 2.0
    marker_m: float = 0.01
    unobserved_rad: float = 0.15
    root_n: float = 20.0
    root_shrink: float = 0.6
    root_least_n: float = 0.3
    torque_nm: float = 100.0
    force_n: float = 500.0
    slip_m: float = 0.001
    range_rad: float = 0.02
    friction: float = 0.8
    settled_m: float = 0.01
    settled_mps: float = 0.3
    spread_s: float = 0.0
    outer: int = 16
    inner: int = 8
    tolerance: float = 1e-3
    root_goal_n: float = 0.1


@dataclass
class Problem:
    """A motion to be fitted, with targets, weights and the multipliers of the root residual."""

    motion: Motion
    settings: PhysicalSettings
    slopes: FrameFunction
    forces: FrameFunction
    basis: SplineBasis
    parameters: Array
    nodes: NDArray[np.int64]
    local: Array
    targets: Array
    feet: Array
    foot_weights: Array
    bearing: NDArray[np.bool_]
    ridge: Array
    cone: Array
    ranges: Array
    prior: Array
    prior_weights: Array
    shift: Array
    root_n: float
    patterns: list[tuple[NDArray[np.int64], NDArray[np.int64]]]


@dataclass(frozen=True)
class State:
    """Cost, contact forces (F, 8, 3) and root residual (F, 6) at some control points."""

    cost: float
    solved: Eliminated
    contact_forces: Array
    root: Array
    coordinates: Array
    rates: Array


def set_up(
    motion: Motion, functions: dict[str, FrameFunction], settings: PhysicalSettings
) -> Problem:
    """Return the problem of a kinematic motion."""
    if motion.frames < 8:
        raise MotionStyleError(f"motion {motion.id}: {motion.frames} frames are too few, need 8")
    body = motion.body
    pose = motion.pose()
    arms = np.concatenate([np.zeros((1, 3)), MARKER_ARM * np.eye(3)])
    nodes = np.repeat(np.arange(len(NODES)), len(arms))
    local = np.tile(arms, (len(NODES), 1))
    points = contact_points(body, pose)
    feet, weights = _foot_targets(points, motion)
    ranges = joint_ranges()
    margin = np.radians(5)
    low = np.minimum(ranges[:, 0], motion.coordinates.min(axis=0) - margin)
    high = np.maximum(ranges[:, 1], motion.coordinates.max(axis=0) + margin)
    slopes = functions["forces_and_slopes"]
    return Problem(
        motion=motion,
        settings=settings,
        slopes=slopes,
        forces=functions["forces"],
        basis=SplineBasis.uniform(motion.frames, motion.rate_hz, settings.frames_per_knot),
        parameters=parameter_vector(body),
        nodes=nodes,
        local=local,
        targets=points_in_world(pose, nodes, local),
        feet=feet,
        foot_weights=weights / settings.slip_m**2,
        bearing=_spread(motion.contacts, round(settings.spread_s * motion.rate_hz)),
        ridge=np.repeat(_force_prices(points, motion, settings), 4, axis=1),
        cone=cone_basis(motion.contact_normals, settings.friction),
        ranges=np.stack([low, high], axis=1),
        prior=motion.coordinates,
        prior_weights=np.where(motion.observed, 0.0, 1 / settings.unobserved_rad**2),
        shift=np.zeros((motion.frames, 6)),
        root_n=settings.root_n,
        patterns=[slopes.pattern(k) for k in range(1, 5)],
    )


def _force_prices(points: Array, motion: Motion, settings: PhysicalSettings) -> Array:
    """Return what a squared newton costs at each foot point, (F, 8).

    A point that is still settling or already leaving bears little: its price grows with its
    height and speed, so that weight passes from foot to foot as it does on force plates.
    """
    speed = np.linalg.norm(np.gradient(points, 1 / motion.rate_hz, axis=0), axis=-1)
    height = np.maximum(points[..., 1] - points[..., 1].min(axis=0), 0.0)
    unrest = (height / settings.settled_m) ** 2 + (speed / settings.settled_mps) ** 2
    return (1 + unrest) ** 2 / settings.force_n**2


def _foot_targets(points: Array, motion: Motion) -> tuple[Array, Array]:
    """Return where bearing points are held (their stance's mean, on the ground) and weights."""
    target, weights = np.array(points), np.zeros_like(points)
    for p in range(points.shape[1]):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], motion.contacts[:, p], [0]])))
        for first, stop in zip(edges[::2], edges[1::2], strict=True):
            target[first:stop, p] = points[first:stop, p].mean(axis=0)
            weights[first:stop, p] = 1.0
    return target, weights


def _spread(mask: NDArray[np.bool_], frames: int) -> NDArray[np.bool_]:
    """Return the mask widened by some frames on both sides of each stance."""
    wide = mask.copy()
    for shift in range(1, frames + 1):
        wide[shift:] |= mask[:-shift]
        wide[:-shift] |= mask[shift:]
    return wide


def _scale(problem: Problem) -> Array:
    torque = problem.settings.torque_nm
    return np.concatenate([np.full(6, 1 / problem.root_n), np.full(29, 1 / torque)])


def _dense(values: Array, pattern: tuple, shape: tuple[int, int]) -> Array:
    full = np.zeros((len(values), *shape))
    full[:, pattern[0], pattern[1]] = values
    return full


def evaluate(problem: Problem, controls: Array) -> State:
    """Return cost, forces and root residual at control points."""
    q, qd, qdd = problem.basis.evaluate(controls)
    frames = len(q)
    values = problem.slopes(q, qd, qdd, np.zeros((frames, 24)), problem.parameters)
    by_force = _dense(values[4], problem.patterns[3], (COUNT, 24))
    cone = problem.cone.reshape(frames, 8, 4, 3)
    columns = np.einsum("frpa,fpca->frpc", by_force.reshape(frames, COUNT, 8, 3), cone)
    scale = _scale(problem)
    shifted = values[0].copy()
    shifted[:, :6] += problem.shift
    solved = eliminate_forces(
        shifted * scale,
        columns.reshape(frames, COUNT, 32) * scale[:, None],
        problem.bearing,
        problem.ridge,
    )
    contact = np.einsum("fpc,fpca->fpa", solved.coefficients.reshape(frames, 8, 4), cone)
    root = solved.residuals[:, :6] / scale[:6] - problem.shift
    cost = float(solved.cost.sum()) + _kinematic_cost(problem, q)
    return State(cost, solved, contact, root, q, qd)


def kinematic_terms(problem: Problem, q: Array) -> tuple[Array, Array, Array, Array]:
    """Return marker misses (F, M, 3), foot misses and weights (F, 8, 3), excess over ranges."""
    pose = forward_kinematics(problem.motion.body, q)
    misses = points_in_world(pose, problem.nodes, problem.local) - problem.targets
    points = contact_points(problem.motion.body, pose)
    weights = problem.foot_weights.copy()
    sunken = np.minimum(points[..., 1] - np.minimum(problem.feet[..., 1], 0.0), 0.0)
    foot = (points - problem.feet) * (problem.foot_weights > 0)
    free = (problem.foot_weights[..., 1] == 0) & (sunken < 0)
    foot[..., 1] = np.where(free, sunken, foot[..., 1])
    weights[..., 1] = np.where(free, 1 / problem.settings.slip_m**2, weights[..., 1])
    low, high = problem.ranges.T
    excess = np.minimum(q - low, 0.0) + np.maximum(q - high, 0.0)
    return misses, foot, weights, excess


def _kinematic_cost(problem: Problem, q: Array) -> float:
    settings = problem.settings
    misses, foot, weights, excess = kinematic_terms(problem, q)
    cost = (misses**2).sum() / settings.marker_m**2 / 4
    cost += (weights * foot**2).sum()
    cost += (excess**2).sum() / settings.range_rad**2
    cost += (problem.prior_weights * (q - problem.prior) ** 2).sum()
    return 0.5 * float(cost)


def step(
    problem: Problem, controls: Array, state: State, damping: float
) -> tuple[Array, State, float]:
    """Take one damped Gauss–Newton step that lowers the cost, or none."""
    settings, basis = problem.settings, problem.basis
    q, qd, qdd = basis.evaluate(controls)
    frames = len(q)
    values = problem.slopes(
        q, qd, qdd, state.contact_forces.reshape(frames, 24), problem.parameters
    )
    blocks = [_dense(values[k + 1], problem.patterns[k], (COUNT, COUNT)) for k in range(3)]
    jacobian = np.concatenate(blocks, axis=2) * _scale(problem)[:, None]
    weighted = state.solved.weights @ jacobian
    hessians = np.swapaxes(jacobian, 1, 2) @ weighted
    gradients = np.einsum("frc,fr->fc", jacobian, state.solved.residuals)
    body: Body = problem.motion.body
    pose = forward_kinematics(body, q)
    axes = coordinate_axes(pose, q)
    misses, foot, weights, excess = kinematic_terms(problem, q)
    points = points_in_world(pose, problem.nodes, problem.local)
    slope = point_jacobian(pose, axes, problem.nodes, points).reshape(frames, -1, COUNT)
    factor = 0.25 / settings.marker_m**2
    own = factor * np.swapaxes(slope, 1, 2) @ slope
    pull = factor * np.einsum("fmc,fm->fc", slope, misses.reshape(frames, -1))
    touch = contact_points(body, pose)
    slope = point_jacobian(pose, axes, np.array(CONTACT_POINT_NODES), touch)
    slope = slope.reshape(frames, 24, COUNT)
    flat = weights.reshape(frames, 24)
    own += np.swapaxes(slope, 1, 2) @ (flat[..., None] * slope)
    pull += np.einsum("fmc,fm->fc", slope, flat * foot.reshape(frames, 24))
    diagonal = problem.prior_weights + (excess != 0) / settings.range_rad**2
    own[:, np.arange(COUNT), np.arange(COUNT)] += diagonal
    pull += problem.prior_weights * (q - problem.prior) + excess / settings.range_rad**2
    hessians[:, :COUNT, :COUNT] += own
    gradients[:, :COUNT] += pull
    system = BandedSystem(basis, COUNT)
    band, gradient = system.assemble(hessians, gradients)
    metric = np.full(band.shape[1], 1 / settings.marker_m**2)
    while damping < 1e6:
        step = system.solve(band, gradient, damping * metric)
        trial = evaluate(problem, controls + step)
        if trial.cost <= state.cost:
            return controls + step, trial, max(damping * 0.2, 1e-9)
        damping *= 8
    return controls, state, damping
