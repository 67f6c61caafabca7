"""Problems whose optima are known in closed form, for the spacetime solver.

- `free_fall`: the real body, thrown, touching nothing, without springs. Nothing need be done:
  E = 0, on the parabola that it was thrown on.
- `flight_with_springs`: the same with springs and dampers that rest in the pose it is thrown in.
- `sliding_mass`: a mass moved from rest to rest, min Σu² of u = m ẍ: x = d (3s² − 2s³), s = t/T.
- `mass_on_spring`: the same with a spring and a damper, u = m ẍ + c ẋ + k x: x is a sum of the
  exponentials of (m r² + c r + k)(m r² − c r + k) = 0.

Ends are kept (place, speed and acceleration, those of the optimum); in between solves start from
smooth noise. The mass slides by the dynamics of `sliding_masses`; the solver is the real one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.body import Body
from motionstyle.body.kinematics import contact_points, forward_kinematics
from motionstyle.body.layout import COORDINATE_INDEX
from motionstyle.dynamics.codegen import FrameFunction, load_functions
from motionstyle.dynamics.inverse import GRAVITY
from motionstyle.dynamics.passive import PassiveParameters
from motionstyle.evaluation.spacetime.sliding_masses import sliding_mass_functions
from motionstyle.motion.resample import lowpass
from motionstyle.spacetime.continuation import solve_spacetime
from motionstyle.spacetime.foot_constraints import FootConstraints
from motionstyle.spacetime.solver_point import SolverSettings
from motionstyle.spacetime.spacetime_problem import COUNT, POINTS, Evaluator, SpacetimeProblem
from motionstyle.spacetime.style import JOINTS_29, Style

Array = NDArray[np.float64]
KEPT = 3
# One second each. Flights at the paper's rate; the mass finer, because at 30 Hz the splines alone
# cost 0.15 % of E on the spring. The number of intervals is even, see `_sliding`.
FLIGHT_HZ, RAIL_HZ = 30.0, 60.0
MASS_KG, DISTANCE_M = 2.0, 1.0
SPRING, DAMPER = 20.0, 3.0  # N/m, N s/m
NOISE_HZ, NOISE_M, NOISE_RAD = 1.5, 0.02, np.radians(10.0)
RAIL = COORDINATE_INDEX["elbow_flexion_r"]
COLUMNS = (
    *("config", "problem", "frames", "rate_hz", "status", "E_analytic", "E_solver", "E_start"),
    *("objective_error_pct", "relative_to", "largest_error", "largest_error_unit", "optimality"),
    *("iterations", "seconds"),
)


@dataclass(frozen=True)
class KnownOptimum:
    """A problem with its optimum.

    coordinates : of the optimum, (F, 35). energy : E there. noise : standard deviation that the
    start is away by, (35,). watched : coordinates that are compared, in `unit`.
    """

    name: str
    problem: SpacetimeProblem
    coordinates: Array
    energy: float
    noise: Array
    watched: slice
    unit: str


def known_optima(body: Body, functions: Mapping[str, FrameFunction]) -> list[KnownOptimum]:
    """Return all problems; those of the real body for this body with these functions."""
    rails = load_functions(sliding_mass_functions(MASS_KG), None)
    return [
        _flight("free_fall", body, functions, 0.0, 0.0),
        _flight("flight_with_springs", body, functions, 30.0, 1.0),
        _sliding("sliding_mass", body, rails, 0.0, 0.0),
        _sliding("mass_on_spring", body, rails, SPRING, DAMPER),
    ]


def known_optimum_row(
    known: KnownOptimum,
    seed: int,
    settings: SolverSettings | None = None,
    log: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Solve a problem from smooth noise; return its row of `tables/known_optima.csv`.

    `objective_error_pct` is relative to the analytic E, or where that is 0 to E at the start.
    """
    problem, basis, frames = known.problem, known.problem.basis(), known.problem.frames
    noise = np.random.default_rng(seed).standard_normal((frames, COUNT))
    noise = lowpass(noise, problem.rate_hz, NOISE_HZ)
    noise *= np.sin(np.linspace(0, np.pi, frames))[:, None] ** 2  # none at the ends
    noise *= known.noise / np.sqrt((noise**2).mean(axis=0))
    ends = basis.fit(known.coordinates)
    controls = ends + basis.fit(noise)
    controls[:KEPT], controls[-KEPT:] = ends[:KEPT], ends[-KEPT:]
    evaluator = Evaluator(problem)
    start = evaluator.values(controls, np.zeros((frames, 4 * POINTS))).energy
    found = solve_spacetime(problem, controls, settings=settings, log=log)
    energy = found.values.energy
    scale = known.energy or start
    away = np.abs(found.values.coordinates - known.coordinates)[:, known.watched]
    return {
        "problem": known.name,
        "frames": frames,
        "rate_hz": problem.rate_hz,
        "status": found.status,
        "E_analytic": known.energy,
        "E_solver": energy,
        "E_start": start,
        "objective_error_pct": 100 * (energy - known.energy) / scale,
        "relative_to": "E_analytic" if known.energy else "E_start",
        "largest_error": float(away.max()),
        "largest_error_unit": known.unit,
        "optimality": found.optimality,
        "iterations": found.iterations,
        "seconds": found.seconds,
    }


