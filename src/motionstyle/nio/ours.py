"""Our learner of a style: Gauss–Newton on the motion itself, along a shrinking pull towards X_T.

The paper descends G alone, each step from an X_S that may lie anywhere. Here θ is moved so that X_S
comes to X_T: an optimum's derivative by θ is known exactly (`spacetime.sensitivity`), so

    min over θ:  rms²(X_S(θ) − X_T)  +  w_G G/E(X_T)  +  w_0 |y − y_0|²     (degrees², y scaled θ)

is a least-squares problem. At first X_S is also pulled towards X_T (closeness κ): close to X_T the
optimum is unique, easily found and nearly linear in θ. κ falls to 0 in stages, each starting from
the last one's θ; only κ = 0 is NIO's own problem. G keeps θ from making X_T's torques small instead
of optimal. Springs are gentler (gain 60/rad) in these stages. κ is counted in the clip's own
E(X_T) a frame, which is seven times as large for a run as for a walk.

Close to X_T the solver may follow an optimum that is not the lowest. So rounds follow, on the
problem itself: a solve from X_T goes its own way, and where it ends lower than what was followed
(a counterexample to θ), θ is moved on from there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import lsq_linear

from motionstyle.body.layout import JOINT_COORDINATES
from motionstyle.dynamics.passive import SIGMOID_GAIN
from motionstyle.nio.derivatives import SIZE, energy_by_style, joint_response
from motionstyle.nio.inner import (
    Inner,
    InnerSettings,
    Learnt,
    inner_solve,
    learning_row,
    learnt,
)
from motionstyle.nio.learning_problem import Cost, LearningProblem, target_cost
from motionstyle.nio.style_space import StyleSpace
from motionstyle.spacetime.continuation import solve_spacetime
from motionstyle.spacetime.solver_point import SolverSettings
from motionstyle.spacetime.spacetime_problem import COUNT
from motionstyle.spacetime.style import Style

Array = NDArray[np.float64]
LEAST_GAP = 1e-6  # of G/E, below which its root has no useful slope
MOST_REFUSALS = 4  # in a row, then a stage ends
LEAST_PUSH_N = 1.0  # of a shoe, to be one that pushes
NEGATIVE_GAP = 1e-3  # of E: a "minimum" that much above X_T is none


@dataclass(frozen=True)
class Stage:
    """κ, how many steps of θ at most, and the springs' gain per rad.

    closeness : κ in E(X_T; θ of the start) a frame and rad², so that all clips are pulled alike.
    """

    closeness: float
    steps: int
    gain: float


@dataclass(frozen=True)
class OurSettings:
    """Settings of the learner, `config/nio.yaml`.

    Attributes
    ----------
    stages : in order. gap_weight : w_G, deg². prior_weight : w_0, deg² per squared unit of y.
    least_preference, largest_preference : bounds of 29 α.
    longest_step : of one coordinate of y. farthest_deg : by which no joint angle may be predicted
        to move in one step.
    iterations, tolerance, barrier : of inner solves; a step whose solve ends above `usable` is
        refused.
    damping : of the normal equations, relative. least_gain : of the objective, below which a stage
        ends.
    rounds, round_steps, round_gain : of solves from X_T that go their own way, steps after each,
        and the springs' gain in them. final_steps : at the paper's gain.
    """

    stages: Sequence[Stage]
    gap_weight: float
    prior_weight: float
    least_preference: float
    largest_preference: float
    longest_step: float
    farthest_deg: float
    iterations: int
    tolerance: float
    barrier: float
    usable: float
    damping: float
    least_gain: float
    rounds: int = 0
    round_steps: int = 0
    round_gain: float = SIGMOID_GAIN
    final_steps: int = 0


@dataclass(frozen=True)
class _State:
    """θ with its X_S, and the residuals of the least-squares problem there."""

    place: Array
    style: Style
    inner: Inner
    target: Cost
    residuals: Array

    @property
    def objective(self) -> float:
        return float((self.residuals**2).sum())


class _Learner:
    """One run: what does not change between its steps."""

    def __init__(self, learning: LearningProblem, settings: OurSettings) -> None:
        self.learning = learning
        self.settings = settings
        space = StyleSpace.of(
            learning.ranges, settings.least_preference, settings.largest_preference
        )
        self.space = space.keeping_shoes(learning.start) if shoe_in_flight(learning) else space
        self.unit = target_cost(learning, learning.start).total / learning.target.frames
        self.origin = self.space.coordinates(learning.start)
        joints = COUNT - JOINT_COORDINATES.start
        self.degrees = np.degrees(1.0) / np.sqrt(learning.target.frames * joints)

    def state(
        self, place: Array, stage: Stage, controls: Array | None, before: Inner | None
    ) -> _State:
        """Return the state at y, its X_S found from control points near it."""
        settings = self.settings
        style = self.space.style(place, self.learning.start)
        inner = inner_solve(
            self.learning,
            style,
            InnerSettings(
                stage.closeness * self.unit, stage.gain, settings.iterations,
                settings.tolerance, settings.barrier,
            ),
            controls,
            None if before is None else before.result.point,
        )  # fmt: skip
        target = target_cost(self.learning, style, stage.gain)
        away = inner.cost.values.coordinates - self.learning.coordinates
        parts = [
            self.degrees * away[:, JOINT_COORDINATES].ravel(),
            np.sqrt(settings.prior_weight) * (place - self.origin),
            [np.sqrt(settings.gap_weight * self._gap(inner, target))],
        ]
        return _State(place, style, inner, target, np.concatenate(parts))

    @staticmethod
    def _gap(inner: Inner, target: Cost) -> float:
        return max((target.total - inner.cost.total) / target.total, LEAST_GAP)

    def usable(self, state: _State) -> bool:
        """Tell whether a state's X_S is near enough to an optimum to be judged."""
        enough = state.inner.result.optimality <= self.settings.usable
        gap = state.target.total - state.inner.cost.total
        return bool(enough and gap >= -NEGATIVE_GAP * state.target.total)

    def linearised(self, state: _State) -> tuple[Array, Array]:
        """Return the Jacobian of the residuals by y, and of the control points, (K·35, 147)."""
        inner, chain = state.inner, self.space.chain(state.style)
        values, problem = inner.result.values, inner.problem
        moved, controls = joint_response(problem, inner.result, chain)
        at_target = energy_by_style(problem, state.target.values)
        at_synth = energy_by_style(problem, values)
        total, gap = state.target.total, state.target.total - inner.cost.total
        by_style = (at_target - at_synth) / total - gap * at_target / total**2
        root = np.sqrt(self.settings.gap_weight * self._gap(inner, state.target))
        rows = [
            self.degrees * moved,
            np.sqrt(self.settings.prior_weight) * np.eye(SIZE),
            (0.5 * self.settings.gap_weight / root * (by_style @ chain))[None],
        ]
        return np.concatenate(rows), controls

    def step(self, state: _State, jacobian: Array, trust: float) -> Array:
        """Return the step of y that the linearised problem asks for, in its bounds.

        trust : share of the longest step, of each coordinate of y.
        """
        normal = jacobian.T @ jacobian
        pull = jacobian.T @ state.residuals
        normal[np.diag_indices(SIZE)] += self.settings.damping * np.trace(normal) / SIZE
        root = cholesky(normal)
        wanted = solve_triangular(root, -pull, trans=1)
        low, high = self.space.room(state.place)
        longest = trust * self.settings.longest_step
        low = np.minimum(np.maximum(low, -longest), -1e-12)
        high = np.maximum(np.minimum(high, longest), 1e-12)
        found = lsq_linear(root, wanted, bounds=(low, high)).x
        count = len(state.residuals) - SIZE - 1
        farthest = np.abs(jacobian[:count] @ found).max() / self.degrees
        farthest_deg = float(np.degrees(farthest))
        return found * min(1.0, self.settings.farthest_deg / max(farthest_deg, 1e-12))


