"""`read_c3d` and its force plates, on files written here and on the mirror's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from marker_person import RATIO, write_c3d
from motionstyle.errors import MotionStyleError
from motionstyle.mocap.formats.c3d import body_mass, read_c3d, read_c3d_forces

MIRROR = Path(__file__).parents[3] / "shared" / "mocap"
needs_mirror = pytest.mark.skipif(not MIRROR.is_dir(), reason="no mirror folder")
FRAMES = 12


def some_points(markers=2):
    return 100.0 + np.arange(FRAMES * markers * 3, dtype=float).reshape(FRAMES, markers, 3)


def test_it_reads_points_in_metres_without_the_subjects_prefix(tmp_path):
    path = write_c3d(tmp_path / "a.c3d", some_points(), ["Me:LASI", "Me:RASI"])
    clip = read_c3d(path)
    assert clip.labels == ("LASI", "RASI")
    assert clip.rate_hz == 100.0
    np.testing.assert_allclose(clip.positions, some_points() / 1000, rtol=1e-6)


def test_points_not_seen_are_nan(tmp_path):
    points = some_points()
    points[3, 1] = 0.0
    points[5, 0] = np.nan
    clip = read_c3d(write_c3d(tmp_path / "a.c3d", points, ["A", "B"]))
    missing = np.isnan(clip.positions).all(axis=-1)
    assert np.argwhere(missing).tolist() == [[3, 1], [5, 0]]


def test_doubled_labels_go_by_their_descriptions(tmp_path):
    labels, texts = ["RKNE", "RKNE", "C7"], ["R.Knee", "R.Knee.Medial", "neck"]
    path = write_c3d(tmp_path / "a.c3d", some_points(3), labels, descriptions=texts)
    assert read_c3d(path).labels == ("R.Knee", "R.Knee.Medial", "C7")


def test_doubled_labels_that_nothing_tells_apart_are_refused(tmp_path):
    path = write_c3d(tmp_path / "a.c3d", some_points(), ["RKNE", "RKNE"])
    with pytest.raises(MotionStyleError, match="'RKNE' stands for 2 points"):
        read_c3d(path)


def test_an_unknown_unit_is_refused(tmp_path):
    path = write_c3d(tmp_path / "a.c3d", some_points(), ["A", "B"], unit="ft")
    with pytest.raises(MotionStyleError, match=r"POINT:UNITS is 'ft', expected one of mm, cm, m"):
        read_c3d(path)


def test_other_files_are_refused(tmp_path):
    (tmp_path / "b.c3d").write_bytes(b"not at all")
    with pytest.raises(MotionStyleError, match=r"b\.c3d: not a C3D file"):
        read_c3d(tmp_path / "b.c3d")
    with pytest.raises(MotionStyleError, match="cannot read"):
        read_c3d(tmp_path / "none.c3d")


def test_a_file_cut_off_in_its_header_is_refused(tmp_path):
    path = write_c3d(tmp_path / "a.c3d", some_points(), ["A", "B"])
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(MotionStyleError, match=r"a\.c3d"):
        read_c3d(path)


def test_a_file_cut_off_in_its_frames_is_refused(tmp_path):
    """ezc3d itself reads what is left as if that were all."""
    points = np.tile(some_points(), (20, 1, 1))
    path = write_c3d(tmp_path / "a.c3d", points, ["A", "B"])
    assert read_c3d(path).frames == len(points)
    path.write_bytes(path.read_bytes()[:-3000])
    with pytest.raises(MotionStyleError, match=r"declares 240 frames, but \d+ follow.*cut off"):
        read_c3d(path)


def plate_channels(force, at, twist):
    """Channels of a type-2 plate for a force on the person (lab axes) at a point, N and mm.

    The plate's x points along the lab's y, its y along x and its z down; its origin is the middle
    of its surface.
    """
    turn = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    lever = np.asarray(at, dtype=float) - [300, 200, 0]
    moment = np.add(np.cross(lever, force), [0, 0, twist])
    one = np.concatenate([turn @ force, turn @ moment])
    return np.tile(one, (FRAMES * RATIO, 1))


def test_a_plate_gives_force_centre_and_free_moment(tmp_path):
    force, at = np.array([50.0, -20.0, 700.0]), np.array([350.0, 120.0, 0.0])
    plate = plate_channels(force, at, 4000.0)
    path = write_c3d(tmp_path / "a.c3d", some_points(), ["A", "B"], plate=plate)
    record = read_c3d_forces(path)
    assert record.names == ("1",)
    assert record.rate_hz == 1000.0
    np.testing.assert_allclose(record.force[0, 5], force, rtol=1e-4)
    np.testing.assert_allclose(record.centre[0, 5], at / 1000, atol=1e-5)
    np.testing.assert_allclose(record.moment[0, 5], [0, 0, 4.0], atol=1e-3)
    np.testing.assert_allclose(record.corners[0].max(axis=0), [0.6, 0.4, 0.0])


def test_a_flipped_plate_is_refused(tmp_path):
    plate = -plate_channels(np.array([0.0, 0.0, 700.0]), [350.0, 120.0, 0.0], 0.0)
    path = write_c3d(tmp_path / "a.c3d", some_points(), ["A", "B"], plate=plate)
    with pytest.raises(MotionStyleError, match=r"negative on plate '1' \(-700 N\)"):
        read_c3d_forces(path)


def test_no_plates_is_none(tmp_path):
    path = write_c3d(tmp_path / "a.c3d", some_points(), ["A", "B"])
    assert read_c3d_forces(path) is None
    assert body_mass(path) is None


@pytest.mark.mirror
@needs_mirror
@pytest.mark.parametrize(
    ("name", "frames", "markers", "plates", "mass"),
    [
        ("pycgm/Movement_trial.c3d", 323, 239, 4, 85.0),
        ("bmc/Gait.c3d", 487, 33, 2, None),
        ("cmu/c3d/cmu_02_05.c3d", 1854, 41, 0, None),
    ],
)
def test_the_mirrors_files(name, frames, markers, plates, mass):
    clip = read_c3d(MIRROR / name)
    assert clip.positions.shape == (frames, markers, 3)
    assert body_mass(MIRROR / name) == mass
    record = read_c3d_forces(MIRROR / name)
    assert (0 if record is None else len(record.names)) == plates
    if record is not None:  # upward, and the centres of pressure lie on their plates
        assert record.force[..., 2].mean() > 0
        low, high = record.corners.min(axis=1), record.corners.max(axis=1)
        for centre, a, b in zip(record.centre, low, high, strict=True):
            at = np.nanmedian(centre, axis=0)
            assert (at >= a - 0.01).all()
            assert (at <= b + 0.01).all()