def _no_contact(points: Array) -> FootConstraints:
    """Return feet (F, 8, 3) that touch nothing, far above the ground."""
    shape = points.shape[:2]
    return FootConstraints(
        held=np.zeros(shape, dtype=bool),
        sliding=np.zeros(shape, dtype=bool),
        targets=points,
        ground=points - [0.0, 5.0, 0.0],
        normals=np.tile([0.0, 1.0, 0.0], (*shape, 1)),
        clearance=np.zeros(shape),
        friction=np.full(shape, 0.8),
    )


def _problem(
    body: Body,
    functions: Mapping[str, FrameFunction],
    rate_hz: float,
    points: Array,
    stiffness: float,
    damping: float,
    rest: Array,
) -> SpacetimeProblem:
    count = len(JOINTS_29)
    springs = (np.full(count, value) for value in (stiffness, stiffness, damping))
    style = Style(np.full(count, 1 / count), PassiveParameters(*springs, rest))
    free = np.full((COUNT, 2), (-np.inf, np.inf))
    return SpacetimeProblem(
        body, rate_hz, _no_contact(points), free, style, dict(functions), keep_ends=KEPT
    )


def _flight(
    name: str,
    body: Body,
    functions: Mapping[str, FrameFunction],
    stiffness: float,
    damping: float,
) -> KnownOptimum:
    """Return a body thrown forward and up, its arms and knees bent, not turning."""
    t = np.arange(round(FLIGHT_HZ) + 1) / FLIGHT_HZ
    q = np.zeros((len(t), COUNT))
    q[:, 0], q[:, 1] = 1.2 * t, 2.0 + 3.0 * t - GRAVITY / 2 * t**2
    for joint, degrees in (("elbow_flexion", 40), ("knee_flexion", 30), ("shoulder_flexion", 20)):
        for side in "rl":
            q[:, COORDINATE_INDEX[f"{joint}_{side}"]] = np.radians(degrees)
    points = contact_points(body, forward_kinematics(body, q))
    problem = _problem(body, functions, FLIGHT_HZ, points, stiffness, damping, q[0, 6:].copy())
    noise = np.full(COUNT, NOISE_RAD)
    noise[:3] = NOISE_M
    return KnownOptimum(name, problem, q, 0.0, noise, slice(3, None), "rad")


def _sliding(
    name: str, body: Body, functions: Mapping[str, FrameFunction], spring: float, damper: float
) -> KnownOptimum:
    """Return the mass on its rail; all other masses rest where their springs do.

    Without spring the cubic is the optimum of the sum over frames too: its force is linear in
    time, and with knots at frames the trapezoidal sum of a linear force times what splines can do
    between kept ends is exact.
    """
    t = np.arange(round(RAIL_HZ) + 1) / RAIL_HZ
    x, force = _rest_to_rest(t, spring, damper)
    q = np.zeros((len(t), COUNT))
    q[:, RAIL] = x
    points, rest = np.zeros((len(t), POINTS, 3)), np.zeros(len(JOINTS_29))
    problem = _problem(body, functions, RAIL_HZ, points, spring, damper, rest)
    noise = np.zeros(COUNT)
    noise[RAIL] = NOISE_M
    energy = float((force**2).sum()) / len(JOINTS_29)
    return KnownOptimum(name, problem, q, energy, noise, slice(RAIL, RAIL + 1), "m")


def _rest_to_rest(t: Array, spring: float, damper: float) -> tuple[Array, Array]:
    """Return x (m) and u = m ẍ + c ẋ + k x (N) of least ∫u² from rest at 0 to rest at d.

    Both spring and damper, or neither: undamped roots are double ones.
    """
    if spring == damper == 0:
        s, span = t / t[-1], t[-1]
        x = DISTANCE_M * (3 * s**2 - 2 * s**3)
        return x, MASS_KG * DISTANCE_M * (6 - 12 * s) / span**2
    roots = np.concatenate(
        [np.roots([MASS_KG, damper, spring]), np.roots([MASS_KG, -damper, spring])]
    )
    ends = np.array([0.0, t[-1]])
    conditions = np.concatenate(
        [np.exp(np.outer(ends, roots)), roots * np.exp(np.outer(ends, roots))]
    )
    shares = np.linalg.solve(conditions, [0.0, DISTANCE_M, 0.0, 0.0])
    modes = np.exp(np.outer(t, roots))
    x, v, a = (np.real(modes @ (shares * roots**k)) for k in range(3))
    return x, MASS_KG * a + damper * v + spring * x
