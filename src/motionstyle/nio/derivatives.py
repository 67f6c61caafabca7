"""Derivatives of E by θ: Liu et al. 2005, eq. (21), nio.md §4.6; and mixed ones.

By the envelope theorem dG/dθ = ∂E(X_T)/∂θ − ∂E(X_S)/∂θ at fixed motions, exact where X_S is
optimal.
The mixed derivatives ∂²E/∂X∂θ tell how the optimum itself moves (`spacetime.sensitivity`).
Order of θ as in `Style.vector`: α, k_s1, k_s2, k_d, q̄ (29 each), k_shoe, h̄.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.layout import JOINT_COORDINATES
from motionstyle.dynamics.passive import sigmoid_slopes
from motionstyle.dynamics.shoes import Shoes
from motionstyle.spacetime.sensitivity import OptimumHessian
from motionstyle.spacetime.solver_point import InteriorPointResult
from motionstyle.spacetime.spacetime_problem import (
    COUNT,
    HEELS,
    POINTS,
    Evaluator,
    SpacetimeProblem,
    Values,
)
from motionstyle.spacetime.style import JOINTS_29, parameter_names

Array = NDArray[np.float64]
JOINTS = len(JOINTS_29)
SIZE = len(parameter_names())
SHOE_STEPS = (10.0, 1e-5)  # of k_shoe, N/m, and h̄, m, for differences of gradients


@dataclass(frozen=True)
class _Spring:
    """∂Q_m/∂θ of one kind of passive parameter, and its slopes by q and q̇, each (F, 29)."""

    value: Array
    by_angle: Array
    by_rate: Array


def _springs(evaluator: Evaluator, values: Values) -> list[_Spring]:
    """Return the kinds k_s1, k_s2, k_d, q̄ (nio.md §4.6)."""
    problem = evaluator.problem
    gain, passive = problem.settings.sigmoid_gain, problem.style.passive
    away = values.coordinates[:, JOINT_COORDINATES] - passive.rest_angle
    rates = values.rates[:, JOINT_COORDINATES]
    above, steep, _bend = sigmoid_slopes(away, gain)
    _force, slope, bend = evaluator.passive(values.coordinates, values.rates)
    none, ones = np.zeros_like(away), np.ones_like(away)
    return [
        _Spring(above * away, above + steep * away, none),
        _Spring((1 - above) * away, (1 - above) - steep * away, none),
        _Spring(rates, none, ones),
        _Spring(-slope, -bend, none),
    ]


def energy_by_style(problem: SpacetimeProblem, values: Values) -> Array:
    """Return ∂E/∂θ at a fixed motion, (147,)."""
    evaluator = Evaluator(problem)
    preferences = problem.style.preferences
    muscle = values.muscle
    found = np.zeros(SIZE)
    found[:JOINTS] = (muscle**2).sum(axis=0)
    for k, spring in enumerate(_springs(evaluator, values), start=1):
        found[k * JOINTS : (k + 1) * JOINTS] = 2 * preferences * (muscle * spring.value).sum(axis=0)
    found[-2:] = _energy_by_shoes(evaluator, values)
    return found


def _energy_by_shoes(evaluator: Evaluator, values: Values) -> Array:
    """Return ∂E/∂(k_shoe, h̄): eq. (9)'s force along each heel's normal, by virtual work."""
    problem = evaluator.problem
    style, feet = problem.style, problem.feet
    slopes = evaluator.slopes(values)
    by_force = slopes.by_force.reshape(problem.frames, COUNT, POINTS, 3)
    by_push = np.einsum("frpa,fpa->frp", by_force, feet.normals)[:, :, HEELS]
    height = ((values.points - feet.ground) * feet.normals).sum(axis=-1)[:, HEELS]
    shoes = Shoes(style.shoe_stiffness, style.shoe_rest_length, problem.settings.shoe_gain)
    weighted = 2 * values.residuals * evaluator.scale
    push = np.einsum("fr,frp->fp", weighted, by_push)
    return (push[..., None] * shoes.force_by_parameters(height)).sum(axis=(0, 1))


def mixed_derivatives(
    problem: SpacetimeProblem, values: Values, coefficients: Array
) -> tuple[Array, Array]:
    """Return ∂²E/∂u∂θ (F, 105, 147), u = (q, q̇, q̈), and ∂²E/∂λ∂θ (F, 32, 147), λ in N.

    Parameters
    ----------
    coefficients : λ the values belong to, N, (F, 32).
    """
    evaluator = Evaluator(problem)
    slopes = evaluator.slopes(values)
    muscle, preferences = values.muscle, problem.style.preferences
    by_state = slopes.by_state[:, 6:] / evaluator.scale[6:, None]
    by_coefficients = slopes.by_coefficients[:, 6:] / evaluator.scale[6:, None]
    state = np.zeros((problem.frames, 3 * COUNT, SIZE))
    force = np.zeros((problem.frames, by_coefficients.shape[2], SIZE))
    joints = np.arange(JOINTS)

    def spread(columns: NDArray[np.int64], factor: Array) -> None:
        state[:, :, columns] += np.swapaxes(by_state * factor[..., None], 1, 2)
        force[:, :, columns] += np.swapaxes(by_coefficients * factor[..., None], 1, 2)

    spread(joints, 2 * muscle)
    for k, spring in enumerate(_springs(evaluator, values), start=1):
        columns = k * JOINTS + joints
        spread(columns, 2 * preferences * spring.value)
        state[:, 6 + joints, columns] += 2 * preferences * muscle * spring.by_angle
        state[:, COUNT + 6 + joints, columns] += 2 * preferences * muscle * spring.by_rate
    _mix_shoes(problem, values, coefficients, state, force)
    return state, force


def _mix_shoes(
    problem: SpacetimeProblem, values: Values, coefficients: Array, state: Array, force: Array
) -> None:
    """Fill in the shoes' columns, by central differences of the gradient of E."""
    vector = problem.style.vector()
    for column, step in zip((SIZE - 2, SIZE - 1), SHOE_STEPS, strict=True):
        ends = []
        for sign in (1.0, -1.0):
            moved = vector.copy()
            moved[column] += sign * step
            ends.append(_gradient(problem, moved, values, coefficients))
        state[:, :, column] = (ends[0][0] - ends[1][0]) / (2 * step)
        force[:, :, column] = (ends[0][1] - ends[1][1]) / (2 * step)


