"""`read_trc`: what it understands, what it refuses and where, and the mirror's files."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from motionstyle.errors import MotionStyleError
from motionstyle.mocap.formats.marker_clip import MarkerClip, upright
from motionstyle.mocap.formats.trc import read_trc

MIRROR = Path(__file__).parents[3] / "shared" / "mocap"
GOOD = """\
PathFileType\t4\t(X/Y/Z)\twalk.trc
DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames
100.0\t100.0\t3\t2\tmm\t100.0\t1\t3
Frame#\tTime\tR.ASIS\t\t\tC7\t\t\t
\t\tX1\tY1\tZ1\tX2\tY2\tZ2

1\t0.00\t1\t2\t3\t4\t5\t6
2\t0.01\t1e1\t2.5E+2\t-3\t\t\t
3\t0.02\t7\t8\t9\t10\t11\t12
"""


def write(folder, text, name="walk.trc"):
    path = folder / name
    path.write_bytes(text.encode())
    return path


def refused(folder, old, new, count=1):
    assert old in GOOD
    with pytest.raises(MotionStyleError) as caught:
        read_trc(write(folder, GOOD.replace(old, new, count)))
    return str(caught.value)


def test_it_reads_positions_in_metres_and_gaps_as_nan(tmp_path):
    clip = read_trc(write(tmp_path, GOOD))
    assert clip.labels == ("R.ASIS", "C7")
    assert clip.rate_hz == 100.0
    assert clip.unit == "mm"
    np.testing.assert_allclose(clip.path("R.ASIS")[1], [0.01, 0.25, -0.003])
    assert np.isnan(clip.path("C7")[1]).all()
    np.testing.assert_allclose(clip.path("C7")[2], [0.010, 0.011, 0.012])


def test_quirks_of_exporters_change_nothing(tmp_path):
    plain = read_trc(write(tmp_path, GOOD))
    doubled = GOOD.replace("100.0\t100.0\t3\t2\tmm", "  100.0\t\t  100.0\t\t  3\t\t 2\t\t mm")
    for text in (
        GOOD.replace("\n", "\r\n"),
        doubled,
        GOOD.replace("Z2\n\n", "Z2\n"),
        GOOD.replace("6\n", "6\t\t\n"),
        GOOD.replace("\t-3\t\t\t\n", "\t-3\t0\t0\t0\n"),
        GOOD.replace("\t-3\t\t\t\n", "\t-3\tnan\tnan\tnan\n"),
        GOOD.replace("\t-3\t\t\t\n", "\t-3\n"),
        GOOD.replace("Time", "Times"),
    ):
        other = read_trc(write(tmp_path, text))
        assert other.labels == plain.labels
        np.testing.assert_array_equal(other.positions, plain.positions)


def test_the_clock_of_the_file_is_kept(tmp_path):
    text = GOOD.replace("\t0.00", "\t0.23").replace("\t0.01", "\t0.24").replace("\t0.02", "\t0.25")
    clip = read_trc(write(tmp_path, text))
    assert clip.start_s == pytest.approx(0.23)
    assert clip.window(1, 2).start_s == pytest.approx(0.24)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("\t3\t2\tmm", "\t4\t2\tmm", ["line 3", "NumFrames is 4", "3 frames follow"]),
        ("\t3\t2\tmm", "\t3\t5\tmm", ["line 3", "NumMarkers is 5", "2 markers are named"]),
        ("\tmm\t", "\tfurlong\t", ["line 3", "'furlong'", "mm, cm, m"]),
        ("100.0\t100.0", "0\t100.0", ["line 3", "DataRate is 0"]),
        ("Units", "Unit", ["line 2", "lacks Units", "did you mean Unit"]),
        ("C7", "R.ASIS", ["line 4", "'R.ASIS' 2 times"]),
        ("2.5E+2", "2,5", ["line 8", "R.ASIS y", "decimal comma"]),
        ("2.5E+2", "x", ["line 8", "R.ASIS y", "'x'"]),
        ("10\t11\t12", "10\t\t12", ["line 9", "C7 has 2 of its 3"]),
        ("10\t11\t12", "10\t11\t12\t13", ["line 9", "9 cells, expected 8"]),
        ("3\t0.02", "3\t0.09", ["line 9", "0.09 s follows 0.01 s", "0.01 s"]),
        ("3\t0.02\t7\t8\t9\t10\t11\t12", "3\t0.02", ["line 9", "2 cells", "cut off"]),
        ("PathFileType", "HIERARCHY", ["line 1", "'HIERARCHY", "TRC"]),
    ],
)
def test_faults_are_refused_with_their_line(tmp_path, old, new, expected):
    message = refused(tmp_path, old, new)
    assert all(part in message for part in ["walk.trc", *expected]), message


def test_all_faults_come_at_once(tmp_path):
    text = GOOD.replace("2.5E+2", "x").replace("\t11\t", "\ty\t")
    with pytest.raises(MotionStyleError, match="2 problems") as caught:
        read_trc(write(tmp_path, text))
    assert "line 8" in str(caught.value)
    assert "line 9" in str(caught.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(MotionStyleError, match=r"none\.trc"):
        read_trc(tmp_path / "none.trc")


def test_z_up_turns_to_y_up_without_mirroring():
    clip = MarkerClip(("a",), np.array([[[1.0, 2.0, 3.0]]]), 100.0, "x")
    np.testing.assert_array_equal(upright(clip, "z").positions[0, 0], [1, 3, -2])
    np.testing.assert_array_equal(upright(clip, "y").positions[0, 0], [1, 2, 3])
    with pytest.raises(MotionStyleError, match="up_axis"):
        upright(clip, "x")


@pytest.mark.mirror
@pytest.mark.skipif(not MIRROR.is_dir(), reason="no mirror folder")
def test_the_mirrors_files_have_the_frames_and_markers_of_its_manifest():
    with (MIRROR / "manifest.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["path"].endswith(".trc")]
    assert len(rows) == 17
    for row in rows:
        clip = read_trc(MIRROR / row["path"])
        assert clip.frames == int(row["frames"])
        assert len(clip.labels) == int(row["joints_or_channels"])
        assert clip.rate_hz == float(row["fps"])
