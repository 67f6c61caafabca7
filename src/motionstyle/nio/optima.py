"""Residuals of our learner: how far the optima of a style lie from X_T, and their derivatives.

    min over θ:  mean over optima of rms²(X_k(θ) − X_T)  +  w_G G/E(X_T)  +  w_0 |y − y_0|²

in degrees², y being scaled θ. An optimum's derivative by θ is known exactly
(`spacetime.sensitivity`), so that this is a nonlinear least-squares problem.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import lsq_linear

from motionstyle.body.layout import JOINT_COORDINATES
from motionstyle.nio.derivatives import SIZE, energy_by_style, joint_response
from motionstyle.nio.inner import Inner, InnerSettings, inner_solve
from motionstyle.nio.learning_problem import Cost, LearningProblem, target_cost
from motionstyle.nio.style_space import StyleSpace
from motionstyle.spacetime.solver_point import InteriorPointResult
from motionstyle.spacetime.spacetime_problem import COUNT
from motionstyle.spacetime.style import Style

Array = NDArray[np.float64]
LEAST_GAP = 1e-6  # of G/E, below which its root has no useful slope
SHOE_CHANGE_M, SHOE_CHANGE = 1e-3, 1.5  # of h̄, and the factor of k_shoe, that X_T must bear
UNBALANCED = 0.1  # of E(X_T), what its root may rise by for that
NEGATIVE_GAP = 1e-3  # of E: a "minimum" that much above X_T is none


@dataclass(frozen=True)
class Stage:
    """κ, how many steps of θ at most, and the springs' gain per rad.

    closeness : κ in E(X_T; θ of the start) a frame and rad², so that all clips are pulled alike: a
        run's E is seven times a walk's.
    """

    closeness: float
    steps: int
    gain: float


@dataclass(frozen=True)
class OurSettings:
    """Settings of the learner, `config/nio.yaml`.

    Attributes
    ----------
    stages : in order. most_between : stages that may be put between two where X_S jumps.
    gap_weight : w_G, deg². prior_weight : w_0, deg² per squared unit of y.
    least_preference, largest_preference : bounds of 29 α.
    longest_step : of one coordinate of y. farthest_deg : by which no joint angle may be predicted
        to move in one step.
    iterations, tolerance, barrier : of inner solves; a step whose solve ends above `usable` is
        refused.
    damping : of the normal equations, relative. least_gain : of the objective, below which a stage
        ends; of a step that may be half as long, half.
    rounds, round_steps, round_gain : of solves that go their own way, steps after each, and the
        springs' gain in them. most_optima : known of one θ at once. new_deg : how far from all
        others an optimum counts as another one. final_steps : at the paper's gain.
    stages_work, rounds_work, most_work : frames times iterations of inner solves, after which
        stages have no more steps, rounds have none, and nothing has.
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
    most_between: int
    stages_work: int
    rounds_work: int
    most_work: int
    rounds: int
    round_steps: int
    round_gain: float
    most_optima: int
    new_deg: float
    final_steps: int


@dataclass(frozen=True)
class State:
    """θ with the optima known of it, and the residuals of the least-squares problem there.

    inners : one solve for each optimum, the one that was followed from X_T's neighbourhood first.
    """

    place: Array
    style: Style
    inners: tuple[Inner, ...]
    target: Cost
    residuals: Array

    @property
    def objective(self) -> float:
        """What is minimised, degrees²."""
        return float((self.residuals**2).sum())

    @property
    def lowest(self) -> Inner:
        """The optimum of least cost, to the best of our knowledge X_S."""
        return lowest_of(self.inners)


def lowest_of(inners: Sequence[Inner]) -> Inner:
    """Return the optimum of least cost."""
    return min(inners, key=lambda inner: inner.cost.total)


