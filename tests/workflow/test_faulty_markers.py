"""What a user gets wrong about marker files: each clip is a row with one clear reason."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from walkers import Project

from marker_person import forces_file, synthetic_markers, write_c3d, write_set, write_trc

pytestmark = pytest.mark.workflow
RATE, FRAMES = 100.0, 24


def relabelled(clip, change):
    return replace(clip, labels=tuple(change(label) for label in clip.labels))


def other_side(label):
    ends = {"_r": "_l", "_l": "_r"}
    return label[:-2] + ends[label[-2:]] if label[-2:] in ends else label


def unseen(clip, label):
    positions = np.array(clip.positions)
    positions[:, clip.labels.index(label)] = np.nan
    return replace(clip, positions=positions)


# what the user got wrong: (change of the clip, cells of the sheet, what the reason must say)
TRC = {
    "never_seen": (lambda c: unseen(c, "M_heel_r"), {}, ["'M_heel_r'", "never seen"]),
    "swapped": (lambda c: relabelled(c, other_side), {}, ["right and left are swapped"]),
    "in_metres": (lambda c: c, {"unit": "m"}, ["ASIS markers are", "is the unit mm"]),
    "z_up": (lambda c: c, {"up_axis": "z"}, ["pelvis is not above the heels", "up_axis"]),
    "flipped_plate": (
        lambda c: c,
        {"forces": "flipped.mot"},
        ["vertical force is negative on plate 'left'", "flip the sign"],
    ),
    "good": (lambda c: c, {"forces": "grf.mot"}, []),
}


@pytest.fixture(scope="module")
def run(tmp_path_factory, code, plain_body, standing):
    """A still person's clips, six of TRC and two of C3D, read with a made-up marker set."""
    project = Project(tmp_path_factory.mktemp("markers") / "own", code)
    sets = project.folder / "sets"
    sets.mkdir(parents=True)
    write_set(sets)
    clip = synthetic_markers(plain_body, np.tile(standing, (FRAMES, 1)), RATE)
    forces_file(project.folder, rows=200)
    forces_file(project.folder, rows=200, sign=-1.0, name="flipped.mot")
    cells = {"skeleton": "lab", "unit": "", "up_axis": "y"}
    for id, (change, changes, _reason) in TRC.items():
        write_trc(project.folder / f"{id}.trc", change(clip))
        project.add(f"{id}.trc", None, **{**cells, **changes})
    lacking = synthetic_markers(
        plain_body, np.tile(standing, (FRAMES, 1)), RATE, without=("asis_l",)
    )
    z_up = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    for id, some in (("lacking", lacking), ("cut", clip)):
        path = project.folder / f"{id}.c3d"
        write_c3d(path, 1000 * some.positions @ z_up.T, some.labels, rate=RATE)
        project.add(path.name, None, **{**cells, "up_axis": "z"})
    path.write_bytes(path.read_bytes()[:-4000])
    done = project.run("out/tables/clips.csv", markersets=str(sets))
    assert done.code == 0, done.output
    return project


def test_a_good_clip_among_them_is_a_motion(run):
    row = run.clips()["good"]
    assert (row["status"], row["reason"]) == ("ok", "")
    assert float(row["marker_rms_cm"]) < 1
    assert (row["mass_source"], row["measured_on"]) == ("default", "good.trc")


@pytest.mark.parametrize("id", [id for id, (_c, _s, reason) in TRC.items() if reason])
def test_a_faulty_trc_clip_is_a_row_with_a_reason(run, id):
    row = run.clips()[id]
    assert row["status"] == "failed"
    for part in TRC[id][2]:
        assert part in row["reason"]
    assert "\n" not in row["reason"]


def test_a_c3d_file_without_needed_markers_names_them(run):
    row = run.clips()["lacking"]
    assert row["status"] == "failed"
    assert "needed marker 'M_asis_l' (asis_l) is missing" in row["reason"]


def test_a_c3d_file_that_is_cut_off_says_so(run):
    row = run.clips()["cut"]
    assert row["status"] == "failed"
    assert f"declares {FRAMES} frames" in row["reason"]
    assert "cut off" in row["reason"]


def test_a_mass_that_is_not_positive_stops_before_any_job(tmp_path, code):
    project = Project(tmp_path / "own", code)
    project.add("good.trc", "", skeleton="rajagopal", unit="", mass_kg=0)
    done = project.run("-n")
    assert done.code != 0
    assert "mass_kg" in done.output
    assert "a mass of up to 500 kg" in done.output
