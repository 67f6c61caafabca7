"""The motion sheet: what it accepts, and one line for everything wrong with it."""

from __future__ import annotations

from pathlib import Path

import pytest

from motionstyle.errors import MotionStyleError
from motionstyle.mocap.datasets.doors import DatasetFile, read_datasets
from motionstyle.mocap.datasets.sheet import COLUMNS, METRES, companion_skeleton, read_sheet
from motionstyle.mocap.datasets.wheel import read_wheel_pin

ROOT = Path(__file__).parents[2]
DATASETS = {
    ("bandai", path): DatasetFile("bandai", path, "o/n", "0" * 40, path, "0" * 64, "", "")
    for path in ("bandai/walk_sad.bvh", "bandai/02.asf", "bandai/02_01.amc", "bandai/03_01.amc")
}
GOOD = {
    "id": "walk",
    "dataset": "bandai",
    "path": "bandai/walk_sad.bvh",
    "up_axis": "y",
    "unit": "cm",
    "action": "walk",
    "skeleton": "bandai",
}


def line(**cells: str) -> str:
    return "\t".join({**GOOD, **cells}.get(column, "") for column in COLUMNS)


def sheet(folder: Path, *lines: str, header: str = "\t".join(COLUMNS), end: str = "\n") -> Path:
    path = folder / "sheet.tsv"
    path.write_bytes((end.join([header, *lines]) + end).encode())
    return path


def problems(path: Path, **options) -> list[str]:
    with pytest.raises(MotionStyleError) as caught:
        read_sheet(path, DATASETS, **options)
    return str(caught.value).splitlines()


def one(tmp_path: Path, **cells: str) -> str:
    found = problems(sheet(tmp_path, line(**cells)))
    assert len(found) == 1, found
    return found[0]


# --- what is accepted ----------------------------------------------------------------------


def test_empty_cells_are_none_or_the_default(tmp_path):
    (row,) = read_sheet(sheet(tmp_path, line()), DATASETS)
    assert (row.rate_hz, row.mass_kg, row.sex, row.last_frame, row.style) == (None,) * 5
    assert (row.cycles, row.level, row.surface, row.mirror) == (1, "kinematic", "level", False)
    assert (row.experiments, row.row, row.companions) == ((), 2, ())


def test_full_row_is_typed(tmp_path):
    cells = {"rate": "59.94", "mass_kg": "62.5", "sex": "female", "first_frame": "5"}
    cells |= {"last_frame": "90", "cycles": "3", "level": "physical", "surface": "ramp"}
    cells |= {"mirror": "yes", "experiments": "nio, gait", "style": "sad", "note": "ünused"}
    (row,) = read_sheet(sheet(tmp_path, line(**cells)), DATASETS)
    assert (row.rate_hz, row.mass_kg, row.sex) == (59.94, 62.5, "female")
    assert (row.first_frame, row.last_frame, row.cycles) == (5, 90, 3)
    assert (row.level, row.surface, row.mirror) == ("physical", "ramp", True)
    assert (row.experiments, row.style, row.note) == (("nio", "gait"), "sad", "ünused")


@pytest.mark.parametrize(
    ("unit", "metres"), [("cm", 0.01), ("cmu", 0.0254 / 0.45), ("0.5", 0.5), ("inch", 0.0254)]
)
def test_units(tmp_path, unit, metres):
    (row,) = read_sheet(sheet(tmp_path, line(unit=unit)), DATASETS)
    assert row.metres_per_unit == pytest.approx(metres, rel=1e-15)


def test_byte_order_mark_crlf_comments_and_empty_lines(tmp_path):
    path = sheet(tmp_path, "# a comment", "", line(), "\t" * 5, line(id="b"), end="\r\n")
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    rows = read_sheet(path, DATASETS)
    assert [(row.id, row.row, row.note) for row in rows] == [("walk", 4, None), ("b", 6, None)]


