"""How an optimum moves with what its problem depends on: the implicit function theorem.

At an optimum X of E(X; θ) the gradient stays 0 as θ changes, so dX/dθ = −H⁻¹ ∂²E/∂X∂θ with the
exact Hessian H of all that is minimised (see `spacetime_problem`). H is factored once, λ eliminated
frame by frame, and serves for any number of right-hand sides. It is the Hessian of the barrier
problem the solver ended with, which at μ of about 1e-7 differs from E's by less than the tolerance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionstyle.spacetime.banded import gather, solve, spread
from motionstyle.spacetime.barrier_problem import BarrierProblem
from motionstyle.spacetime.newton_step import Factor, factorise, newton_blocks
from motionstyle.spacetime.solver_point import FORCE_UNIT, InteriorPointResult
from motionstyle.spacetime.spacetime_problem import Evaluator

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Sensitivity:
    """Derivatives of an optimum by k parameters.

    controls : of the control points, (K·35, k). coefficients : of λ, (F, 32, k), N per unit.
    delta : regularisation that H needed to be positive definite; 0 at a strict minimum.
    """

    controls: Array
    coefficients: Array
    delta: float


@dataclass(frozen=True)
class OptimumHessian:
    """The factored Hessian at an optimum, to be used for several right-hand sides."""

    system: BarrierProblem
    factor: Factor

    @staticmethod
    def at(evaluator: Evaluator, result: InteriorPointResult) -> OptimumHessian:
        """Factor the Hessian at a result of the solver.

        Raises
        ------
        FloatingPointError
            If the point is not finite.
        """
        system, point = BarrierProblem(evaluator), result.point
        values = evaluator.values(point.controls, result.coefficients)
        slopes = evaluator.slopes(values)
        blocks = newton_blocks(system, point, values, slopes, result.trace[-1].barrier)
        return OptimumHessian(system, factorise(system, blocks, 0.0))

    def sensitivity(self, by_state: Array, by_coefficients: Array) -> Sensitivity:
        """Return dX/dθ = −H⁻¹ ∂²E/∂X∂θ.

        Parameters
        ----------
        by_state : ∂²E/∂u∂θ per frame, u = (q, q̇, q̈), (F, 105, k). E is that of eq. (13), Σ α Q²,
            not half of it. by_coefficients : ∂²E/∂λ∂θ, λ in N, (F, 32, k).
        """
        basis, factor = self.system.evaluator.basis, self.factor
        bearing = self.system.bearing[..., None]
        # The solver minimises half of E, with λ in units of 100 N.
        pull = np.where(bearing, 0.5 * FORCE_UNIT * by_coefficients, 0.0)
        eliminated = factor.eliminated
        answer = eliminated.forward(pull)
        right = -gather(basis, 0.5 * by_state - eliminated.half.swapaxes(1, 2) @ answer)
        fixed = self.system.fixed.ravel()
        right[fixed] = 0.0
        moved = solve(factor.factor, right, columns=True)
        moved[fixed] = 0.0
        # Coordinates and parameters count as one another's columns: (K, 35·k) is spread as (K, n).
        state = spread(basis, moved.reshape(basis.controls, -1)).reshape(by_state.shape)
        forces = np.where(bearing, -eliminated.backward(answer + eliminated.half @ state), 0.0)
        return Sensitivity(moved, FORCE_UNIT * forces, factor.delta)


def sensitivity(
    evaluator: Evaluator, result: InteriorPointResult, by_state: Array, by_coefficients: Array
) -> Sensitivity:
    """Return how an optimum moves with k parameters, see `OptimumHessian.sensitivity`."""
    return OptimumHessian.at(evaluator, result).sensitivity(by_state, by_coefficients)
