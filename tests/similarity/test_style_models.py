"""One-class SVM, kernel PCA and their validation, against scikit-learn and closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.distance import cdist
from sklearn.decomposition import KernelPCA
from sklearn.metrics import roc_auc_score
from sklearn.svm import OneClassSVM

from motionstyle.errors import MotionStyleError
from motionstyle.similarity.bank import build_bank
from motionstyle.similarity.discrimination import dtw_distances, interval
from motionstyle.similarity.models import fit_model, kernel_axes, kernel_leakages
from motionstyle.similarity.patterns import halves, leg_spaces, make_patterns, paper_set, similar
from motionstyle.similarity.study import folds_of, mismatched_of, run_study
from motionstyle.similarity.validation import (
    Fold,
    Mismatched,
    auc,
    check_disjoint,
    choose_widths,
    group_folds,
    held_out,
    pattern_folds,
    subject_folds,
)


@pytest.fixture(scope="module")
def data():
    generator = np.random.default_rng(3)
    return generator.normal(size=(80, 5)) @ generator.normal(size=(5, 12))


@pytest.fixture(scope="module")
def model(data):
    return fit_model(data, "whole_body", relative_width=0.5, svm_width=2.0, cutoff=10)


def test_leakage_against_scikit_learns_kernel_pca(data, model):
    test = data[:20] + 0.3 * np.random.default_rng(4).normal(size=(20, 12))
    scaled, own = model.scaling.apply(test), model.patterns
    referee = KernelPCA(n_components=79, kernel="rbf", gamma=model.gamma).fit(own)
    projected = referee.transform(scaled)
    gram = np.exp(-model.gamma * cdist(own, own, "sqeuclidean"))
    kernel = np.exp(-model.gamma * cdist(scaled, own, "sqeuclidean"))
    norms = 1 - 2 * kernel.mean(axis=1) + gram.mean()
    expected = norms - (projected[:, :10] ** 2).sum(axis=1)
    leak, relative = model.leakages(test)
    np.testing.assert_allclose(leak, expected, atol=1e-9)
    np.testing.assert_allclose(relative, expected / norms, atol=1e-8)


def test_leakage_with_a_linear_kernel_is_plain_pca(data):
    """With k(p, q) = p·q on the unit sphere, the leakage is PCA's reconstruction error."""
    unit = data / np.linalg.norm(data, axis=1, keepdims=True)
    gram = unit @ unit.T
    leak, _ = kernel_leakages(gram, *kernel_axes(gram, 3, "x"))
    centred = unit - unit.mean(axis=0)
    _, _, axes = np.linalg.svd(centred, full_matrices=False)
    rest = centred - centred @ axes[:3].T @ axes[:3]
    np.testing.assert_allclose(leak, (rest**2).sum(axis=1), atol=1e-12)


def test_svm_scores_against_scikit_learn_and_all_training_patterns_inside(data, model):
    scaled = model.scaling.apply(data)
    referee = OneClassSVM(gamma=model.svm_gamma, nu=1 / len(data), tol=1e-9).fit(scaled)
    np.testing.assert_allclose(model.svm_scores(data), referee.decision_function(scaled), atol=1e-6)
    assert model.svm_scores(data).min() >= -1e-12
    assert model.alphas.sum() == pytest.approx(1.0)


def test_a_soft_margin_leaves_its_share_outside(data):
    soft = fit_model(data, "x", relative_width=0.5, cutoff=5, nu=0.2)
    outside = np.mean(soft.svm_scores(data) < -1e-9)
    assert 0 < outside <= 0.2 + 1e-9


def test_a_pattern_far_away_leaks_wholly_and_lies_outside(data, model):
    far = data[:1] + 1000.0
    assert model.svm_scores(far)[0] < 0
    assert model.leakages(far)[1][0] > model.leakages(data)[1].max()


@pytest.mark.parametrize(
    ("patterns", "options", "expected"),
    [
        (np.zeros((2, 3)), {}, "2 patterns, at least 3 are needed"),
        (np.c_[np.arange(5.0), np.ones(5)], {}, "feature 1 has no variance over 5 patterns"),
        (np.arange(12.0).reshape(6, 2), {"nu": 0.01}, r"ν = 0.01 is infeasible for 6 patterns"),
        (np.array([[0.0], [1.0], [np.nan]]), {}, "feature 0 of pattern 2 is not a number"),
        (np.repeat([[0.0], [1.0]], [9, 1], axis=0), {}, "copies of one another"),
    ],
)
def test_impossible_training_sets_are_refused(patterns, options, expected):
    with pytest.raises(MotionStyleError, match=expected):
        fit_model(patterns, "x", relative_width=0.5, cutoff=2, **options)