def test_cells_quoted_by_a_spreadsheet(tmp_path):
    (row,) = read_sheet(sheet(tmp_path, line(experiments='"nio,gait"')), DATASETS)
    assert row.experiments == ("nio", "gait")


def test_local_file_is_relative_to_the_sheet(tmp_path):
    folder = tmp_path / "my clips é"
    folder.mkdir()
    (folder / "a b.bvh").write_text("")
    (row,) = read_sheet(sheet(folder, line(dataset="", path="a b.bvh")), DATASETS)
    assert row.dataset is None
    assert row.local_file() == folder / "a b.bvh"


def test_amc_brings_its_asf_along(tmp_path):
    (row,) = read_sheet(sheet(tmp_path, line(path="bandai/02_01.amc")), DATASETS)
    assert row.companions == ("bandai/02.asf",)
    assert companion_skeleton("x/y.bvh") is None


def test_marker_files_state_their_own_unit(tmp_path):
    (tmp_path / "a.c3d").write_text("")
    cells = {"dataset": "", "path": "a.c3d", "unit": "", "up_axis": ""}
    (row,) = read_sheet(sheet(tmp_path, line(**cells)), DATASETS)
    assert row.metres_per_unit is None


# --- faults of the whole sheet -------------------------------------------------------------


def test_missing_sheet(tmp_path):
    assert problems(tmp_path / "no.tsv") == [
        f"{tmp_path / 'no.tsv'}: cannot read the sheet: No such file or directory"
    ]


@pytest.mark.parametrize("text", ["", "\n\n", "# only a comment\n"])
def test_empty_sheet(tmp_path, text):
    path = tmp_path / "sheet.tsv"
    path.write_text(text)
    assert problems(path) == [f"{path}: the sheet is empty; its first line names the columns"]


def test_sheet_without_rows(tmp_path):
    path = sheet(tmp_path, "# walk\tbandai")
    assert problems(path) == [f"{path}: the sheet has no rows under its column names"]


def test_unknown_and_missing_columns_with_near_matches(tmp_path):
    header = "\t".join(COLUMNS).replace("up_axis", "upaxis").replace("mirror", "style")
    assert problems(sheet(tmp_path, line(), header=header)) == [
        "sheet.tsv row 1: unknown column 'upaxis' (did you mean up_axis?)",
        "sheet.tsv row 1: column 'up_axis' is missing",
        "sheet.tsv row 1: column 'mirror' is missing",
        "sheet.tsv row 1: column 'style' stands there twice",
    ]


def test_sheet_divided_by_commas(tmp_path):
    (found,) = problems(sheet(tmp_path, header=",".join(COLUMNS)))
    assert found.startswith("sheet.tsv row 1: no tab in this line; columns are divided by tabs: id")


def test_wrong_number_of_cells(tmp_path):
    assert problems(sheet(tmp_path, line() + "\t", line(id="b").removesuffix("\t"))) == [
        "sheet.tsv row 2: 23 cells, expected 22 (one for each column, divided by tabs)",
        "sheet.tsv row 3: 21 cells, expected 22 (one for each column, divided by tabs)",
    ]


def test_unbalanced_quotes(tmp_path):
    assert problems(sheet(tmp_path, line(style='"sad'))) == ["sheet.tsv row 2: unbalanced quotes"]


def test_sheet_that_is_not_utf8(tmp_path):
    path = sheet(tmp_path, line())
    path.write_bytes(path.read_bytes() + b"\xe9")
    (found,) = problems(path)
    assert "the sheet is not UTF-8 text (byte " in found
    assert found.endswith("save it as UTF-8")


def test_all_problems_at_once(tmp_path):
    lines = [line(unit="cms"), "short", line(id="walk", sex="f"), line(id="x", path="")]
    assert problems(sheet(tmp_path, *lines)) == [
        "sheet.tsv row 2, column unit: 'cms' is not one of m, cm, mm, inch, cmu or metres above 0"
        " (did you mean cm, cmu?)",
        "sheet.tsv row 3: 1 cells, expected 22 (one for each column, divided by tabs)",
        "sheet.tsv row 4, column sex: 'f' is not one of male, female",
        "sheet.tsv row 4, column id: 'walk' is already the id of row 2 ('walk')",
        "sheet.tsv row 5, column path: empty, but required",
    ]


