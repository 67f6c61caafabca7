"""The sheet of styles, settings of the learners, and tables and checks made from learning."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionstyle.configuration import read_settings
from motionstyle.dynamics.passive import PassiveParameters
from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.nio.checks import segment_checks, shoe_checks, spring_checks
from motionstyle.evaluation.nio.learning_table import (
    LEARNING_COLUMNS,
    RESYNTHESIS_COLUMNS,
    learning_rows,
    resynthesis_rows,
    style_cells,
)
from motionstyle.evaluation.nio.likelihood import likelihood_checks, tempered
from motionstyle.evaluation.nio.style_parameters import PARAMETER_COLUMNS, style_parameter_rows
from motionstyle.nio.settings import our_settings, paper_settings
from motionstyle.nio.styles_sheet import COLUMNS, read_styles
from motionstyle.spacetime.style import Style, load_style, save_no_style

ROOT = Path(__file__).parents[2]
SCHEMA = ROOT / "workflow/schemas/nio.schema.json"
GOOD = {
    **dict.fromkeys(COLUMNS, ""),
    **{"id": "a", "clip": "walk", "mood": "neutral", "action": "walk", "set": "held_out"},
    "algorithms": "ours,paper",
}


def sheet(tmp_path, *rows):
    lines = ["\t".join(COLUMNS), *("\t".join((GOOD | row)[c] for c in COLUMNS) for row in rows)]
    (tmp_path / "styles.tsv").write_text("\n".join(lines), encoding="utf-8")
    return tmp_path / "styles.tsv"


def some_style(seed=0, shoe=(8e3, 0.012)):
    rng = np.random.default_rng(seed)
    above, below, damping = rng.uniform(5, 90, (3, 29))
    rest = rng.uniform(-0.3, 0.3, 29)
    passive = PassiveParameters(above, below, damping / 20, rest)
    return Style(rng.dirichlet(np.ones(29)), passive, *shoe)


@pytest.mark.parametrize("name", ["styles.tsv", "styles.full.tsv"])
def test_shipped_sheets_can_be_read(name):
    rows = read_styles(ROOT / "config" / name)
    assert rows
    assert all(row.algorithms for row in rows)


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([{"algorithms": "our"}], r"styles\.tsv row 2, column algorithms: 'our' .*did you mean"),
        ([{}, {"id": "b"}], r"column clip: 'walk' stands already in row 2"),
        ([{"against": "c"}], r"style a: against 'c', which is not a style"),
        ([{"last_frame": "5"}], r"column last_frame: a window needs at least 12 frames"),
        ([{"clip": "wlak"}], r"column clip: 'wlak' is not a clip .*did you mean walk"),
    ],
)
def test_faults_of_the_sheet_are_told(tmp_path, rows, message):
    with pytest.raises(MotionStyleError, match=message):
        read_styles(sheet(tmp_path, *rows), ["walk"])


def test_shipped_settings_make_both_learners_settings():
    settings = read_settings(ROOT / "config/nio.yaml", SCHEMA)
    for schedule in settings["ours"]["schedules"]:
        pulls = [stage.closeness for stage in our_settings(settings, schedule).stages]
        assert pulls == sorted(pulls, reverse=True)
    assert paper_settings(settings).iterations == 50
    with pytest.raises(MotionStyleError, match="schedule 'ful' is not one of"):
        our_settings(settings, "ful")


def test_a_wrong_setting_is_told_with_its_file(tmp_path):
    text = (ROOT / "config/nio.yaml").read_text(encoding="utf-8")
    (tmp_path / "nio.yaml").write_text(text.replace("damping:", "dampign:"), encoding="utf-8")
    with pytest.raises(MotionStyleError, match=r"nio\.yaml:\n(.|\n)*did you mean damping"):
        read_settings(tmp_path / "nio.yaml", SCHEMA)


def test_no_style_says_why(tmp_path):
    save_no_style(tmp_path / "a.json", "the walk floats")
    with pytest.raises(MotionStyleError, match=r"a\.json: no style was learnt: the walk floats"):
        load_style(tmp_path / "a.json")


def judged_row(**changes):
    row = dict.fromkeys(RESYNTHESIS_COLUMNS[7:-4], 1.0)
    row |= {"ends": "free", "start": "target", "seed": None, "status": "converged"}
    return row | {"variant": "full", "beats_paper": None} | changes


def record(cells, algorithm, rows, kind=None):
    return {
        "cells": cells, "algorithm": algorithm, "kind": kind or algorithm, "variant": "full",
        "ends": "free", "status": "done", "rows": rows, "projection": {},
    }  # fmt: skip


def test_learning_and_judging_become_tables(tmp_path):
    (row,) = read_styles(sheet(tmp_path, {}))
    cells = style_cells(row)
    steps = [
        {"iteration": k, "objective": g, "G": g, "status": "iteration limit", "seconds": 1.0 * k,
         "alpha_on_idle_joints": 0.1, "passive_over_muscle": 2.0, "accepted": True}
        for k, g in enumerate((9.0, 5.0, 6.0))
    ]  # fmt: skip
    judged = [
        record(cells, name, [
            judged_row(algorithm=name, total=7.0, joint_rms_deg=angle),
            judged_row(algorithm=name, total=6.0, joint_rms_deg=angle + 1, start="perturbed",
                       seed=1),
        ])
        for name, angle in (("paper", 8.0), ("ours", 6.0))
    ]  # fmt: skip
    rows = learning_rows([record(cells, "paper", steps)], judged, "test")
    assert all(set(one) <= set(LEARNING_COLUMNS) for one in rows)
    assert [one.get("not_rising") for one in rows] == [None, True, False, None]
    assert [one.get("last_step") for one in rows] == [None, None, True, None]
    assert [one.get("step_10") for one in rows] == [None, None, True, None]  # it stopped before
    assert rows[-1]["last"]
    assert rows[-1]["inner"] == "converged"
    assert rows[-1]["joint_error_deg"] == 9.0  # of the deepest optimum, not of the first start
    found = resynthesis_rows(judged, "test")
    assert all(set(one) <= set(RESYNTHESIS_COLUMNS) for one in found)
    assert [one.get("beats_paper") for one in found] == [None, None, True, None]
    judged[1]["rows"][0]["status"] = "iteration limit"
    assert resynthesis_rows(judged, "test")[2]["beats_paper"] is False
    judged[0]["rows"][0]["status"] = "iteration limit"
    assert resynthesis_rows(judged, "test")[2].get("beats_paper") is None


def test_a_refused_trial_at_the_end_tells_nothing_of_the_style(tmp_path):
    (row,) = read_styles(sheet(tmp_path, {}))
    cells = style_cells(row)
    steps = [
        {"iteration": k, "objective": 1.0, "G": 1.0, "status": "converged", "seconds": 1.0 * k,
         "alpha_on_idle_joints": idle, "passive_over_muscle": idle, "accepted": taken}
        for k, (idle, taken) in enumerate(((0.1, True), (0.9, False)))
    ]  # fmt: skip
    judged = [record(cells, "ours", [judged_row(algorithm="ours", total=1.0)])]
    rows = learning_rows([record(cells, "ours", steps)], judged, "test")
    assert rows[0]["last_step"]
    assert rows[-1]["last"]
    assert rows[-1]["alpha_on_idle_joints"] == rows[-1]["passive_over_muscle"] == 0.1


def test_styles_are_compared_by_ratio_and_angles_by_difference(tmp_path):
    file = sheet(
        tmp_path, {"id": "walk"}, {"id": "run", "clip": "r", "action": "run", "against": "walk"}
    )
    rows = read_styles(file)
    walk = some_style()
    vector = walk.vector()
    vector[29:] *= 2
    run = walk.with_vector(vector)
    styles = {("walk", "ours"): walk, ("run", "ours"): run}
    table = style_parameter_rows(rows, styles, {"walk": walk, "run": walk}, "test")
    assert len(table) == 2 * 147
    assert all(set(one) <= set(PARAMETER_COLUMNS) for one in table)
    of_run = [one for one in table if one["style"] == "run"]
    stiff = [one["run_over_walk"] for one in of_run if one["parameter"] in ("k_s1", "k_s2")]
    assert stiff == pytest.approx([2.0] * 58)
    rests = [one for one in of_run if one["parameter"] == "q_bar"]
    assert [one["run_minus_walk_deg"] for one in rests] == pytest.approx(
        np.degrees(walk.passive.rest_angle)
    )
    assert not any("run_over_walk" in one for one in rests)


def test_ratios_to_nothing_have_their_place(tmp_path):
    file = sheet(
        tmp_path, {"id": "walk"}, {"id": "run", "clip": "r", "action": "run", "against": "walk"}
    )
    walk = some_style()
    bare, alike = walk.vector(), walk.vector()
    bare[29:31] = 0.0  # the first two joints' springs
    alike[30] = 0.0
    styles = {("walk", "ours"): walk.with_vector(bare), ("run", "ours"): walk.with_vector(alike)}
    table = style_parameter_rows(read_styles(file), styles, {"walk": walk, "run": walk}, "test")
    ratios = [
        one["run_over_walk"]
        for one in table
        if one["style"] == "run" and one["parameter"] == "k_s1"
    ]
    assert ratios[:2] == [np.inf, 1.0]
    assert ratios[2:] == [1.0] * 27


def test_a_springs_kink_and_a_shoes_end_are_read_off_their_curves():
    style = some_style()
    offset, error = (row["value"] for row in spring_checks(style))
    assert abs(offset) < 0.05
    assert error < 0.1
    above, near, below = (row["value"] for row in shoe_checks(style))
    assert above < 0.1
    assert above < near < 5  # the printed sigmoid pulls by a trace
    assert below >= 0
    assert shoe_checks(replace(style, shoe_stiffness=0.0)) == []


def test_the_drop_is_read_at_both_ends_of_the_segment():
    found = {"before": {"s": [-0.5, 0, 1, 1.5], "total": [9, 8, 2, 3]}}
    assert segment_checks(found)[0]["value"] == pytest.approx(0.75)


def test_likelihood_equals_its_decomposition_and_tends_to_g():
    """Eqs. (27)–(29); for a parabola E = a x² the integral is known: √(πτ/a)."""
    a, tau = 4.0, 0.05
    found = tempered(lambda x: a * x**2, tau)
    assert found["by_27"] - found["G"] == pytest.approx(
        tau * np.log(np.sqrt(np.pi * tau / a)), rel=1e-6
    )
    for row in likelihood_checks():
        limit = 0.02 if row["quantity"] == "limit_relative_error" else 1e-5
        assert row["value"] < limit
