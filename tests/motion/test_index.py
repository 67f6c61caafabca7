"""The index of motions, and tables that are the same bytes everywhere."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionstyle.errors import MotionStyleError
from motionstyle.motion.index import MOTION_COLUMNS, index_motions
from motionstyle.motion.storage import save_failure, save_motion, sidecar_path
from motionstyle.tables import format_cell, read_table, write_table


@pytest.fixture
def root(tmp_path, plain_motion):
    few = plain_motion.window(0, 9)

    def put(kind, name, **provenance):
        motion = replace(few, kind=kind, id=name, provenance=provenance)
        save_motion(tmp_path / "motions" / kind / f"{name}.npz", motion)

    put("nio", "b", example="plain", style="sad", edit="none", footprints="curve")
    put("captured", "walk2", dataset="cmu", subject="08", action="walk", planted=False)
    put("captured", "walk10", dataset="cmu", source_frames="0-9", experiments=["nio"])
    put("planted", "slope", planted=True)
    save_failure(
        tmp_path / "motions" / "nio" / "a.npz", "a", "nio", "the solver, after 3 tries", edit="limp"
    )
    return tmp_path


def test_rows_are_sorted_by_kind_and_id(root):
    rows = index_motions(root, "embedded")
    assert [(row["kind"], row["id"]) for row in rows] == [
        *(("captured", "walk10"), ("captured", "walk2")),
        *(("nio", "a"), ("nio", "b"), ("planted", "slope")),
    ]
    assert all(tuple(row) == MOTION_COLUMNS for row in rows)
    assert {row["config"] for row in rows} == {"embedded"}


def test_what_a_row_says(root):
    rows = {row["id"]: row for row in index_motions(root, "x")}
    walk, synthesis = rows["walk2"], rows["b"]
    assert (walk["dataset"], walk["subject"], walk["action"]) == ("cmu", "08", "walk")
    assert (walk["frames"], walk["rate_hz"]) == (10, 120.0)
    assert walk["path"] == "motions/captured/walk2.npz"
    assert (root / walk["path"]).is_file()
    assert (walk["status"], walk["reason"], walk["style"]) == ("ok", None, None)
    assert [synthesis[k] for k in ("example", "style", "edit", "footprints")] == [
        *("plain", "sad", "none", "curve"),
    ]
    assert rows["walk10"]["source_frames"] == "0-9"
    assert {name: row["planted"] for name, row in rows.items()} == {
        **{"walk2": False, "walk10": False, "a": False, "b": False},
        "slope": True,
    }


def test_a_failed_motion_is_a_row_with_its_reason(root):
    row = next(row for row in index_motions(root, "x") if row["id"] == "a")
    assert row["status"] == "failed"
    assert row["reason"] == "the solver, after 3 tries"
    assert row["edit"] == "limp"
    assert row["frames"] is None
    assert row["rate_hz"] is None


def test_only_the_files_asked_for_are_listed(root):
    asked = [root / "motions/nio/b.npz", str(root / "motions/captured/walk2.npz")]
    rows = index_motions(asked, "x")
    whole = {row["id"]: row for row in index_motions(root, "x")}
    assert rows == [whole["walk2"], whole["b"]]
    assert index_motions([], "x") == []


def test_the_arrays_are_not_read(root):
    before = index_motions(root, "x")
    for path in (root / "motions").glob("*/*.npz"):
        path.write_bytes(b"")
    assert index_motions(root, "x") == before


def test_no_motions_are_no_rows(tmp_path):
    assert index_motions(tmp_path, "x") == []
    write_table(tmp_path / "motions.csv", MOTION_COLUMNS, [])
    assert (tmp_path / "motions.csv").read_text() == ",".join(MOTION_COLUMNS) + "\n"
    assert read_table(tmp_path / "motions.csv") == []


@pytest.mark.parametrize("text", ["", "{", "[]", '{"schema_version": 1, "id": "a"}'])
def test_a_damaged_sidecar_is_named(root, text):
    path = root / "motions" / "captured" / "walk2.json"
    path.write_text(text)
    with pytest.raises(MotionStyleError, match=r"captured.walk2\.json.*run Snakemake again"):
        index_motions(root, "x")


def test_another_schema_version_is_named(root):
    path = sidecar_path(root / "motions" / "nio" / "a.npz")
    path.write_text(json.dumps(json.loads(path.read_text()) | {"schema_version": 7}))
    with pytest.raises(MotionStyleError, match=r"nio.a\.json.*schema version 7"):
        index_motions(root, "x")


def test_the_index_goes_through_a_table(root):
    path = root / "tables" / "motions.csv"
    write_table(path, MOTION_COLUMNS, index_motions(root, "embedded"))
    rows = {row["id"]: row for row in read_table(path)}
    assert list(rows["a"]) == list(MOTION_COLUMNS)
    assert rows["a"]["reason"] == "the solver, after 3 tries"
    assert (rows["a"]["frames"], rows["b"]["frames"], rows["b"]["rate_hz"]) == ("", "10", "120")
    assert (rows["slope"]["planted"], rows["b"]["planted"]) == ("yes", "no")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, ""),
        (math.nan, ""),
        (np.float64("nan"), ""),
        (True, "yes"),
        (False, "no"),
        (np.bool_(True), "yes"),
        (np.False_, "no"),
        (0, "0"),
        (12345678901234567890, "12345678901234567890"),
        (np.int64(-7), "-7"),
        (np.uint8(200), "200"),
        (0.1, "0.1"),
        (1 / 3, "0.333333"),
        (2.0, "2"),
        (-0.0, "0"),
        (123456.0, "123456"),
        (1234567.0, "1.23457e+06"),
        (1.5e-7, "1.5e-07"),
        (np.float32(0.1), "0.1"),
        (math.inf, "inf"),
        (-math.inf, "-inf"),
        ("", ""),
        ("nan", "nan"),
        (" 0,5 ", " 0,5 "),
    ],
)
def test_cells(value, text):
    assert format_cell(value) == text


@pytest.mark.parametrize("value", [[1], {}, b"x", 1j, np.zeros(2), object()])
def test_what_is_no_cell_is_refused(value):
    with pytest.raises(TypeError, match="a table cell cannot hold"):
        format_cell(value)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_keep_six_digits_and_no_superfluous_ones(value):
    text = format_cell(value)
    assert float(text) == pytest.approx(value, rel=5.1e-6, abs=0)
    assert format_cell(float(text)) == text
    assert len(text.lstrip("-").split("e")[0].replace(".", "").lstrip("0")) <= 6


text_cells = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=12)


@given(
    st.lists(text_cells, min_size=1, max_size=4, unique=True).filter(
        lambda names: not names[0].startswith("\ufeff")
    ),
    st.data(),
)
def test_any_text_comes_back(tmp_path_factory, columns, data):
    path = tmp_path_factory.mktemp("tables") / "t.csv"
    row = st.fixed_dictionaries(dict.fromkeys(columns, text_cells))
    rows = data.draw(st.lists(row, max_size=3))
    write_table(path, columns, rows)
    assert read_table(path) == rows


def test_bytes_of_a_table(tmp_path):
    rows = [
        {"id": "ä,1", "x": 0.5, "ok": True},
        {"ok": False, "id": 'say "hi"'},
        {"id": "two\nlines", "x": math.nan},
    ]
    write_table(tmp_path / "t.csv", ("id", "x", "ok"), rows)
    expected = 'id,x,ok\n"ä,1",0.5,yes\n"say ""hi""",,no\n"two\nlines",,\n'
    assert (tmp_path / "t.csv").read_bytes() == expected.encode()