def test_an_indefinite_kernel_is_refused():
    generator = np.random.default_rng(0)
    matrix = generator.normal(size=(12, 12))
    with pytest.raises(MotionStyleError, match="not positive semidefinite"):
        kernel_axes(matrix + matrix.T, 4, "x")
    with pytest.raises(MotionStyleError, match="all patterns are equal"):
        kernel_axes(np.ones((5, 5)), 2, "x")


def test_duplicate_patterns_make_no_axes_of_rounding(data):
    doubled = np.concatenate([data[:8], data[:8]])
    model = fit_model(doubled, "x", relative_width=0.5, cutoff=15)
    assert model.axes.shape[1] <= 7
    assert model.leakages(doubled)[1].max() < 1e-9


def test_auc_against_scikit_learn():
    generator = np.random.default_rng(5)
    inside, outside = generator.integers(0, 9, 30) + 2.0, generator.integers(0, 9, 50) * 1.0
    truth = np.r_[np.ones(30), np.zeros(50)]
    assert auc(inside, outside) == pytest.approx(roc_auc_score(truth, np.r_[inside, outside]))


def test_folds_cover_all_patterns_once_and_keep_groups_together():
    folds = pattern_folds(23, 5, 0)
    assert sorted(np.concatenate([f.test for f in folds])) == list(range(23))
    groups = [f"g{k % 7}" for k in range(23)]
    for fold in group_folds(groups, 20, 0):
        assert not {groups[k] for k in fold.test} & {groups[k] for k in fold.train}
    with pytest.raises(MotionStyleError, match="4 patterns cannot be divided into 20 folds"):
        pattern_folds(4, 20, 0)
    with pytest.raises(MotionStyleError, match="all 3 patterns are of one pair"):
        group_folds(["a", "a", "a"], 20, 0)


def test_a_group_in_both_parts_of_a_fold_is_refused():
    fold = Fold(np.array([0, 1]), np.array([2]))
    with pytest.raises(MotionStyleError, match=r"walk_1 walk_2 is in the training and in the test"):
        check_disjoint(np.array(["a", "walk_1 walk_2", "walk_1 walk_2"]), fold)


def test_subject_folds_need_subjects():
    subjects = np.array([["s1", "s2"], ["s1", "s1"], ["s2", "s2"]])
    with pytest.raises(MotionStyleError, match="2 known subjects, 3 are needed"):
        subject_folds(subjects, 3)
    many = np.array([[f"s{k}", f"s{k}"] for k in range(6)])
    for fold in subject_folds(many, 3):
        assert not set(many[fold.test].ravel()) & set(many[fold.train].ravel())


def test_mirrored_copies_stay_in_their_sources_group(bank, settings):
    mirrored = [c for c in bank.clips if c.id.endswith("_mirror")]
    assert mirrored
    assert all(c.base + "_mirror" == c.id for c in mirrored)
    settings = {
        **settings,
        "sets": {**settings["sets"], "paper_size": dict.fromkeys(("walk", "jump", "run"), 10_000)},
    }
    patterns, _, _ = paper_set(bank, settings)
    one = patterns["whole_body"]
    owners = np.array([c.id for c in bank.clips])[bank.owners["whole_body"][one.halves]]
    assert any(name.endswith("_mirror") for name in owners.ravel())
    for names, group in zip(owners, one.groups, strict=True):
        assert sorted(n.removesuffix("_mirror") for n in names) == group.split()


def test_no_clip_is_paired_with_its_own_mirror_image(bank):
    assert all(bank.clips[p.first].base != bank.clips[p.second].base for p in bank.pairs)


def test_models_without_a_clip_have_not_seen_it(bank, settings):
    patterns, _, _ = paper_set(bank, settings, without={"walk_3"})
    for one in patterns.values():
        assert "walk_3" not in " ".join(one.groups).split()


def test_a_type_with_too_few_pairs_is_left_out_with_the_reason(walks, rules, settings):
    few, _ = build_bank(walks[:2], rules, ["walk"], mirror=False)
    with pytest.raises(
        MotionStyleError, match=r"no type of motion has enough similar pairs \(walk: 1 pairs"
    ):
        paper_set(few, settings)