def shoe_in_flight(learning: LearningProblem) -> bool:
    """Tell whether a shoe pushes on X_T while no foot point is held.

    Nothing can balance another shoe's force there: X_T obeys Newton with the shoes it was projected
    with and no others, and a tenth of a millimetre of h̄ puts newtons into its root residual.
    """
    flight = ~learning.feet.held.any(axis=1)
    pushes = target_cost(learning, learning.start).values.shoe_forces[flight]
    return bool(np.linalg.norm(pushes.sum(axis=1), axis=-1).max(initial=0.0) > LEAST_PUSH_N)


def learn(
    learning: LearningProblem,
    settings: OurSettings,
    log: Callable[[str], None] = print,
) -> Learnt:
    """Return the style learnt from X_T by our algorithm.

    Rows hold every step tried; `accepted` tells which were taken. The style returned is the last
    stage's best.
    """
    learner = _Learner(learning, settings)
    began = perf_counter()
    rows: list[dict[str, Any]] = []
    state: _State | None = None
    place, trust = learner.origin, 1.0

    def record(found: _State, stage: Stage, accepted: bool) -> None:
        row = learning_row(learning, found.style, found.target, found.inner)
        row |= {"iteration": len(rows), "closeness": stage.closeness, "gain": stage.gain}
        row |= {"accepted": accepted, "objective": found.objective}
        rows.append(row | {"seconds": perf_counter() - began})
        log(
            f"{len(rows) - 1:3d} κ {stage.closeness:g} gain {stage.gain:g}: objective "
            f"{found.objective:.3f}, {row['joint_error_deg']:.2f}°, G/E "
            f"{row['G_over_E_target']:.3f}, E {row['E_target']:.0f}, {row['inner_iterations']} its "
            f"{row['status']}{'' if accepted else ', refused'}, {rows[-1]['seconds']:.0f} s"
        )

    for stage in settings.stages:
        before = None if state is None else state.inner
        state = learner.state(place, stage, None, before)
        if not learner.usable(state):
            # From a neighbour it failed: X_T itself is the safest start there is.
            state = learner.state(place, stage, learning.controls, None)
        record(state, stage, True)
        state, trust = _stage(learner, state, stage, trust, record)
        place = state.place
    if state is None:
        raise ValueError("the learner needs at least one stage")
    free = Stage(0.0, settings.round_steps, settings.round_gain)
    for turn in range(settings.rounds):
        found = _from_target(learner, state, free)
        lower = found.inner.cost.total < (1 - NEGATIVE_GAP) * state.inner.cost.total
        if turn == 0 or lower:
            record(found, free, True)
            state, trust = found, 1.0
        before = state.objective
        state, trust = _stage(learner, state, free, trust, record)
        if not lower and state.objective > (1 - settings.least_gain) * before:
            break
    final = Stage(0.0, settings.final_steps, SIGMOID_GAIN)
    found = learner.state(state.place, final, None, state.inner)
    if not learner.usable(found):
        found = _from_target(learner, state, final)
    record(found, final, True)
    state, trust = _stage(learner, found, final, trust, record)
    return learnt(learning, "ours", state.style, state.inner, rows)


