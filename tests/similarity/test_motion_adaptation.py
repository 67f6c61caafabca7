"""Motion adaptation: exact derivatives, checked status, refused targets, and a task solved."""

import itertools
from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from scipy.sparse import csc_matrix

from motionstyle.body.kinematics import contact_points, forward_kinematics, points_in_world
from motionstyle.body.layout import NODES
from motionstyle.configuration import read_settings
from motionstyle.errors import MotionStyleError
from motionstyle.motion.storage import load_motion, save_motion
from motionstyle.similarity.adapt_measures import measure, models_without, pair_scores
from motionstyle.similarity.adapt_problem import build_problem, leg_pieces
from motionstyle.similarity.adapt_terms import MOVED, WIDTH
from motionstyle.similarity.adaptation import adapt
from motionstyle.similarity.blocks import Block, assemble, block_function
from motionstyle.similarity.footholds import cut_example, make_footholds
from motionstyle.similarity.judge import judge, judge_motions
from motionstyle.similarity.solver import solve
from motionstyle.similarity.symbolic_body import pose_function
from motionstyle.similarity.tasks import Task, read_tasks

ROOT = Path(__file__).parents[2]
LONGER = Task("longer", "walk", "walk_6", segments=2, stride=1.03)


@pytest.fixture(scope="module")
def posed(walks, bank, settings, rules):
    """A walk with a step up, its footholds, models that have not seen it, and its program."""
    task = Task("up", "walk", "walk_0", segments=2, rises_m=(0.08,))
    example = cut_example(walks[0], task, rules, 30)
    holds = make_footholds(example, task)
    style = models_without(bank, settings, {"walk_0"})
    marked = np.zeros(example.motion.frames, dtype=bool)
    marked[-2:] = True
    problem = build_problem(
        example, holds, style.spaces, style.models, settings["adaptation"], 60, 15, marked
    )
    return example, holds, style, problem


@pytest.fixture(scope="module")
def adapted(walks, bank, settings):
    """The task of longer strides, with and without style; a wide kernel, so that S ≥ 0 is met."""
    settings = {**settings, "models": {**settings["models"], "widths": [0.05]}}
    return adapt(walks[6], LONGER, bank, settings, "test")


def test_the_symbolic_body_is_the_numerical_one(walks):
    motion = walks[2]
    pose = forward_kinematics(motion.body, motion.coordinates[50:52])
    points, coms, forward = pose_function(motion.body)(motion.coordinates[50])
    np.testing.assert_allclose(np.array(points).T, contact_points(motion.body, pose)[0], atol=1e-12)
    expected = points_in_world(pose, np.arange(len(NODES)), motion.body.coms)[0]
    np.testing.assert_allclose(np.array(coms).T, expected, atol=1e-12)
    np.testing.assert_allclose(np.array(forward).ravel(), pose.rotations[0, 0, :, 0], atol=1e-12)


def test_gradient_and_jacobian_against_finite_differences(posed):
    program, generator = posed[3].program, np.random.default_rng(0)
    x = posed[3].start + 0.01 * generator.normal(size=len(posed[3].start))
    nlp = program.nlp
    f, g = ca.Function("f", [nlp["x"]], [nlp["f"]]), ca.Function("g", [nlp["x"]], [nlp["g"]])
    gradient = np.array(program.options["grad_f"](x, [])[1]).ravel()
    jacobian = program.options["jac_g"](x, [])[1].sparse()
    step = 1e-6
    for _ in range(12):
        d = generator.normal(size=len(x)) * (generator.random(len(x)) < 0.05)
        slope = float(f(x + step * d) - f(x - step * d)) / (2 * step)
        assert slope == pytest.approx(gradient @ d, rel=1e-5, abs=1e-3)
        change = np.array(g(x + step * d) - g(x - step * d)).ravel() / (2 * step)
        np.testing.assert_allclose(jacobian @ d, change, rtol=1e-5, atol=1e-5)


