"""The values an interior-point method works on: settings, point, errors, trace, result."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from motionstyle.spacetime.spacetime_problem import Values

Array = NDArray[np.float64]
FORCE_UNIT = 100.0  # N; coefficients are scaled by it


@dataclass(frozen=True)
class SolverSettings:
    """Tolerances and limits of the solver.

    Attributes
    ----------
    tolerance : of the scaled optimality error, Wächter & Biegler eq. (5).
    iterations : after which the solver gives up, and says so. seconds : the same for emergencies,
        since what it cuts depends on the machine.
    barrier : first μ. It is lowered to min(barrier_shrink·μ, μ^barrier_power) whenever the error
        of the barrier problem is below barrier_gate·μ.
    pace : end as `slow` when E falls by less than this share in ten iterations; 0 is never.
    whole_steps : let λ that would turn negative stop short one by one and settle slacks in closed
        form, which gets along from poor starts; else the whole step stops short, which keeps
        primal and dual unknowns in step and converges faster.
    corrections : second-order ones a step may have. loose, wild : nonlinearity of a step above
        which it is corrected, and δ is raised.
    """

    tolerance: float = 1e-6
    iterations: int = 500
    seconds: float = 900.0
    barrier: float = 1e-1
    barrier_shrink: float = 0.2
    barrier_power: float = 1.5
    barrier_gate: float = 10.0
    pace: float = 0.0
    whole_steps: bool = False
    corrections: int = 3
    loose: float = 0.1
    wild: float = 1.0


@dataclass(frozen=True)
class Point:
    """All unknowns at one moment; a step between two points has the same parts.

    Attributes
    ----------
    controls : control points, (K, 35). coefficients : λ/100 N, (F, 32).
    lift, foot_lift : the copies z of residuals (F, 35) and foot residuals (F, 24).
    multiplier, foot_multiplier : of r(x) = z, equal to z after a full step.
    elastic, slack : p and s of the inequalities g + p = s, s ≥ 0, (F, R).
    dual, row_dual : of λ ≥ 0 and s ≥ 0.
    """

    controls: Array
    coefficients: Array
    lift: Array
    foot_lift: Array
    multiplier: Array
    foot_multiplier: Array
    elastic: Array
    slack: Array
    dual: Array
    row_dual: Array

    def moved(self, step: Point, primal: float, dual: float) -> Point:
        """Return the point after a step of length `dual` for duals and `primal` for the rest."""
        lengths = {"dual": dual, "row_dual": dual}
        return Point(
            **{
                name: getattr(self, name) + lengths.get(name, primal) * getattr(step, name)
                for name in self.__dataclass_fields__
            }
        )


@dataclass(frozen=True)
class Excess:
    """Errors of the constraints: r − z, foot residuals − copies, g + p − s."""

    residuals: Array
    feet: Array
    rows: Array

    def plus(self, other: Excess, times: float = 1.0) -> Excess:
        """Return the sum of two errors, the other a number of times."""
        return Excess(
            self.residuals + times * other.residuals,
            self.feet + times * other.feet,
            self.rows + times * other.rows,
        )

    def energy(self) -> float:
        """Return half the squares of the errors of residuals and feet."""
        return 0.5 * float((self.residuals**2).sum() + (self.feet**2).sum())

    def total(self) -> float:
        """Return θ, the sum of all magnitudes."""
        parts = (self.residuals, self.feet, self.rows)
        return float(sum(np.abs(part).sum() for part in parts))


@dataclass(frozen=True)
class Trace:
    """One iteration as recorded.

    Attributes
    ----------
    seconds : since the start. energy : E of eq. (13). objective : φ. infeasibility : θ.
    optimality : scaled error at μ = 0. barrier : μ.
    step, regularisation : length α and δ of the step that led here, 0 at the start.
    nonlinearity : ½‖errors‖² after the step by what it was to gain; δ follows it.
    """

    iteration: int
    seconds: float
    energy: float
    objective: float
    infeasibility: float
    optimality: float
    barrier: float
    step: float
    regularisation: float
    nonlinearity: float = 0.0

    def __str__(self) -> str:
        return (
            f"{self.iteration:4d} E {self.energy:12.5f} θ {self.infeasibility:9.2e} "
            f"opt {self.optimality:9.2e} μ {self.barrier:8.1e} α {self.step:7.1e} "
            f"δ {self.regularisation:7.1e} q {self.nonlinearity:7.1e}"
        )


@dataclass(frozen=True)
class InteriorPointResult:
    """What the solver ends with.

    Attributes
    ----------
    status : `converged`, or why not: `iteration limit`, `time limit`, `no step found`,
        `not a number`, `slow` (only where a pace is asked for).
    point, values : where it ended. optimality : scaled error there.
    iterations, seconds : spent. trace : one entry for the start and one for every iteration.
    """

    status: str
    point: Point
    values: Values
    optimality: float
    iterations: int
    seconds: float
    trace: list[Trace] = field(default_factory=list)

    @property
    def coefficients(self) -> Array:
        """λ in N, (F, 32)."""
        return self.point.coefficients * FORCE_UNIT
