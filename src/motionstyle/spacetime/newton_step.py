"""Newton's step of the barrier problem: λ eliminated per frame, the rest solved as one band.

Three moves: `newton_blocks` gathers what does not depend on the regularisation δ, `factorise`
eliminates λ and finds the least δ that makes the matrix convex, `newton_step` solves.

A spring about to reach its rest angle bends within milliradians (7), and its curvature, where it is
negative, is the most negative of all by orders of magnitude, in one joint during some frames. A δ
large enough for it would hold back all joints during all frames, so this curvature is left out
before δ is raised.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionstyle.spacetime.banded import assemble_gradient, factor, solve, spread
from motionstyle.spacetime.barrier_problem import BarrierProblem
from motionstyle.spacetime.frame_sums import Eliminated, ForceBlocks
from motionstyle.spacetime.solver_point import FORCE_UNIT, Excess, Point
from motionstyle.spacetime.spacetime_problem import COUNT, Slopes, Values

Array = NDArray[np.float64]
EXACT_BELOW = 1e-2  # the δ from which concave springs are left out at once
RIGID = 1e20  # what holds fixed control points: far above the largest curvature, some 1e11


@dataclass(frozen=True)
class Blocks:
    """Parts of the Newton system: exact curvature and Gauss–Newton parts apart.

    Attributes
    ----------
    curved, gauss : over the control points, in blocks (K, 4, 36, 40), see `frame_sums`.
    concave : the share of `curved` that is concave bends of springs, on diagonals, (K, 4, 35).
    forces : λ's own block and that of λ and u, the barrier and w_λ in its diagonal.
    track_pull : ∂φ/∂q of the tracking term, (F, 35).
    force_pull : ∂φ/∂λ without residuals, (F, 32). by_force : ∂r/∂λ, (F, 35, 32), per 100 N.
    stiff : stiffness of the inequality rows, (F, R).
    """

    barrier: float
    curved: Array
    gauss: Array
    concave: Array
    forces: ForceBlocks
    track_pull: Array
    force_pull: Array
    by_force: Array
    slopes: Slopes
    stiff: Array


@dataclass(frozen=True)
class Factor:
    """The factored banded matrix, how λ was eliminated from it, and the δ that was needed."""

    factor: Array
    eliminated: Eliminated
    delta: float


def newton_blocks(
    system: BarrierProblem, point: Point, values: Values, slopes: Slopes, barrier: float
) -> Blocks:
    """Return the parts of the Newton system that do not depend on the regularisation."""
    evaluator = system.evaluator
    n = len(evaluator.limited)
    at, by_state = evaluator.limited, slopes.by_state
    by_force = FORCE_UNIT * slopes.by_coefficients
    pushes = -point.row_dual[:, 2 * n :] * evaluator.row_scale[2 * n :]
    curvature, mixed = evaluator.curvature(
        values, slopes, point.multiplier, point.foot_multiplier, pushes
    )
    gauss, curved = system.sums.nothing(), system.sums.nothing()
    system.sums.add_products(by_state, gauss)
    system.sums.add_products(slopes.feet, gauss)
    # Inequalities have the stiffness w/(s + w/ρ).
    firm = point.slack + point.row_dual / system.weight
    stiff = np.where(system.active, point.row_dual / firm, 0.0)
    stiff_scaled = stiff * evaluator.row_scale**2
    up = slopes.heights * stiff_scaled[:, 2 * n :, None]
    place = curvature.place  # rows and tracking depend on q alone
    place += np.swapaxes(slopes.heights, 1, 2) @ up
    place[:, at, at] += stiff_scaled[:, :n] + stiff_scaled[:, n : 2 * n]
    tracking = evaluator.problem.tracking
    if tracking is not None:
        joints = np.arange(COUNT)
        place[:, joints, joints] += tracking.weights
    system.sums.add_curvature(curvature, curved)
    safe = np.where(system.bearing, point.coefficients, 1.0)
    pull = np.where(system.bearing, system.force_weight * point.coefficients - barrier / safe, 0.0)
    return Blocks(
        barrier=barrier,
        curved=curved,
        gauss=gauss,
        concave=system.sums.diagonals(curvature.concave),
        forces=ForceBlocks(
            inner=np.swapaxes(by_force, 1, 2) @ by_force,
            diagonal=np.where(system.bearing, point.dual / safe + system.force_weight, 1.0),
            mixed=np.swapaxes(by_force, 1, 2) @ by_state,
            mixed_place=FORCE_UNIT * np.ascontiguousarray(np.swapaxes(mixed, 1, 2)),
        ),
        track_pull=evaluator.tracking_pull(values.coordinates),
        force_pull=pull,
        by_force=by_force,
        slopes=slopes,
        stiff=stiff,
    )


def factorise(
    system: BarrierProblem,
    blocks: Blocks,
    wanted: float,
    last: float = 0.0,
    *,
    straighten: bool = False,
) -> Factor:
    """Return the factored Newton matrix, with the δ that is wanted or as much as makes it convex.

    Parameters
    ----------
    last : the last δ that was not 0, or 0.
    straighten : whether concave bends of springs may be left out of it before δ is raised.

    Raises
    ------
    FloatingPointError
        If no δ makes it convex, which is when its entries are not finite.
    """
    delta = wanted
    while True:
        found = None
        if not straighten or delta < EXACT_BELOW:
            found = _eliminate(system, blocks, delta)
        if found is None and straighten:
            found = _eliminate(system, blocks, delta, straightened=True)
        if found is not None:
            return found
        delta = 4 * delta if delta else max(1e-4, last / 3)
        if not delta < 1e20:
            raise FloatingPointError("the Newton matrix has entries that are not finite")


def _eliminate(
    system: BarrierProblem, blocks: Blocks, delta: float, *, straightened: bool = False
) -> Factor | None:
    """Return the factored matrix with λ eliminated; None if it is not convex at δ.

    δ is added on all unknowns: on the copies of residuals it means (1 + δ) JᵀJ, a metric in
    which the valleys of E are not narrow.
    """
    total = (1 + delta) * blocks.gauss
    total += blocks.curved
    if straightened:
        joints = np.arange(COUNT)
        total[:, :, joints, joints] -= blocks.concave
    eliminated = system.sums.eliminate(total, delta, blocks.forces)
    fixed = np.where(system.fixed, RIGID, 0.0).ravel()
    found = factor(system.sums.banded(total, delta * system.metric, fixed + delta))
    return None if found is None else Factor(found, eliminated, delta)


def newton_step(
    system: BarrierProblem, point: Point, blocks: Blocks, factor: Factor, excess: Excess
) -> tuple[Point, float]:
    """Return the step for given constraint errors, and the slope of φ along it."""
    basis, more = system.evaluator.basis, 1 + factor.delta
    lift = point.lift + more * excess.residuals
    foot_lift = point.foot_lift + more * excess.feet
    firm = point.slack + point.row_dual / system.weight
    target = blocks.barrier + point.row_dual * (
        point.slack - (excess.rows + point.slack - point.elastic)
    )
    wanted = np.where(system.active, target / firm, 0.0)
    gradient = np.vecmat(lift, blocks.slopes.by_state)
    gradient[:, :COUNT] += np.vecmat(foot_lift, blocks.slopes.feet)
    gradient[:, :COUNT] += blocks.track_pull - system.row_pull(blocks.slopes, wanted)
    pull = np.vecmat(lift, blocks.by_force) + blocks.force_pull
    eliminated = factor.eliminated
    answer = eliminated.forward(pull[..., None])
    gradient -= np.vecmat(answer[..., 0], eliminated.half)
    right = -assemble_gradient(basis, gradient)
    right[system.fixed] = 0.0
    moved = solve(factor.factor, right)
    moved[system.fixed] = 0.0
    state = spread(basis, moved)
    forces = -eliminated.backward(answer + eliminated.half @ state[..., None])[..., 0]
    forces = np.where(system.bearing, forces, 0.0)
    return _whole_step(system, point, blocks, excess, wanted, moved, state, forces, factor.delta)


def _whole_step(
    system: BarrierProblem,
    point: Point,
    blocks: Blocks,
    excess: Excess,
    wanted: Array,
    moved: Array,
    state: Array,
    forces: Array,
    delta: float,
) -> tuple[Point, float]:
    """Return the whole step and the slope of φ along it, from its part in (x, λ)."""
    evaluator, barrier, slopes = system.evaluator, blocks.barrier, blocks.slopes
    n, at, q = len(evaluator.limited), evaluator.limited, slice(0, COUNT)
    change = np.matvec(slopes.by_state, state) + np.matvec(blocks.by_force, forces)
    lift = change + excess.residuals
    foot_lift = np.matvec(slopes.feet, state[:, q]) + excess.feet
    rows = np.empty_like(point.slack)
    rows[:, :n] = state[:, at]
    rows[:, n : 2 * n] = -state[:, at]
    rows[:, 2 * n :] = np.matvec(slopes.heights, state[:, q])
    rows *= evaluator.row_scale
    new_dual = np.where(system.active, wanted - blocks.stiff * rows, 0.0)
    elastic = np.where(system.active, new_dual / system.weight - point.elastic, 0.0)
    slack = np.where(system.active, excess.rows + rows + elastic, 0.0)
    safe = np.where(system.bearing, point.coefficients, 1.0)
    dual = np.where(system.bearing, barrier / safe - point.dual * (1 + forces / safe), 0.0)
    step = Point(
        controls=moved,
        coefficients=forces,
        lift=lift,
        foot_lift=foot_lift,
        multiplier=(1 + delta) * lift + point.lift - point.multiplier,
        foot_multiplier=(1 + delta) * foot_lift + point.foot_lift - point.foot_multiplier,
        elastic=elastic,
        slack=slack,
        dual=dual,
        row_dual=new_dual - point.row_dual,
    )
    slope = (point.lift * lift).sum() + (point.foot_lift * foot_lift).sum()
    slope += (blocks.track_pull * state[:, q]).sum()
    slope += (system.force_weight * point.coefficients * forces)[system.bearing].sum()
    slope += (system.weight * point.elastic * elastic)[system.active].sum()
    slope -= barrier * (forces / safe)[system.bearing].sum()
    slope -= barrier * (slack / point.slack)[system.active].sum()
    return step, float(slope)