def _from_target(learner: _Learner, state: _State, stage: Stage) -> _State:
    """Return the state at the same θ whose X_S a solve from X_T finds by itself."""
    learning = learner.learning
    problem = learning.problem(state.style, gain=stage.gain)
    solved = solve_spacetime(
        problem, learning.controls, settings=SolverSettings(tolerance=learner.settings.tolerance)
    )
    return learner.state(state.place, stage, None, replace(state.inner, result=solved))


def _stage(
    learner: _Learner,
    state: _State,
    stage: Stage,
    trust: float,
    record: Callable[[_State, Stage, bool], None],
) -> tuple[_State, float]:
    """Return the best state of one stage, and the trust to go on with."""
    jacobian, controls = learner.linearised(state)
    refused = 0
    for _ in range(stage.steps):
        step = learner.step(state, jacobian, trust)
        moved = state.inner.result.point.controls + (controls @ step).reshape(-1, COUNT)
        found = learner.state(state.place + step, stage, moved, state.inner)
        better = learner.usable(found) and found.objective < state.objective
        record(found, stage, better)
        if not better:
            trust, refused = 0.3 * trust, refused + 1
            if refused == MOST_REFUSALS:
                break
            continue
        gained = 1 - found.objective / state.objective
        trust, refused, state = min(1.0, 1.5 * trust), 0, found
        if gained < learner.settings.least_gain:
            break
        jacobian, controls = learner.linearised(state)
    return state, min(1.0, 2 * trust)
