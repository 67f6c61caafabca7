"""Our learner: its derivatives against differences, and what its steps promise."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from motionstyle.configuration import read_settings
from motionstyle.errors import MotionStyleError
from motionstyle.nio import optima, ours
from motionstyle.nio.inner import InnerSettings, inner_solve
from motionstyle.nio.optima import Learner, Stage
from motionstyle.nio.settings import our_settings

ROOT = Path(__file__).parents[2]
PULLED = Stage(0.1, 3, 60.0)


def quiet(_text):
    pass


@pytest.fixture(scope="module")
def shipped():
    return read_settings(ROOT / "config/nio.yaml", ROOT / "workflow/schemas/nio.schema.json")


@pytest.fixture(scope="module")
def settings(shipped):
    stages = [PULLED, Stage(0.01, 3, 60.0)]
    found = our_settings(shipped, "quick")
    return replace(found, stages=stages, round_steps=2, rounds=1, final_steps=1)


@pytest.fixture(scope="module")
def learner(made_learning, settings):
    return Learner(made_learning, replace(settings, tolerance=1e-8))  # for differences


@pytest.fixture(scope="module")
def state(learner):
    return learner.state(learner.origin, PULLED, [(None, None)])


@pytest.fixture(scope="module")
def rows(made_learning, settings):
    return ours.learn(made_learning, settings, quiet).rows


def test_the_jacobian_is_what_differences_of_the_residuals_are(learner, state):
    both = learner.judged(state.place, state.style, PULLED, state.inners * 2)
    jacobian, controls = learner.linearised(both)
    assert len(controls) == 2
    way = np.random.default_rng(0).standard_normal(len(state.place))
    low, high = learner.space.room(state.place)
    way[(low > -1e-2) | (high < 1e-2)] = 0.0
    ends = []
    for sign in (1, -1):
        place = state.place + sign * 1e-3 * way
        ends.append(learner.state(place, PULLED, [(None, i.result) for i in both.inners]))
    difference = (ends[0].residuals - ends[1].residuals) / 2e-3
    miss = np.linalg.norm(jacobian @ way - difference)
    assert miss < 0.02 * np.linalg.norm(difference)


def test_a_short_step_keeps_what_the_linear_model_promises(learner, state):
    jacobian, controls = learner.linearised(state)
    step, promised = learner.step(state, jacobian, 0.05)
    assert promised < state.objective
    start = state.inners[0].result.point.controls + (controls[0] @ step).reshape(-1, 35)
    found = learner.state(state.place + step, PULLED, [(start, state.inners[0].result)])
    assert found.objective == pytest.approx(promised, rel=0.05)
    low, high = learner.space.room(state.place)
    assert ((step >= low - 1e-9) & (step <= high + 1e-9)).all()


def test_the_objective_never_rises_within_a_stage(rows):
    taken = [row for row in rows if row["accepted"]]
    for one, other in pairwise(taken):
        same = [one[k] == other[k] for k in ("closeness", "gain", "optima")]
        assert not all(same) or other["objective"] < one["objective"]
    assert len(taken) > 5


def test_learning_brings_the_optimum_nearer_to_the_motion(made_learning, shipped, settings):
    # By the shipped stages: after two of them X_S jumps where the pull ends.
    stages = our_settings(shipped, "quick").stages
    rows = ours.learn(made_learning, replace(settings, stages=stages), quiet).rows
    own = InnerSettings(0.0, settings.round_gain, 300, 1e-6, 1e-2)
    before = inner_solve(made_learning, made_learning.start, own)
    before_deg = made_learning.joint_error_deg(before.cost.values.coordinates)
    assert rows[-1]["closeness"] == 0
    assert min(row["joint_error_deg"] for row in rows if not row["closeness"]) < 0.8 * before_deg


def test_where_the_motion_jumps_a_stage_is_put_between(made_learning, settings, monkeypatch):
    monkeypatch.setattr(ours, "JUMP", 0.0)  # every stage counts as a jump
    once = replace(settings, most_between=1, rounds=0, round_steps=0, final_steps=0)
    stages = [replace(stage, steps=0) for stage in settings.stages]
    found = ours.learn(made_learning, replace(once, stages=stages), quiet).rows
    pulls = [row["closeness"] for row in found if row["accepted"]]
    assert sorted(pulls, reverse=True) == pulls
    tried = {round(row["closeness"], 6) for row in found}
    assert round(float(np.sqrt(0.1 * 0.01)), 6) in tried


def moved_by(inner, radians):
    """The solve, ended elsewhere."""
    values = inner.cost.values
    far = replace(values, coordinates=values.coordinates + radians)
    return replace(inner, cost=replace(inner.cost, values=far))


@pytest.mark.parametrize("cut_off", [False, True])
def test_an_optimum_that_ceases_to_be_one_does_not_forbid_a_step(learner, state, cut_off):
    one = state.inners[0]
    far = moved_by(one, np.radians(60.0))
    if cut_off:
        far = replace(far, result=replace(far.result, optimality=1.0))
    before = learner.judged(state.place, state.style, PULLED, [one, moved_by(one, 0.05)])
    found = learner.judged(state.place, state.style, PULLED, [one, far])
    none = [np.zeros_like(one.result.point.controls)] * 2
    was, becomes, reached = ours._compared(learner, before, found, PULLED, none)
    alone = learner.judged(state.place, state.style, PULLED, [one])
    assert was == becomes == pytest.approx(alone.objective)
    assert len(reached.inners) == (1 if cut_off else 2)
    assert learner.usable(reached)


def test_where_all_optima_jumped_all_are_compared(learner, state):
    one = state.inners[0]
    found = learner.judged(state.place, state.style, PULLED, [moved_by(one, np.radians(60.0))])
    none = [np.zeros_like(one.result.point.controls)]
    was, becomes, reached = ours._compared(learner, state, found, PULLED, none)
    assert (was, becomes) == (state.objective, pytest.approx(found.objective))
    assert reached.objective == pytest.approx(found.objective)


def test_all_multipliers_are_kept_only_without_a_pull(learner, state, monkeypatch):
    kept = []

    def solve(_learning, _style, how, *_):
        kept.append(how.whole)
        return state.inners[0]

    monkeypatch.setattr(optima, "inner_solve", solve)
    result = state.inners[0].result
    cut_off = replace(result, status="iteration limit")
    for closeness, before in ((1e-5, result), (0.0, cut_off), (0.0, None), (0.0, result)):
        learner.state(state.place, replace(PULLED, closeness=closeness), [(None, before)])
    assert kept == [False, False, False, True]


@pytest.mark.parametrize(("trust", "taken"), [(1.0, 1), (0.25, 6)])
def test_a_stage_does_not_end_for_a_step_that_had_to_be_short(
    learner, state, settings, monkeypatch, trust, taken
):
    """Each step gains 1 % and half of what was promised, which leaves the trust as it is."""
    gains, records = iter(range(99)), []

    def compared(_learner, _state, found, *_):
        before = state.objective * 0.99 ** next(gains)
        return before, 0.99 * before, found

    one = Learner(learner.learning, replace(settings, least_gain=0.02))
    step = np.zeros_like(state.place)
    still = np.zeros((state.inners[0].result.point.controls.size, len(step)))
    monkeypatch.setattr(one, "linearised", lambda _state: (None, [still]))
    monkeypatch.setattr(one, "step", lambda *_: (step, 0.98 * state.objective))
    monkeypatch.setattr(one, "state", lambda *_: state)
    monkeypatch.setattr(ours, "_compared", compared)
    ours._stage(one, state, replace(PULLED, steps=6), trust, lambda *row: records.append(row))
    assert len(records) == taken


def test_a_round_does_not_begin_with_the_trust_that_refusals_left(
    learner, state, settings, monkeypatch
):
    begun = []
    monkeypatch.setattr(ours, "_held", lambda _learner, now, *_: (now, True))
    monkeypatch.setattr(ours, "_stage", lambda *given: begun.append(given[3]) or (state, 0.01))
    one = Learner(learner.learning, replace(settings, rounds=1))
    for trust in (0.01, 0.9):
        ours._rounds(one, state, PULLED, trust, lambda *_: None)
    assert begun == [ours.LEAST_TRUST, 0.9]


def test_the_last_steps_are_held_to_a_solve_straight_from_the_motion(
    learner, state, settings, monkeypatch
):
    far = moved_by(state.inners[0], 0.3)
    monkeypatch.setattr(ours, "_followed", lambda _learner, now, _stage: now)
    monkeypatch.setattr(ours, "_rival", lambda *_: None)
    monkeypatch.setattr(ours, "_straight_rival", lambda *_: far)
    monkeypatch.setattr(ours, "_stage", lambda _learner, now, *_: (now, 1.0))
    for work, optima_known in ((0, 2), (settings.most_work, 1)):
        one = Learner(learner.learning, settings)
        one.work = work
        found = ours._finished(one, state, 1.0, lambda *_: None)
        assert len(found.inners) == optima_known


@pytest.mark.parametrize("name", ["rounds", "stages_work", "rounds_work", "most_work"])
def test_what_a_schedule_lacks_is_named(shipped, name):
    ours_part = dict(shipped["ours"], **{name: {"full": 1}})
    with pytest.raises(MotionStyleError, match=f"{name}.*'quick'"):
        our_settings(dict(shipped, ours=ours_part), "quick")


@pytest.mark.parametrize(("first_away", "second_away"), [(0.5, 0.1), (0.1, 0.5)])
def test_the_round_whose_own_solve_came_closest_is_kept(
    learner, state, settings, monkeypatch, first_away, second_away
):
    away = iter([first_away, second_away])
    moved = learner.judged(state.place + 1e-3, state.style, PULLED, state.inners)

    def rival(_learner, now, _stage):
        return moved_by(now.inners[0], next(away))

    monkeypatch.setattr(ours, "_rival", rival)
    monkeypatch.setattr(ours, "_stage", lambda *_: (moved, 1.0))
    one = Learner(learner.learning, replace(settings, rounds=1))
    best, _trust = ours._rounds(one, state, PULLED, 1.0, lambda *_: None)
    kept = moved if second_away < first_away else state
    np.testing.assert_array_equal(best.place, kept.place)
    assert len(best.inners) == 2


def test_no_step_is_taken_once_the_work_was_too_much(made_learning, settings):
    spent = replace(settings, stages_work=1, rounds_work=1, most_work=1, rounds=0)
    found = ours.learn(made_learning, spent, quiet).rows
    entered = [(row["closeness"], row["gain"]) for row in found if row["accepted"]]
    assert len(entered) > len(settings.stages)
    assert len(set(entered)) == len(entered)


def test_no_round_begins_once_the_work_was_too_much(learner, state, settings, monkeypatch):
    begun = []
    monkeypatch.setattr(ours, "_held", lambda _learner, now, *_: (now, True))
    monkeypatch.setattr(
        ours, "_stage", lambda _learner, now, *_: begun.append(1) or (replace(now), 1.0)
    )
    one = Learner(learner.learning, replace(settings, rounds=3, rounds_work=10))
    for work, rounds in ((9, 3), (10, 0)):
        begun.clear()
        one.work = work
        ours._rounds(one, state, replace(PULLED, closeness=0.0), 1.0, lambda *_: None)
        assert len(begun) == rounds


def test_rounds_end_where_neither_a_step_nor_a_solve_finds_anything_new(
    learner, state, settings, monkeypatch
):
    begun = []
    monkeypatch.setattr(ours, "_rival", lambda *_: None)
    monkeypatch.setattr(ours, "_stage", lambda _learner, now, *_: begun.append(1) or (now, 1.0))
    many = Learner(learner.learning, replace(settings, rounds=9))
    ours._rounds(many, state, PULLED, 1.0, lambda *_: None)
    assert len(begun) == 1
    moving = iter([True, True, False])
    monkeypatch.setattr(
        ours,
        "_stage",
        lambda _learner, now, *_: begun.append(1) or (replace(now) if next(moving) else now, 1.0),
    )
    ours._rounds(many, state, PULLED, 1.0, lambda *_: None)
    assert len(begun) == 4


def test_a_solve_that_was_cut_off_gives_way_to_an_optimum(learner, state):
    inner = state.inners[0]
    cut = replace(inner, result=replace(inner.result, optimality=1.0))
    poor = learner.judged(state.place, state.style, PULLED, [cut])
    held, learnable = ours._held(learner, poor, PULLED, lambda *_: None, lambda *_: inner)
    assert learnable
    assert held.inners == (inner,)
    held, learnable = ours._held(learner, poor, PULLED, lambda *_: None, lambda *_: cut)
    assert not learnable
    assert held is poor


def test_all_multipliers_of_a_neighbour_lead_to_the_same_optimum_sooner(made_learning, state):
    inner = state.inners[0]
    style, how = state.style, InnerSettings(30.0, PULLED.gain, 120, 1e-6, 1e-3)
    near = style.with_vector(style.vector() * 1.001)
    before = inner_solve(made_learning, style, how, None, inner.result.point).result.point
    cold = inner_solve(made_learning, near, how, None, before)
    warm = inner_solve(made_learning, near, replace(how, whole=True), None, before)
    assert warm.result.status == cold.result.status == "converged"
    assert warm.result.iterations < cold.result.iterations
    np.testing.assert_allclose(
        warm.cost.values.coordinates, cold.cost.values.coordinates, atol=1e-5
    )


def test_optima_that_have_become_one_are_one(learner, state):
    twice = learner.judged(state.place, state.style, PULLED, state.inners * 2)
    assert twice.objective == pytest.approx(state.objective)
    assert len(ours._distinct(learner, twice, PULLED).inners) == 1


def test_a_schedule_that_is_not_there_is_named(shipped):
    with pytest.raises(MotionStyleError, match="schedule 'ful' is not one of full, quick"):
        our_settings(shipped, "ful")