def test_the_hessian_is_positive_semidefinite_and_exact_for_linear_residuals():
    z, p = ca.SX.sym("z", 2), ca.SX.sym("p", 1)
    function = block_function("line", z, p, ca.vertcat(z[0] - p, 3 * z[1] - z[0]), ca.SX(0, 1))
    index = np.array([[0, 1], [1, 2]])
    block = Block("line", function, index, np.zeros((2, 1)), np.zeros((2, 0)), np.zeros((2, 0)))
    program = assemble(3, [block], csc_matrix((0, 3)), np.zeros(0), np.zeros(3))
    upper = np.array(program.options["hess_lag"](np.zeros(3), [], 1.0, []))
    own = np.array([[2, -3], [-3, 9]])
    expected = np.zeros((3, 3))
    expected[:2, :2] += own
    expected[1:, 1:] += own
    np.testing.assert_allclose(upper + np.triu(upper, 1).T, expected)


def test_the_programs_hessian_has_no_negative_direction(posed):
    program, x = posed[3].program, posed[3].start
    multipliers = -np.abs(np.random.default_rng(1).normal(size=len(program.lower)))
    upper = program.options["hess_lag"](x, [], 1.0, multipliers).sparse().toarray()
    values = np.linalg.eigvalsh(upper + np.triu(upper, 1).T)
    assert values[0] > -1e-6 * values[-1]


def test_scores_inside_the_program_are_those_of_the_models(posed, settings):
    """At the start the new motion's legs are the example's; g holds f_s/|ρ| + slack."""
    example, _, style, problem = posed
    x = problem.start.copy()
    scores, _ = pair_scores(example.motion, example, style, settings["leg_space"]["features"])
    g = np.array(ca.Function("g", [problem.program.nlp["x"]], [problem.program.nlp["g"]])(x))
    names = np.array(problem.program.constraint_names)
    for name in ("left_leg", "right_leg"):
        own = g.ravel()[names == name] * abs(style.models[name].rho)
        np.testing.assert_allclose(own, scores[name], atol=1e-9)


def test_leg_pieces_cover_the_window_and_share_their_borders(posed):
    example = posed[0]
    for leg in ("left_leg", "right_leg"):
        own = [p.segment for p in leg_pieces(example) if p.segment.set == leg]
        assert own[0].first == 0
        assert own[-1].last == example.motion.frames - 1
        assert all(a.last == b.first for a, b in itertools.pairwise(own))


def test_footholds_of_an_unchanged_task_are_the_examples(walks, rules):
    task = Task("same", "walk", "walk_0", segments=2)
    example = cut_example(walks[0], task, rules, 30)
    holds = make_footholds(example, task)
    points = contact_points(example.motion.body, example.motion.pose())
    misses = np.linalg.norm((holds.targets - points)[..., [0, 2]], axis=-1)[holds.bearing]
    assert misses.max() < 0.05  # what the made-up feet slip
    np.testing.assert_allclose(holds.pelvis, example.motion.coordinates[:, :6], atol=1e-9)


def test_footholds_follow_stride_rise_and_turn(walks, rules):
    def places(**changes):
        task = Task("t", "walk", "walk_0", segments=3, **changes)
        example = cut_example(walks[0], task, rules, 30)
        return make_footholds(example, task), example

    plain, example = places()
    longer, _ = places(stride=1.2)
    up, _ = places(rises_m=(0.1, 0.2))
    turned, _ = places(turn_deg=90.0)
    last = np.flatnonzero(plain.bearing[-1])
    start = plain.targets[0, plain.bearing[0]].mean(axis=0)
    ahead = [h.targets[-1, last].mean(axis=0) - start for h in (plain, longer, up, turned)]
    assert ahead[1][0] > 1.1 * ahead[0][0]
    highest = 0.1 + 0.2 * (len(example.touches) - 2)
    assert up.targets[-1, last, 1].max() == pytest.approx(highest, abs=0.03)
    assert up.surface.height_at(np.array([9.0]))[0] == pytest.approx(highest)
    assert ahead[3][2] < -0.2  # to the left is −z
    assert np.linalg.norm(turned.pelvis[-1, 3:6]) == pytest.approx(np.pi / 2, abs=0.3)


def test_a_step_of_two_metres_is_refused(walks, bank, settings):
    with pytest.raises(
        MotionStyleError,
        match=r"foothold 1 is out of reach, 2\.\d+ m away.*lower stride or rises_m",
    ):
        adapt(walks[6], replace(LONGER, stride=4.0), bank, settings, "test")
    with pytest.raises(MotionStyleError, match=r"out of reach, .*\+2.00 m up"):
        adapt(walks[6], replace(LONGER, rises_m=(2.0,)), bank, settings, "test")


