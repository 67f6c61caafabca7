"""From a plan to a motion: what the solver is given, and what is reported of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motionstyle.body.kinematics import centre_of_mass
from motionstyle.errors import MotionStyleError
from motionstyle.files import read_json, write_json
from motionstyle.spacetime.continuation import STAGES
from motionstyle.spacetime.edits import Edits
from motionstyle.spacetime.solver_point import SolverSettings
from motionstyle.spacetime.style import JOINTS_29, load_style, save_style
from motionstyle.spacetime.synthesis import (
    USUAL_SHOES,
    initial_style_of,
    spacetime_problem,
    synthesise,
)
from motionstyle.spacetime.synthesis_plan import make_plan, planned_footprints
from motionstyle.spacetime.synthesis_sheet import FootprintSource, SynthesisRow
from synthetic_walk import loaded_walk


def row_of(**edits):
    return SynthesisRow(
        "made", None, "same_footprints", "walk", "initial", "neutral", FootprintSource(),
        Edits(**edits), None, None, (), None, 2, None,
    )  # fmt: skip


@pytest.fixture(scope="module")
def functions(all_functions):
    return all_functions


@pytest.fixture(scope="module")
def walk():
    """A made-up walk, half a second of it, whose contacts carry its weight."""
    return loaded_walk(20, 36)


def test_the_initial_style_is_that_of_the_specification(walk, functions):
    style = initial_style_of(walk, functions)
    assert style.preferences == pytest.approx(np.full(29, 1 / 29))
    assert style.passive.rest_angle == pytest.approx(walk.coordinates[:, 6:].mean(axis=0), abs=0.02)
    assert (style.shoe_stiffness, style.shoe_rest_length) == USUAL_SHOES
    assert style.about["recipe"] == "initial"
    with pytest.raises(MotionStyleError, match="no contact forces; a style needs a physical one"):
        initial_style_of(replace(walk, contact_forces=None), functions)


def test_a_few_iterations_give_a_motion_with_forces_and_an_honest_status(walk, functions):
    row = row_of()
    plan = make_plan(row, walk, *planned_footprints(row, walk))
    style = initial_style_of(walk, functions)
    settings = SolverSettings(iterations=5)
    found = synthesise(row, plan, style, functions, settings=settings, log=lambda _text: None)
    assert found.report["status"] != "converged"
    assert found.motion.provenance["solver_status"] == found.report["status"]
    assert found.motion.kind == "nio"
    assert found.motion.contact_forces is not None
    assert found.report["cone_excess_n"] == pytest.approx(0.0, abs=1e-6)
    assert found.report["iterations"] == 5 * (len(STAGES) + 1)
    assert len(found.trace) == 6 * (len(STAGES) + 1)  # and their starts
    assert found.diagnosis["terms"]["muscles"] > 0


def test_a_style_edited_in_its_file_is_used_as_edited(walk, functions, tmp_path):
    """A user edits one number of a style's JSON file, and nothing is learnt again."""
    row = row_of()
    plan = make_plan(row, walk, *planned_footprints(row, walk))
    path = tmp_path / "mine.json"
    save_style(path, initial_style_of(walk, functions))
    content = read_json(path)
    content["parameters"]["rest_angle.head_flexion"]["value"] = 0.3
    content["about"]["body_mass_kg"] = 3 * walk.body.mass
    write_json(path, content)
    edited = load_style(path)
    problem = spacetime_problem(row, plan, edited, functions)
    head = list(JOINTS_29).index("head_flexion")
    assert problem.style.passive.rest_angle[head] == 0.3
    settings = SolverSettings(iterations=1)
    found = synthesise(row, plan, edited, functions, settings=settings, log=lambda _text: None)
    assert "was made for a body of" in found.report["style_warning"]
    assert np.isfinite([step["energy"] for step in found.trace]).all()
    height = centre_of_mass(found.motion.body, found.motion.pose())[:, 1]
    assert height.min() > 0.5
