"""`read_mot`, and force plates out of storage files."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from marker_person import NAMES, forces_file
from motionstyle.errors import MotionStyleError
from motionstyle.mocap.formats.mot import PlateColumns, forces_from_mot, read_mot

MIRROR = Path(__file__).parents[3] / "shared" / "mocap"
PLATES = {
    "right": PlateColumns("1_ground_force_v", "1_ground_force_p", "1_ground_torque_"),
    "left": PlateColumns("ground_force_v", "ground_force_p", "ground_torque_"),
}


def test_it_reads_names_values_and_angles_unit(tmp_path):
    table = read_mot(forces_file(tmp_path))
    assert table.columns[0] == "time"
    assert table.columns[1:] == tuple(NAMES)
    assert table.in_degrees
    np.testing.assert_allclose(table.column("ground_force_vy"), 700)
    with pytest.raises(MotionStyleError, match="did you mean ground_force_vy"):
        table.column("ground_force_y")


def test_the_older_header_is_understood(tmp_path):
    header = f"name grf.mot\ndatacolumns {len(NAMES) + 1}\ndatarows 6\nrange 0.5 0.505\n"
    table = read_mot(forces_file(tmp_path, header=header))
    assert table.values.shape == (6, len(NAMES) + 1)
    assert not table.in_degrees


def test_plates_by_name_and_no_centre_without_load(tmp_path):
    record = forces_from_mot(read_mot(forces_file(tmp_path)), PLATES)
    assert record.names == ("right", "left")
    assert record.rate_hz == 1000.0
    assert record.start_s == 0.5
    np.testing.assert_allclose(record.force[1], np.tile([0, 700, 0], (6, 1)))
    np.testing.assert_allclose(record.centre[1], np.tile([0.1, 0, 0.2], (6, 1)))
    assert np.isnan(record.centre[0]).all()
    np.testing.assert_allclose(record.moment[1, :, 1], 3.0)


def test_centres_in_millimetres(tmp_path):
    record = forces_from_mot(read_mot(forces_file(tmp_path)), PLATES, position_unit="mm")
    np.testing.assert_allclose(record.centre[1, 0], [1e-4, 0, 2e-4])
    np.testing.assert_allclose(record.moment[1, 0, 1], 3e-3)


def test_a_flipped_plate_is_refused(tmp_path):
    table = read_mot(forces_file(tmp_path, sign=-1.0))
    with pytest.raises(
        MotionStyleError, match=r"negative on plate 'left' \(-700 N\).*flip the sign"
    ):
        forces_from_mot(table, PLATES)


def test_missing_columns_are_named_with_near_matches(tmp_path):
    names = [n.replace("1_ground_force_v", "2_ground_force_v") for n in NAMES]
    with pytest.raises(MotionStyleError, match="lacks the force columns '1_ground_force_vx'") as e:
        forces_from_mot(read_mot(forces_file(tmp_path, names=names)), PLATES)
    assert "did you mean" in str(e.value)


@pytest.mark.parametrize(
    ("header", "expected"),
    [
        (f"nRows=7\nnColumns={len(NAMES) + 1}\n", ["line 1", "7 rows, but 6 follow"]),
        ("nRows=6\nnColumns=3\n", ["line 2", "3 column names"]),
        ("version=1\n", ["nrows=", "ncolumns="]),
    ],
)
def test_counts_that_disagree_are_refused(tmp_path, header, expected):
    with pytest.raises(MotionStyleError) as caught:
        read_mot(forces_file(tmp_path, header=header))
    assert all(part in str(caught.value) for part in expected), str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("endheader", "end", "no line 'endheader'"),
        ("time", "t", "the first column is 't'"),
        ("7.000000e+02", "7,0", "line 8: ground_force_vy is '7,0', with a decimal comma"),
        ("7.000000e+02", "", "18 numbers, expected 19"),
        ("5.010000e-01", "4.010000e-01", "line 9: time 0.401 s follows 0.5 s"),
        ("ground_force_vx", "ground_force_vy", "'ground_force_vy' stands there 2 times"),
    ],
)
def test_faults_are_refused(tmp_path, old, new, expected):
    path = forces_file(tmp_path)
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(MotionStyleError) as caught:
        read_mot(path)
    assert expected in str(caught.value)


def test_uneven_sampling_is_refused(tmp_path):
    path = forces_file(tmp_path)
    path.write_text(path.read_text().replace("5.050000e-01", "5.090000e-01"))
    with pytest.raises(MotionStyleError, match="uneven sampling"):
        forces_from_mot(read_mot(path), PLATES)


@pytest.mark.mirror
@pytest.mark.skipif(not MIRROR.is_dir(), reason="no mirror folder")
def test_the_mirrors_files_have_the_rows_of_its_manifest():
    with (MIRROR / "manifest.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["path"].endswith(".mot")]
    assert len(rows) == 14
    for row in rows:
        assert len(read_mot(MIRROR / row["path"]).values) == int(row["frames"])