def test_more_segments_than_the_example_has_are_refused(walks, bank, settings):
    with pytest.raises(MotionStyleError, match=r"has \d whole-body segments, but 20"):
        adapt(walks[6], replace(LONGER, segments=20), bank, settings, "test")


def test_a_task_is_met_as_far_as_its_row_says(adapted):
    full, without = adapted["full"].row, adapted["without_style"].row
    assert adapted["example"].row["contact_rms_cm"] > 1
    for row in (full, without):
        assert row["status"] in {"converged", "acceptable"}
        assert row["contact_rms_cm"] < 0.5
        assert row["penetration_cm"] < 0.3
        errors = [row[f"{name}_cm"] for name in ("contact_error", "penetration", "skate")]
        kept = row is without or row["min_svm_score"] >= -1e-6
        assert row["solved"] == (max(errors) <= 1 and kept)
    assert without["solved"]
    assert (full["score_slack"] > 1e-4) == (full["min_svm_score"] < -1e-6)


def test_a_task_whose_style_cannot_be_kept_is_solved_with_slack_but_not_counted(
    walks, bank, settings
):
    settings = {**settings, "models": {**settings["models"], "widths": [8.0]}}
    row = adapt(walks[6], LONGER, bank, settings, "test")["full"].row
    assert row["status"] in {"converged", "acceptable"}
    assert row["score_slack"] > 0
    assert row["min_svm_score"] < 0
    assert not row["solved"]
    assert "S >= 0 cannot be met" in row["reason"]
    assert "(example, example) lies outside" in row["reason"]


def test_style_terms_keep_the_motion_closer_to_its_example(adapted):
    full, without = adapted["full"].row, adapted["without_style"].row
    assert full["min_svm_score"] >= without["min_svm_score"]
    assert full["relative_leakage"] <= without["relative_leakage"]


def test_trunk_and_arms_keep_the_examples_angles(adapted, walks, rules):
    example = cut_example(walks[6], LONGER, rules, 30)
    fixed = np.setdiff1d(np.arange(35), MOVED)
    np.testing.assert_array_equal(
        adapted["full"].motion.coordinates[:, fixed], example.motion.coordinates[:, fixed]
    )


def test_same_input_gives_the_same_solution(posed):
    problem = posed[3]
    first, again = (
        solve(
            problem.program,
            problem.start,
            problem.lower,
            problem.upper,
            max_iterations=6,
            time_limit_s=30,
        )
        for _ in range(2)
    )
    np.testing.assert_array_equal(first.x, again.x)


def test_an_adapted_motion_travels_as_a_file_and_is_judged(
    adapted, walks, bank, settings, tmp_path
):
    save_motion(tmp_path / "longer.npz", adapted["full"].motion)
    motion = load_motion(tmp_path / "longer.npz")
    assert (motion.kind, motion.provenance["example"]) == ("adapted", "walk_6")
    stranger = replace(motion, id="stranger", provenance={"example": "nobody"})
    rows = judge_motions([motion, stranger], {"walk_6": walks[6]}, bank, settings, "test")
    assert rows[0]["status"] == "ok"
    assert 0 < rows[0]["relative_leakage"] < 1
    assert "nobody is not among this run's motions" in rows[1]["reason"]


def test_the_judge_finds_an_example_closer_to_itself_than_a_changed_motion(
    walks, bank, settings, posed
):
    style = posed[2]
    changed = walks[0].coordinates.copy()
    changed[:, 6:20] *= 1.5
    itself = judge(walks[0], walks[0], style, settings)
    other = judge(replace(walks[0], coordinates=changed), walks[0], style, settings)
    assert itself["relative_leakage"] < other["relative_leakage"]
    assert itself["least_svm_score"] > other["least_svm_score"]


def test_measures_see_a_sunken_and_a_sliding_foot(posed, bank, settings):
    example, holds, style, _ = posed
    q = example.motion.coordinates.copy()
    q[:, 1] -= 0.05
    q[:, 0] += 0.3 * np.arange(len(q)) / len(q)
    moved = replace(example.motion, coordinates=q)
    row = measure(moved, example, holds, style, bank, settings)
    plain = measure(example.motion, example, holds, style, bank, settings)
    assert row["penetration_cm"] >= plain["penetration_cm"] + 4.9
    assert row["skate_cm"] > plain["skate_cm"] + 3