def _gradient(
    problem: SpacetimeProblem, vector: Array, values: Values, coefficients: Array
) -> tuple[Array, Array]:
    """Return ∂E/∂u (F, 105) and ∂E/∂λ (F, 32) at a motion, for another θ."""
    evaluator = Evaluator(replace(problem, style=problem.style.with_vector(vector)))
    moved = evaluator.at(values.coordinates, values.rates, values.accelerations, coefficients)
    slopes = evaluator.slopes(moved)
    doubled = 2 * moved.residuals
    return (
        np.einsum("frx,fr->fx", slopes.by_state, doubled),
        np.einsum("frx,fr->fx", slopes.by_coefficients, doubled),
    )


def joint_response(
    problem: SpacetimeProblem, found: InteriorPointResult, chain: Array
) -> tuple[Array, Array]:
    """Return how an optimum's joint angles (F·29, 147), rad, and control points (K·35, 147) move.

    Parameters
    ----------
    found : the optimum. chain : ∂θ/∂y of the coordinates y that are moved, (147, 147).
    """
    mixed = mixed_derivatives(problem, found.values, found.coefficients)
    controls = OptimumHessian.at(Evaluator(problem), found).sensitivity(*mixed).controls @ chain
    basis = problem.basis()
    moved = basis.evaluate(controls.reshape(basis.controls, -1))[0]
    moved = moved.reshape(problem.frames, COUNT, SIZE)[:, JOINT_COORDINATES]
    return moved.reshape(-1, SIZE), controls
