"""Our learner of a style: Gauss–Newton on the motion itself, along a shrinking pull towards X_T.

The paper descends G alone, each step from an X_S that may lie anywhere. Here θ is moved so that X_S
comes to X_T (`nio.optima`). At first X_S is also pulled towards X_T (closeness κ): close to X_T the
optimum is unique, easily found and nearly linear in θ. κ falls to 0 in stages, each starting from
the last one's θ, with stages between where X_S jumps; only κ = 0 is NIO's own problem. G keeps θ
from making X_T's torques small instead of optimal. Springs are gentler (gain 60/rad) here.

Close to X_T the solver follows an optimum that need not be the only one. So rounds follow, on the
problem itself: a solve goes its own way from X_T, and where it ends elsewhere (a counterexample to
θ), both optima are brought to X_T together from there on. The θ of the round whose optima, that one
included, came closest is the one that is learnt. Work (frames times iterations) is bounded, so that
no clip takes much longer than another.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.dynamics.passive import SIGMOID_GAIN
from motionstyle.motion.difference import joint_rms_deg
from motionstyle.nio.inner import Inner, Learnt, learning_row, learnt
from motionstyle.nio.learning_problem import LearningProblem, cost_of_point
from motionstyle.nio.optima import Learner, OurSettings, Stage, State
from motionstyle.spacetime.continuation import solve_spacetime
from motionstyle.spacetime.solver_point import SolverSettings
from motionstyle.spacetime.spacetime_problem import COUNT

Array = NDArray[np.float64]
# In a row, then a stage ends: each costs several steps that are taken. Without a pull shorter steps
# lead on where long ones do not.
MOST_REFUSALS, MOST_FREE_REFUSALS = 2, 5
# Of what the linear model promised: above, the next step may be longer; below, it is shorter.
GOOD_SHARE, POOR_SHARE, MOST_TRUST = 0.6, 0.25, 8.0
LEAST_TRUST = 0.5  # of a round to begin with: refusals of the last one may have left hardly any
JUMP = 2.0  # of the objective: the pull fell too far at once, X_S went elsewhere
FREE_RATIO = 16.0  # κ = 0 counts as that much less than the last κ where one between is sought


_Record = Callable[[State, Stage, bool], None]
_Rival = Callable[[Learner, State, Stage], Inner | None]


def learn(
    learning: LearningProblem,
    settings: OurSettings,
    log: Callable[[str], None] = print,
) -> Learnt:
    """Return the style learnt from X_T by our algorithm.

    Rows hold every step tried; `accepted` tells which were taken. The style returned is the last
    stage's best.
    """
    learner = Learner(learning, settings)
    began = perf_counter()
    rows: list[dict[str, Any]] = []

    def record(found: State, stage: Stage, accepted: bool) -> None:
        row = learning_row(learning, found.style, found.target, found.lowest)
        row |= {"iteration": len(rows), "closeness": stage.closeness, "gain": stage.gain}
        row |= {"accepted": accepted, "objective": found.objective, "optima": len(found.inners)}
        rows.append(row | {"seconds": perf_counter() - began})
        errors = [
            f"{learning.joint_error_deg(i.cost.values.coordinates):.2f}°" for i in found.inners
        ]
        log(
            f"{len(rows) - 1:3d} κ {stage.closeness:g} gain {stage.gain:g}: objective "
            f"{found.objective:.3f}, {' '.join(errors)}, G/E "
            f"{row['G_over_E_target']:.3f}, E {row['E_target']:.0f}, {row['inner_iterations']} its "
            f"{row['status']}{'' if accepted else ', refused'}, {rows[-1]['seconds']:.0f} s"
        )

    if not settings.stages:
        raise ValueError("the learner needs at least one stage")
    free = Stage(0.0, settings.round_steps, settings.round_gain)
    state, trust = _released(learner, free, record)
    state, trust = _rounds(learner, state, free, trust, record)
    state = _finished(learner, state, trust, record)
    log(f"{learner.work} frames times iterations")
    return learnt(learning, "ours", state.style, state.lowest, rows)


def _released(learner: Learner, free: Stage, record: _Record) -> tuple[State, float]:
    """Return the state at κ = 0, reached through all stages, and the trust to go on with."""
    settings = learner.settings
    stage = settings.stages[0]
    state = learner.state(learner.origin, stage, [(None, None)])
    record(state, stage, True)
    state, trust = _stage(learner, state, stage, 1.0, record)
    for following in [*settings.stages[1:], free]:
        for _ in range(settings.most_between):
            found = _followed(learner, state, following)
            if found.objective <= JUMP * state.objective:
                break
            record(found, following, False)
            stage = _halfway(stage, following)
            found = _followed(learner, state, stage)
            record(found, stage, True)
            state, trust = _stage(learner, found, stage, trust, record)
        else:
            found = _followed(learner, state, following)
        record(found, following, True)
        state, trust = _stage(learner, found, following, trust, record)
        stage = following
    return state, trust


def _rounds(
    learner: Learner, state: State, free: Stage, trust: float, record: _Record
) -> tuple[State, float]:
    """Return the best state of all rounds, and the trust to go on with.

    Every state is held to where a solve of its own leads from X_T: states that look alike from
    close by differ by ten degrees there. Rounds end where neither that solve nor the steps before
    it found anything new, where no optimum of the state is near enough to be learnt from, or where
    the work was too much.
    """
    if not learner.settings.rounds:
        return state, trust
    state, learnable = _held(learner, state, free, record, _rival)
    best = state
    for _ in range(learner.settings.rounds):
        if not learnable or learner.spent(free):
            break
        before = state
        state, trust = _stage(learner, state, free, max(trust, LEAST_TRUST), record)
        state, learnable = _held(learner, state, free, record, _rival)
        if state is before:
            break
        best = min(best, state, key=lambda one: one.objective)
    return best, trust


def _finished(learner: Learner, state: State, trust: float, record: _Record) -> State:
    """Return the state after some steps with the paper's springs, held to its own ways there, too.

    Springs that are steeper have optima of their own, so the last round is theirs. There a solve
    straight from X_T may end elsewhere than one through gentler springs (sad 10.6 and 7.5°).
    """
    final = Stage(0.0, learner.settings.final_steps, SIGMOID_GAIN)
    state = _followed(learner, state, final)
    record(state, final, True)
    for rival in (_rival, _straight_rival):
        if final.steps and not learner.spent(final):
            state, _learnable = _held(learner, state, final, record, rival)
    return _stage(learner, state, final, trust, record)[0]


def _held(
    learner: Learner, state: State, stage: Stage, record: _Record, rival_of: _Rival
) -> tuple[State, bool]:
    """Return the state judged by where a solve of its own leads, too, and whether to learn from it.

    A solve that was cut off tells nothing, and the state stays. Optima of its own that were cut
    off are dropped where there is another one.

    Parameters
    ----------
    rival_of : the solve of its own; None where it finds nothing new.
    """
    rival = rival_of(learner, state, stage)
    if rival is None or not learner.near_optimum(rival):
        return state, learner.usable(state)
    known = [one for one in state.inners if learner.near_optimum(one)]
    first, others = known[:1], known[1:]
    kept = others[max(0, len(others) - learner.settings.most_optima + 2) :]
    held = learner.judged(state.place, state.style, stage, [*first, *kept, rival])
    record(held, stage, True)
    return held, learner.usable(held)


def _halfway(stage: Stage, following: Stage) -> Stage:
    """Return a stage between two, by the logarithm of κ."""
    least = max(following.closeness, stage.closeness / FREE_RATIO)
    return replace(following, closeness=float(np.sqrt(stage.closeness * least)))


def _followed(learner: Learner, state: State, stage: Stage) -> State:
    """Return the state of the same θ in another stage, its optima followed there.

    Where that fails only the optimum that is found from X_T is left.
    """
    found = learner.state(state.place, stage, [(None, i.result) for i in state.inners])
    if learner.usable(found):
        return found
    return learner.state(state.place, stage, [(learner.learning.controls, None)])


def _rival(learner: Learner, state: State, stage: Stage) -> Inner | None:
    """Return where a solve of the same θ ends, if that is none of the known optima.

    It goes its own way from X_T, through gentler problems. Whether it converged is in the result.
    """
    learning, settings = learner.learning, learner.settings
    problem = learning.problem(state.style, gain=stage.gain)
    solved = solve_spacetime(
        problem, learning.controls, settings=SolverSettings(tolerance=settings.tolerance)
    )
    learner.count(solved)
    found = Inner(problem, solved, cost_of_point(problem, solved.point))
    return found if _apart(found, state.inners, settings.new_deg) else None


def _straight_rival(learner: Learner, state: State, stage: Stage) -> Inner | None:
    """Return where a solve straight from X_T ends, if that is none of the known optima."""
    found = learner.state(state.place, stage, [(learner.learning.controls, None)]).inners[0]
    return found if _apart(found, state.inners, learner.settings.new_deg) else None


def _apart(inner: Inner, others: Sequence[Inner], least_deg: float) -> bool:
    """Tell whether a motion is farther than that from all others, rms over joints."""
    here = inner.cost.values.coordinates
    return all(joint_rms_deg(here, one.cost.values.coordinates) > least_deg for one in others)


def _stage(
    learner: Learner,
    state: State,
    stage: Stage,
    trust: float,
    record: _Record,
) -> tuple[State, float]:
    """Return the best state of one stage, and the trust to go on with."""
    jacobian, controls = learner.linearised(state)
    most, refused = MOST_REFUSALS if stage.closeness else MOST_FREE_REFUSALS, 0
    for _ in range(stage.steps):
        if learner.spent(stage):
            break
        step, promised = learner.step(state, jacobian, trust)
        share = min(1.0, trust)
        moves = [(by_style @ step).reshape(-1, COUNT) for by_style in controls]
        starts = [
            (inner.result.point.controls + move, inner.result)
            for inner, move in zip(state.inners, moves, strict=True)
        ]
        found = learner.state(state.place + step, stage, starts)
        before, after, found = _compared(learner, state, found, stage, moves)
        better = learner.usable(found) and after < before
        record(found, stage, better)
        if not better:
            trust, refused = 0.3 * trust, refused + 1
            if refused == most:
                break
            continue
        gained = 1 - after / before
        # The promise is of all optima, also where some did not stay: only the trust hangs on it.
        kept = (before - after) / max(state.objective - promised, 1e-12)
        if kept > GOOD_SHARE:
            trust = min(MOST_TRUST, 2 * trust)
        elif kept < POOR_SHARE:
            trust *= 0.5
        refused, state = 0, _distinct(learner, found, stage)
        if gained < share * learner.settings.least_gain:
            break
        jacobian, controls = learner.linearised(state)
    return state, min(1.0, 2 * trust)


def _compared(
    learner: Learner, state: State, found: State, stage: Stage, moves: Sequence[Array]
) -> tuple[float, float, State]:
    """Return the objective before and after a step, of optima that stayed, and where it led.

    An optimum may cease to be one, and a solve from there ends elsewhere or is cut off. Were it
    taken for the same, no step would be better that lets a nearly vanished optimum go (CMU 08
    stayed at 14° for it). Where it led is held against the next step; a solve that was cut off is
    left out, since one of its own finds its optimum again if there is one. Where no optimum stayed,
    all that were found are held against all before.

    Parameters
    ----------
    moves : of the control points, as the linear model foretold, (K, 35) each.
    """
    near = [learner.near_optimum(inner) for inner in found.inners]
    stayed = [
        k
        for k, (old, new, move) in enumerate(zip(state.inners, found.inners, moves, strict=True))
        if near[k] and _strayed_deg(old, new, move) < learner.settings.new_deg
    ]
    kept = [inner for inner, good in zip(found.inners, near, strict=True) if good]
    if len(stayed) == len(moves) or not kept:
        return state.objective, found.objective, found
    reached = learner.judged(found.place, found.style, stage, kept)
    if not stayed:
        return state.objective, reached.objective, reached
    before, after = (
        learner.judged(one.place, one.style, stage, [one.inners[k] for k in stayed]).objective
        for one in (state, found)
    )
    return before, after, reached


def _strayed_deg(old: Inner, new: Inner, move: Array) -> float:
    """Return how far an optimum ended from where the linear model put it, rms over joints."""
    foretold = old.cost.values.coordinates + old.problem.basis().evaluate(move)[0]
    return joint_rms_deg(new.cost.values.coordinates, foretold)


def _distinct(learner: Learner, state: State, stage: Stage) -> State:
    """Return the state without optima that have become one with an earlier one."""
    kept: list[Inner] = []
    for inner in state.inners:
        if _apart(inner, kept, 0.5 * learner.settings.new_deg):
            kept.append(inner)
    if len(kept) == len(state.inners):
        return state
    return learner.judged(state.place, state.style, stage, kept)