def one_variable(lower, upper):
    """Minimise (x − 3)² subject to lower ≤ x ≤ upper as a constraint row."""
    z, p = ca.SX.sym("z", 1), ca.SX.sym("p", 1)
    function = block_function("well", z, p, z - 3, z)
    block = Block("well", function, np.array([[0]]), np.zeros((1, 1)), lower, upper)
    return assemble(1, [block], csc_matrix((0, 1)), np.zeros(0), np.zeros(1))


def test_the_solver_says_what_it_found():
    free = np.full(1, np.inf)
    good = solve(
        one_variable(np.array([[-1.0]]), np.array([[2.0]])),
        np.zeros(1),
        -free,
        free,
        max_iterations=50,
        time_limit_s=5,
    )
    assert good.solved
    assert good.x[0] == pytest.approx(2, abs=1e-3)
    assert good.diagnosis == ""
    bad = solve(
        one_variable(np.array([[5.0]]), np.array([[6.0]])),
        np.zeros(1),
        -free,
        np.ones(1),
        max_iterations=50,
        time_limit_s=5,
    )
    assert not bad.solved
    assert bad.violation > 1
    assert "largest violation" in bad.diagnosis
    assert "'well'" in bad.diagnosis


def test_the_solver_stops_at_its_limit_and_refuses_nonsense(posed):
    problem = posed[3]
    cut = solve(
        problem.program,
        problem.start,
        problem.lower,
        problem.upper,
        max_iterations=1,
        time_limit_s=5,
    )
    assert cut.status == "Maximum_Iterations_Exceeded"
    assert not cut.solved
    start = problem.start.copy()
    start[7] = np.nan
    with pytest.raises(MotionStyleError, match="not a number at variable 7"):
        solve(
            problem.program, start, problem.lower, problem.upper, max_iterations=1, time_limit_s=5
        )
    with pytest.raises(MotionStyleError, match="contradict each other"):
        solve(
            problem.program,
            problem.start,
            problem.upper,
            problem.lower - 1,
            max_iterations=1,
            time_limit_s=5,
        )


def test_the_shipped_tasks_are_six_of_each_kind_and_settings_are_one():
    tasks = read_tasks(ROOT / "config/adaptations.tsv")
    assert [sum(t.action == a for t in tasks) for a in ("walk", "jump", "run")] == [6, 6, 6]
    assert {t.balance for t in tasks if t.action != "jump"} == {False}
    settings = read_settings(
        ROOT / "config/similarity.yaml", ROOT / "workflow/schemas/similarity.schema.json"
    )
    assert not {t.example for t in tasks} & set(settings["held_back"])
    assert read_tasks(ROOT / "config/adaptations.tsv", set()) == ()


@pytest.mark.parametrize(
    ("cell", "expected"),
    [
        (("stride", "-1"), r"row 2, column stride"),
        (("rises_m", "0.1,high"), r"row 2, column rises_m: 'high' is not a height"),
        (("action", "swim"), r"row 2, column action"),
        (("example", ""), r"row 2, column example: empty"),
    ],
)
def test_a_wrong_task_is_refused(tmp_path, cell, expected):
    lines = (ROOT / "config/adaptations.tsv").read_text(encoding="utf-8").splitlines()
    header, row = [x for x in lines if not x.startswith("#")][:2]
    cells = row.split("\t")
    cells[header.split("\t").index(cell[0])] = cell[1]
    path = tmp_path / "tasks.tsv"
    path.write_text(header + "\n" + "\t".join(cells) + "\n", encoding="utf-8")
    with pytest.raises(MotionStyleError, match=expected):
        read_tasks(path)


def test_settings_are_checked_with_the_files_name(tmp_path):
    text = (ROOT / "config/similarity.yaml").read_text(encoding="utf-8")
    path = tmp_path / "similarity.yaml"
    path.write_text(text.replace("inner_folds: 3", "inner_folds: 1"), encoding="utf-8")
    with pytest.raises(
        MotionStyleError, match=r"similarity.yaml:\n.*models.inner_folds.*at least 2"
    ):
        read_settings(path, ROOT / "workflow/schemas/similarity.schema.json")


def test_moved_coordinates_are_pelvis_and_legs():
    assert WIDTH == 20
    assert len(set(MOVED)) == 20