# --- faults of one cell --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("cells", "message"),
    [
        ({"id": ""}, "column id: empty, but required"),
        ({"id": "a b"}, "column id: 'a b' may have only letters A-Z, digits, '_', '.' and '-'"),
        ({"id": "../a"}, "column id: '../a' may have only letters A-Z, digits, '_', '.' and '-'"),
        ({"id": ".a"}, "column id: '.a' must begin with a letter or digit"),
        ({"id": "a" * 101}, "and have at most 100 characters"),
        ({"id": "nul.x"}, "column id: 'nul.x' is no file name on Windows"),
        ({"action": ""}, "column action: empty, but required"),
        ({"up_axis": "x"}, "column up_axis: 'x' is not one of y, z"),
        ({"up_axis": ""}, "column up_axis: empty, but a .bvh file does not say it: y, z"),
        ({"unit": ""}, "column unit: empty, but a .bvh file does not say it: m, cm, mm, inch, cmu"),
        ({"unit": "0"}, "column unit: '0' is not one of m, cm, mm, inch, cmu or metres above 0"),
        ({"unit": "nan"}, "column unit: 'nan' is not one of m, cm"),
        ({"rate": "0"}, "column rate: '0' is not a rate in Hz above 0"),
        ({"rate": "inf"}, "column rate: 'inf' is not a rate in Hz above 0"),
        ({"rate": "29,97"}, "'29,97' is not a rate in Hz above 0; write a decimal point"),
        ({"mass_kg": "70000"}, "column mass_kg: '70000' is not a mass of up to 500 kg"),
        ({"sex": "femal"}, "column sex: 'femal' is not one of male, female (did you mean female"),
        ({"first_frame": "-1"}, "column first_frame: '-1' is not a whole number from 0 on"),
        ({"last_frame": "9.5"}, "column last_frame: '9.5' is not a whole number from 0 on"),
        (
            {"first_frame": "9", "last_frame": "8"},
            "column last_frame: 8 lies before first_frame (9",
        ),
        ({"cycles": "0"}, "column cycles: '0' is not a whole number from 1 on"),
        (
            {"level": "physics"},
            "'physics' is not one of kinematic, physical (did you mean physical",
        ),
        (
            {"surface": "stair"},
            "'stair' is not one of level, stairs, ramp, uneven (did you mean st",
        ),
        ({"mirror": "true"}, "column mirror: 'true' is not one of yes, no"),
        (
            {"experiments": "nio,gate"},
            "column experiments: 'gate' is not one of nio, style_machine",
        ),
        ({"skeleton": ""}, "column skeleton: empty; it names the file of config/skeletons"),
        (
            {"dataset": "bandia"},
            "column dataset: 'bandia' is not a dataset of datasets.tsv (did yo",
        ),
        ({"path": "bandai/walk_sda.bvh"}, "is not a file of dataset bandai (did you mean bandai/w"),
        ({"path": "bandai/03_01.amc"}, "'bandai/03.asf' is not a file of dataset bandai (did you"),
        ({"forces": "bandai/f.mot"}, "column forces: 'bandai/f.mot' is not a file of dataset band"),
    ],
)
def test_wrong_cell(tmp_path, cells, message):
    found = one(tmp_path, **cells)
    assert found.startswith("sheet.tsv row 2, column ")
    assert message in found


def test_ids_differ_by_more_than_case(tmp_path):
    assert problems(sheet(tmp_path, line(), line(id="WALK"))) == [
        "sheet.tsv row 3, column id: 'WALK' is already the id of row 2 ('walk')"
    ]