class Learner:
    """One run: what does not change between its steps, and the work that was done.

    work : frames times iterations of all inner solves, which tells time on any machine.
    """

    def __init__(self, learning: LearningProblem, settings: OurSettings) -> None:
        self.learning = learning
        self.settings = settings
        space = StyleSpace.of(
            learning.ranges, settings.least_preference, settings.largest_preference
        )
        self.space = space.keeping_shoes(learning.start) if shoes_unbalanced(learning) else space
        self.unit = target_cost(learning, learning.start).total / learning.target.frames
        self.origin = self.space.coordinates(learning.start)
        joints = COUNT - JOINT_COORDINATES.start
        self.degrees = np.degrees(1.0) / np.sqrt(learning.target.frames * joints)
        self.work = 0

    def count(self, result: InteriorPointResult) -> None:
        """Add a solve to the work that was done."""
        self.work += result.iterations * self.learning.target.frames

    def spent(self, stage: Stage) -> bool:
        """Tell whether a stage shall have no more steps, since the work was too much."""
        settings = self.settings
        if stage.closeness:
            return self.work >= settings.stages_work
        in_rounds = stage.gain == settings.round_gain
        return self.work >= (settings.rounds_work if in_rounds else settings.most_work)

    def state(
        self,
        place: Array,
        stage: Stage,
        starts: Sequence[tuple[Array | None, InteriorPointResult | None]],
    ) -> State:
        """Return the state at y, an optimum found from each start.

        starts : control points (X_T's or the neighbour's if None), and a neighbouring optimum.
        """
        settings = self.settings
        style = self.space.style(place, self.learning.start)
        how = InnerSettings(
            stage.closeness * self.unit, stage.gain, settings.iterations, settings.tolerance,
            settings.barrier,
        )  # fmt: skip
        inners = []
        for controls, before in starts:
            known = before is not None and before.status == "converged"
            # While X_S is pulled, a solve that keeps them stays with optima that are about to go.
            whole = known and not stage.closeness
            inner = inner_solve(
                self.learning, style, replace(how, whole=whole), controls, before and before.point
            )
            self.count(inner.result)
            inners.append(inner)
        return self.judged(place, style, stage, inners)

    def judged(self, place: Array, style: Style, stage: Stage, inners: Sequence[Inner]) -> State:
        """Return the state at y with its residuals, of optima that are known."""
        settings = self.settings
        target = target_cost(self.learning, style, stage.gain)
        share = self._share(len(inners))
        away = [inner.cost.values.coordinates - self.learning.coordinates for inner in inners]
        lowest = lowest_of(inners)
        parts = [
            *(share * one[:, JOINT_COORDINATES].ravel() for one in away),
            np.sqrt(settings.prior_weight) * (place - self.origin),
            [np.sqrt(settings.gap_weight * self._gap(lowest, target))],
        ]
        return State(place, style, tuple(inners), target, np.concatenate(parts))

    def _share(self, optima: int) -> float:
        """Return what makes one optimum's joint errors (rad) residuals of the mean, degrees."""
        return float(self.degrees / np.sqrt(optima))

    @staticmethod
    def _gap(inner: Inner, target: Cost) -> float:
        return max((target.total - inner.cost.total) / target.total, LEAST_GAP)

    def near_optimum(self, inner: Inner) -> bool:
        """Tell whether a solve ended near enough to an optimum to be judged."""
        return inner.result.optimality <= self.settings.usable

    def usable(self, state: State) -> bool:
        """Tell whether all of a state's motions are near enough to optima to be judged."""
        enough = all(self.near_optimum(inner) for inner in state.inners)
        gap = state.target.total - state.inners[0].cost.total
        return bool(enough and gap >= -NEGATIVE_GAP * state.target.total)

    def linearised(self, state: State) -> tuple[Array, list[Array]]:
        """Return the Jacobian of the residuals by y, and of the optima's control points.

        The latter (K·35, 147), one for each optimum.
        """
        chain, lowest = self.space.chain(state.style), state.lowest
        moved = [joint_response(inner.problem, inner.result, chain) for inner in state.inners]
        at_target = energy_by_style(lowest.problem, state.target.values)
        at_synth = energy_by_style(lowest.problem, lowest.result.values)
        total, gap = state.target.total, state.target.total - lowest.cost.total
        by_style = (at_target - at_synth) / total - gap * at_target / total**2
        root = np.sqrt(self.settings.gap_weight * self._gap(lowest, state.target))
        rows = [
            *(self._share(len(moved)) * by_joints for by_joints, _controls in moved),
            np.sqrt(self.settings.prior_weight) * np.eye(SIZE),
            (0.5 * self.settings.gap_weight / root * (by_style @ chain))[None],
        ]
        return np.concatenate(rows), [controls for _joints, controls in moved]

    def step(self, state: State, jacobian: Array, trust: float) -> tuple[Array, float]:
        """Return the step of y that the linearised problem asks for, and the objective it promises.

        trust : share of the longest step, of each coordinate of y and of joint angles.
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
        share = self._share(len(state.inners))
        farthest_deg = float(np.degrees(np.abs(jacobian[:count] @ found).max() / share))
        found *= min(1.0, trust * self.settings.farthest_deg / max(farthest_deg, 1e-12))
        return found, float(((state.residuals + jacobian @ found) ** 2).sum())


def shoes_unbalanced(learning: LearningProblem) -> bool:
    """Tell whether X_T balances its shoes of the start, but not others.

    X_T obeys Newton with the shoes it was projected with. Where a heel is about to land, or a held
    foot cannot push where the shoe does, a tenth of a millimetre of h̄ puts newtons into the root
    residual, and G/E, being a ratio, has no slope left that would bring θ back. Where the shoes of
    the start are not balanced either (a twin's motion, made with others), they are to be learnt.
    """
    start = learning.start
    cost = target_cost(learning, start)
    others = [
        replace(start, shoe_rest_length=start.shoe_rest_length + SHOE_CHANGE_M),
        replace(start, shoe_rest_length=start.shoe_rest_length - SHOE_CHANGE_M),
        replace(start, shoe_stiffness=SHOE_CHANGE * start.shoe_stiffness),
        replace(start, shoe_stiffness=start.shoe_stiffness / SHOE_CHANGE),
    ]
    roots = [target_cost(learning, other).root for other in others]
    most = UNBALANCED * cost.energy
    return cost.root <= most < max(roots) - cost.root