def test_similar_means_equal_type_or_equal_style(bank, schema_settings):
    sets = schema_settings["sets"]
    clip = bank.clips[0]
    assert similar(clip, replace(clip, style="other"), sets)  # CMU: by type alone
    elsewhere = replace(clip, source="bandai")
    assert similar(elsewhere, elsewhere, sets)
    assert not similar(elsewhere, replace(elsewhere, style="other"), sets)


def test_the_width_is_chosen_without_the_level_of_the_leakage(bank, settings):
    patterns, spaces, _ = paper_set(bank, settings)
    one = patterns["whole_body"]
    outside = mismatched_of(bank, spaces, one, settings)
    found = choose_widths(one.vectors, list(one.groups), outside, [0.1, 1.0, 4.0], 10, 3, 0)
    assert found.leakage == [0.1, 1.0, 4.0][int(np.argmax(found.auc))]
    assert found.svm == [0.1, 1.0, 4.0][int(np.argmax(found.balance))]


def test_held_out_scores_do_not_depend_on_what_they_are_tested_with(bank, settings):
    patterns, spaces, _ = paper_set(bank, settings)
    one = patterns["left_leg"]
    outside = mismatched_of(bank, spaces, one, settings)
    folds = pattern_folds(len(one), 5, 0)
    scores = held_out(one, outside, folds, settings, width=0.5)
    nothing = Mismatched(np.zeros((0, 30)), np.zeros(0, dtype=int), np.zeros(0, dtype=str))
    again = held_out(one, nothing, folds, settings, width=0.5)
    np.testing.assert_array_equal(scores.relative, again.relative)
    assert len(again.mismatched_svm) == 0


def test_a_study_of_three_sets_fills_its_tables(bank, settings):
    small = {"paper_size": {"walk": 25, "jump": 25, "run": 25}, "all_pairs_limit": 25}
    settings = {**settings, "sets": {**settings["sets"], **small}}
    study = run_study(bank, settings, "test")
    ways = {(r["set"], r["folds"], r["width"]) for r in study.leakage if r["size"] == "paper"}
    for name in ("whole_body", "left_leg", "right_leg"):
        for way in ("pattern", "pair", "subject"):
            assert (name, way, "chosen") in ways
    assert {r["features"] for r in study.sets if r["set"] == "whole_body" and r["patterns"]} == {
        108
    }
    hard = [r for r in study.svm if r["margin"] == "hard"]
    assert all(r["training_inside_share"] == 1 for r in hard)
    again = run_study(bank, settings, "test")
    assert again.leakage == study.leakage  # same input, same output


def test_subject_folds_that_cannot_be_made_are_rows_with_a_reason(walks, rules, settings):
    same = [replace(w, provenance={**w.provenance, "subject": "one"}) for w in walks[:5]]
    bank, _ = build_bank(same, rules, ["walk"])
    patterns, _, _ = paper_set(bank, settings)
    found = folds_of(patterns["whole_body"], settings)
    assert found["subject"] == "1 known subjects, 3 are needed"


def test_dtw_against_brute_force():
    generator = np.random.default_rng(6)
    first, second = generator.normal(size=(3, 5, 2)), generator.normal(size=(3, 6, 2))

    def brute(a, b):
        if not len(a) or not len(b):
            return 0.0 if len(a) == len(b) else np.inf
        cost = np.linalg.norm(a[-1] - b[-1])
        return cost + min(brute(a[:-1], b[:-1]), brute(a[:-1], b), brute(a, b[:-1]))

    expected = [brute(a, b) for a, b in zip(first, second, strict=True)]
    np.testing.assert_allclose(dtw_distances(first, second), expected)


def test_the_interval_holds_the_auc_and_narrows_with_more_groups():
    generator = np.random.default_rng(7)

    def width(count):
        groups = np.array([f"g{k // 2}" for k in range(count)])
        inside, outside = generator.normal(1, 1, count), generator.normal(0, 1, count)
        low, high = interval(inside, groups, outside, groups, 200, 0)
        assert low <= auc(inside, outside) <= high
        return high - low

    assert width(400) < width(30)


def test_pairs_swap_sides_without_losing_which_segment_is_whose(bank, settings):
    spaces = leg_spaces(bank)
    parts = halves(bank, spaces, settings["leg_space"]["features"])
    pair = bank.pairs[0]
    straight = make_patterns(bank, parts, [(pair, False)])["left_leg"]
    swapped = make_patterns(bank, parts, [(pair, True)])["left_leg"]
    np.testing.assert_array_equal(straight.vectors[:, :15], swapped.vectors[:, 15:])
    np.testing.assert_array_equal(straight.halves, swapped.halves[:, ::-1])