def test_every_missing_local_file_is_listed(tmp_path):
    (tmp_path / "dir.bvh").mkdir()
    names = ["a.bvh", "dir.bvh", "b/c.amc", "x.fbx"]
    rows = [line(id=f"r{n}", dataset="", path=name) for n, name in enumerate(names)]
    assert problems(sheet(tmp_path, *rows)) == [
        f"sheet.tsv row 2, column path: no such file: {tmp_path}/a.bvh",
        f"sheet.tsv row 3, column path: is a folder: {tmp_path}/dir.bvh",
        f"sheet.tsv row 4, column path: no such file: {tmp_path}/b/c.amc",
        f"sheet.tsv row 4, column path: no such file: {tmp_path}/b/c.asf (skeleton of b/c.amc)",
        "sheet.tsv row 5, column path: 'x.fbx' is of no known kind"
        " (.bvh, .amc, .txt, .json, .c3d, .trc)",
        f"sheet.tsv row 5, column path: no such file: {tmp_path}/x.fbx",
    ]


def test_very_long_local_path_is_told(tmp_path):
    name = "a" * 5000 + ".bvh"
    assert "column path: File name too long: " in one(tmp_path, dataset="", path=name)


def test_unknown_embedded_clip_and_skeleton(tmp_path):
    path = sheet(tmp_path, line(dataset="embedded", path="humanoid3d_wlak.txt", skeleton="bvh"))
    found = problems(path, embedded_files=["humanoid3d_walk.txt"], skeletons=["bandai"])
    assert found == [
        "sheet.tsv row 2, column skeleton: 'bvh' is not one of the skeletons",
        "sheet.tsv row 2, column path: 'humanoid3d_wlak.txt' is not an embedded clip"
        " (did you mean humanoid3d_walk.txt?)",
    ]


# --- the shipped sheets --------------------------------------------------------------------


def shipped(name: str):
    pin = read_wheel_pin(ROOT / "config" / "embedded.yaml")
    datasets = read_datasets(ROOT / "config" / "datasets.tsv")
    return read_sheet(ROOT / "config" / name, datasets, embedded_files=pin.names)


def test_embedded_sheet():
    rows = shipped("motions.embedded.tsv")
    assert len(rows) == 15
    assert all(row.path == f"humanoid3d_{row.id}.txt" for row in rows)
    assert {row.id: row.cycles for row in rows if row.cycles > 1} == {"walk": 3, "run": 4}


def test_full_sheet_covers_every_clip_once():
    rows = shipped("motions.full.tsv")
    datasets = read_datasets(ROOT / "config" / "datasets.tsv")
    static = {row.static for row in rows if row.static}
    kinds = (".bvh", ".amc", ".trc", ".c3d")
    clips = {key for key in datasets if key[1].endswith(kinds) and key[1] not in static}
    found = [(row.dataset, row.path) for row in rows]
    # the level walk of one subject is a clip and, for the stairs, the static trial too
    assert set(found) - clips == {(r.dataset, r.path) for r in rows if r.path in static}
    assert clips <= set(found)
    assert len(found) == len(set(found)) == 365


def test_full_sheet_states_units_and_corrects_the_known_rates():
    rows = {row.id: row for row in shipped("motions.full.tsv")}
    skeletons = [row for row in rows.values() if not row.path.endswith((".trc", ".c3d"))]
    assert len(skeletons) == 348
    assert all(row.unit in METRES for row in skeletons)
    rates = {row.id: row.rate_hz for row in rows.values() if row.rate_hz}
    assert rates["cmu_16_01"] == 120
    assert {rates[name] for name in rates if name.startswith("salsa")} == {60}
    assert {rates[name] for name in rates if name.startswith("cmu_amc")} == {120}
    assert len(rates) == 1 + 4 + 6
    assert {row.first_frame for row in rows.values() if row.skeleton == "cmu_daz"} == {5}


def test_no_trial_enters_the_experiments_twice():
    rows = [row for row in shipped("motions.full.tsv") if row.experiments]
    trials = [row.id.rsplit("_", 2)[1:] for row in rows if row.id.startswith(("cmu_", "salsa_"))]
    assert len(trials) == len({tuple(trial) for trial in trials})
