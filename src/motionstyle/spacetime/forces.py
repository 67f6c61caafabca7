"""Contact forces in the friction cone, found frame by frame: Liu et al. 2005, eq. (8).

Given the motion, the cone coefficients λ ≥ 0 that leave the least weighted residual are a small
non-negative least-squares problem in each frame; the motion's optimiser sees what is left.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

Array = NDArray[np.float64]


def cone_basis(normals: Array, friction: float) -> Array:
    """Return the four edges of each point's friction cone, (F, P, 4, 3).

    V of eq. (8): n ± μ t1, n ± μ t2 with t1 as far along +x as the plane allows. The pyramid lies
    inside the cone: along its diagonals only μ/√2 is reached.
    """
    ahead = np.broadcast_to([1.0, 0.0, 0.0], normals.shape)
    first = ahead - (ahead * normals).sum(-1, keepdims=True) * normals
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    second = np.cross(first, normals)
    edges = [normals + friction * t for t in (first, -first, second, -second)]
    return np.stack(edges, axis=-2)


@dataclass(frozen=True)
class Eliminated:
    """Best contact forces and what remains.

    coefficients : λ, (F, 4P), N. residuals : weighted, with the forces in, (F, R). weights : the
    curvature (I + A ε⁻¹ Aᵀ)⁻¹ of the remaining cost, (F, R, R), A the columns with λ > 0.
    cost : ½‖residual‖² + ½Σ ε λ² per frame, (F,).
    """

    coefficients: Array
    residuals: Array
    weights: Array
    cost: Array


def eliminate_forces(
    residuals: Array, columns: Array, bearing: NDArray[np.bool_], ridge: Array
) -> Eliminated:
    """Minimise ½‖r + Aλ‖² + ½Σ ε_i λ_i² over λ ≥ 0 in every frame (variable projection).

    Parameters
    ----------
    residuals : weighted, without contact forces, (F, R).
    columns : weighted response to unit coefficients, (F, R, 4P).
    bearing : which points may push, (F, P). ridge : ε > 0 of each coefficient, (F, 4P).
    """
    frames, size = residuals.shape
    count = columns.shape[2]
    coefficients = np.zeros((frames, count))
    left = np.array(residuals)
    weights = np.tile(np.eye(size), (frames, 1, 1))
    for t in range(frames):
        allowed = np.repeat(bearing[t], 4)
        if not allowed.any():
            continue
        a = columns[t][:, allowed]
        price = ridge[t, allowed]
        stacked = np.concatenate([a, np.diag(np.sqrt(price))])
        wanted = np.concatenate([-residuals[t], np.zeros(a.shape[1])])
        found, _ = nnls(stacked, wanted, maxiter=10 * a.shape[1])
        coefficients[t, allowed] = found
        left[t] += a @ found
        active = a[:, found > 0]
        inner = active.T @ active + np.diag(price[found > 0])
        weights[t] -= active @ np.linalg.solve(inner, active.T)
    cost = 0.5 * (left**2).sum(axis=1) + 0.5 * (ridge * coefficients**2).sum(axis=1)
    return Eliminated(coefficients, left, weights, cost)
