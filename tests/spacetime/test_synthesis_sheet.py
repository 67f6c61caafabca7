"""The sheet of syntheses, and the plans made of its rows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionstyle.body.layout import COORDINATE_INDEX
from motionstyle.errors import MotionStyleError
from motionstyle.files import write_json
from motionstyle.motion.resample import resample
from motionstyle.spacetime.captured_footprints import footprints_of
from motionstyle.spacetime.edits import SUITCASE
from motionstyle.spacetime.footprints import write_footprints
from motionstyle.spacetime.synthesis_plan import (
    example_window,
    load_plan,
    make_plan,
    planned_footprints,
)
from motionstyle.spacetime.synthesis_sheet import COLUMNS, read_row, read_syntheses
from synthetic_walk import make_walk

SHEETS = sorted((Path(__file__).parents[2] / "config").glob("syntheses*.tsv"))
GOOD = {
    **dict.fromkeys(COLUMNS, ""),
    **{"id": "a", "task": "curve", "example": "walk", "style": "initial"},
    **{"footprints": "arc radius_m=3 side=left", "mood": "neutral"},
}


def sheet(tmp_path, *rows):
    path = tmp_path / "syntheses.tsv"
    lines = ["\t".join(COLUMNS), *("\t".join((GOOD | row)[c] for c in COLUMNS) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def one(tmp_path, **cells):
    return read_syntheses(sheet(tmp_path, cells))[0]


@pytest.mark.parametrize("path", SHEETS, ids=lambda p: p.name)
def test_the_sheets_that_are_shipped_are_sound(path):
    rows = read_syntheses(path)
    tasks = {row.task for row in rows}
    wanted = {"same_footprints", "curve", "turn_180", "ramp_up", "ramp_down", "stairs_up", "limp"}
    wanted |= {"suitcase", "springy_shoes", "skating", "body_size"}
    assert wanted <= tasks
    for row in rows:
        slope = row.footprints.values.get("slope_deg", 0)
        assert (slope > 0) == (row.task == "ramp_up")
        assert (slope < 0) == (row.task == "ramp_down")


@pytest.mark.parametrize("kind", ["", ".full"])
def test_shipped_sheets_name_clips_of_the_shipped_motion_sheets(kind):
    folder = SHEETS[0].parent
    motions = folder / f"motions{kind or '.embedded'}.tsv"
    clips = [line.split("\t")[0] for line in motions.read_text(encoding="utf-8").splitlines()]
    assert read_syntheses(folder / f"syntheses{kind}.tsv", clips)


def test_cells_become_values(tmp_path):
    row = one(
        tmp_path,
        experiment="nio-E4",
        style="initial:run",
        footprints="arc radius_m=2.5 side=right slide=yes",
        edits="load=suitcase lock.knee_flexion_l=5 narrow.hip_flexion_l=0.5 shoe_stiffness=2",
        first_frame="3",
        last_frame="60",
        others="x,y",
    )
    assert row.experiment == "nio-E4"
    assert (row.recipe, row.style_clip, row.clips) == ("initial", "run", ("walk", "run"))
    assert row.footprints.slide
    assert row.footprints.number("radius_m") == 2.5
    assert row.footprints.number("step_scale") == 1.0
    assert row.footprints.text("side") == "right"
    assert row.edits.loads == (SUITCASE,)
    assert row.edits.locked == {"knee_flexion_l": 5.0}
    assert row.edits.narrowed == {"hip_flexion_l": 0.5}
    assert row.edits.shoe_stiffness == 2
    assert row.others == ("x", "y")
    assert one(tmp_path, footprints="captured motion=b").clips == ("walk", "b")
    assert one(tmp_path, footprints="").footprint_clip == "walk"


@pytest.mark.parametrize(
    ("cells", "message"),
    [
        ({"task": "curv"}, r"row 2, column task: 'curv' is not one of .*did you mean curve"),
        ({"style": "intial"}, r"column style: 'intial' .*did you mean initial"),
        ({"footprints": "ark"}, r"column footprints: 'ark' is not one of .*did you mean arc"),
        ({"footprints": "arc side=left"}, "column footprints: arc needs radius_m"),
        ({"footprints": "arc radius_m=2"}, "column footprints: arc needs side"),
        ({"footprints": "arc radius_m=2 side=up"}, "side is 'up', must be left or right"),
        ({"footprints": "arc radius=2 side=left"}, r"'radius' is no parameter .*mean radius_m"),
        ({"footprints": "ramp slope_deg=8deg"}, "slope_deg is '8deg', not a number"),
        ({"footprints": "line fast"}, "'fast' is no name=value pair"),
        ({"edits": "lock.knee=5"}, r"column edits: 'knee' is not a joint coordinate"),
        ({"edits": "load=suitcas"}, r"'suitcas' is no load .*did you mean suitcase"),
        ({"edits": "frictoin=1"}, r"'frictoin' is not one of .*did you mean friction"),
        ({"edits": "mass_scale=0"}, "mass_scale is 0.0; it must be a factor above 0"),
        ({"edits": "friction=0.1 friction=0.2"}, "friction stands there twice"),
        ({"first_frame": "5", "last_frame": "9"}, "at least 8 frames"),
        ({"example": ""}, "column example: empty"),
        ({"id": "a_copied"}, "column id: 'a_copied' ends in '_copied'"),
        ({"id": "a b"}, "column id: 'a b' may have only"),
    ],
)
def test_the_wrong_cell_is_named(tmp_path, cells, message):
    with pytest.raises(MotionStyleError, match=message):
        one(tmp_path, **cells)


def test_unknown_clips_and_doubled_ids(tmp_path):
    path = sheet(tmp_path, {"example": "wlak"}, {"id": "A"})
    with pytest.raises(MotionStyleError) as caught:
        read_syntheses(path, ["walk", "run"])
    assert "column example: 'wlak' is not a clip" in str(caught.value)
    assert "did you mean walk" in str(caught.value)
    assert "'A' is already the id of row 2" in str(caught.value)
    with pytest.raises(MotionStyleError, match=r"no synthesis 'aa' \(did you mean a"):
        read_row(sheet(tmp_path, {}), "aa")


@pytest.fixture(scope="module")
def example():
    return resample(make_walk(), 30.0)


@pytest.mark.parametrize(
    "cells",
    [
        {"footprints": ""},
        {"footprints": "captured slide=yes"},
        {"footprints": "line step_scale=0.9 time_scale=1.2"},
        {"footprints": "arc radius_m=3 side=left"},
        {"footprints": "turn radius_m=0.5 side=right lead_m=0.4"},
        {"footprints": "ramp slope_deg=-8"},
        {"footprints": "stairs tread_m=0.3 rise_m=0.17"},
        {"footprints": "", "edits": "lock.knee_flexion_l=5 load=suitcase"},
        {"footprints": "line step_scale=0.8", "edits": "length_scale=0.8 mass_scale=0.5"},
    ],
    ids=lambda cells: cells["footprints"] or cells.get("edits") or "own",
)
def test_every_source_gives_a_plan(tmp_path, example, cells):
    row = one(tmp_path, **{"first_frame": "10", "last_frame": "89"} | cells)
    window = example_window(example, row)
    footprints, frames = planned_footprints(row, window)
    plan = make_plan(row, window, footprints, frames)
    assert plan.feet.frames == plan.start.frames == frames
    assert (plan.start.contacts == plan.feet.held).all()
    assert (plan.start.coordinates >= plan.ranges[:, 0]).all()
    assert (plan.start.coordinates <= plan.ranges[:, 1]).all()
    assert plan.feet.sliding.any() == row.footprints.slide
    assert plan.start.provenance["synthesis"] == "a"
    write_footprints(tmp_path / "f.tsv", footprints)
    write_json(tmp_path / "f.json", {"status": "ok", "frames": frames})
    again = load_plan(row, window, tmp_path / "f.tsv", tmp_path / "f.json")
    assert again.feet.targets == pytest.approx(plan.feet.targets, abs=2e-6)
    assert again.start.coordinates == pytest.approx(plan.start.coordinates, abs=1e-3)


def test_a_users_file_and_other_motions_footprints(tmp_path, example):
    row = one(tmp_path, footprints="file path=mine.tsv")
    write_footprints(tmp_path / "mine.tsv", footprints_of(example))
    found, frames = planned_footprints(row, example)
    assert len(found) == len(footprints_of(example))
    assert frames <= example.frames
    other = replace(example.window(0, 80), id="other")
    row = one(tmp_path, footprints="captured motion=other")
    found, frames = planned_footprints(row, example, other)
    assert frames == 81


def test_failed_footprints_say_why(tmp_path, example):
    row = one(tmp_path, footprints="line step_scale=4")
    with pytest.raises(MotionStyleError, match=r"footprints of a: rows .* out of reach"):
        planned_footprints(row, example)
    write_json(tmp_path / "f.json", {"status": "failed", "reason": "too far"})
    with pytest.raises(MotionStyleError, match="too far"):
        load_plan(row, example, tmp_path / "f.tsv", tmp_path / "f.json")
    with pytest.raises(MotionStyleError, match="last_frame is 999, but walk ends at frame 1"):
        example_window(example, one(tmp_path, last_frame="999"))


def test_a_limp_starts_with_the_knee_locked(tmp_path, example):
    row = one(tmp_path, footprints="", edits="lock.knee_flexion_l=5")
    plan = make_plan(row, example, *planned_footprints(row, example))
    knee = np.degrees(plan.start.coordinates[:, COORDINATE_INDEX["knee_flexion_l"]])
    assert np.abs(knee - 5).max() <= 0.5 + 1e-9
    copied = np.degrees(plan.copied.coordinates[:, COORDINATE_INDEX["knee_flexion_l"]])
    assert np.ptp(copied) > 20


def test_a_style_of_the_users_own_is_named_by_its_path(tmp_path):
    with pytest.raises(MotionStyleError, match=r"style: there is no file .*mine\.json; paths"):
        one(tmp_path, style="mine.json")
    (tmp_path / "mine.json").write_text("{}")
    row = one(tmp_path, style="mine.json")
    assert (row.recipe, row.style_clip) == ("file", "walk")
    assert row.style_file == tmp_path / "mine.json"
    assert read_syntheses(sheet(tmp_path, {"style": "mine.json"}), ["walk"])
    made = one(tmp_path, style="hand:run")
    assert (made.recipe, made.style_clip, made.style_file) == ("hand", "run", None)