def test_a_table_does_not_depend_on_the_order_of_a_row_s_keys(tmp_path):
    write_table(tmp_path / "a.csv", ("x", "y"), [{"x": 1, "y": 2}])
    write_table(tmp_path / "b.csv", ("x", "y"), [{"y": 2, "x": 1}])
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()


def test_pandas_reads_the_same_cells(tmp_path):
    rows = [{"id": 'a "b", c', "x": 1.25}, {"id": "", "x": None}, {"id": "d\ne", "x": 3}]
    write_table(tmp_path / "t.csv", ("id", "x"), rows)
    frame = pd.read_csv(tmp_path / "t.csv", dtype=str, keep_default_na=False)
    assert frame.to_dict("records") == read_table(tmp_path / "t.csv")


def test_a_key_that_is_no_column_is_refused_and_nothing_is_written(tmp_path):
    with pytest.raises(ValueError, match="colour is no column"):
        write_table(tmp_path / "t.csv", ("id",), [{"id": "a"}, {"id": "b", "colour": "red"}])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("columns", [(), ("a", "b", "a")])
def test_columns_must_be_named_once(tmp_path, columns):
    with pytest.raises(ValueError, match="each once"):
        write_table(tmp_path / "t.csv", columns, [])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "line 1 must name the columns"),
        (b"a,a\n1,2\n", "line 1 must name the columns"),
        (b"a,b\n1,2\n3\n", "line 3 has 1 cells, expected 2"),
        (b"a,b\n1,2,3\n", "line 2 has 3 cells, expected 2"),
        (b"a,b\n\xff,2\n", "not a readable table"),
        (b'a,b\n"1,2\n', "not a readable table"),
    ],
)
def test_a_damaged_table_is_named(tmp_path, content, message):
    path = tmp_path / "t.csv"
    path.write_bytes(content)
    with pytest.raises(MotionStyleError, match=rf"t\.csv: {message}"):
        read_table(path)


def test_a_missing_table_is_named(tmp_path):
    with pytest.raises(MotionStyleError, match=r"none\.csv: not a readable table"):
        read_table(tmp_path / "none.csv")


def test_tables_of_spreadsheet_programs_are_read(tmp_path):
    (tmp_path / "t.csv").write_bytes(b"\xef\xbb\xbfa,b\r\n1,2\r\n\r\n")
    assert read_table(tmp_path / "t.csv") == [{"a": "1", "b": "2"}]
