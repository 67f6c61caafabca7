"""Faults 1 to 6: what a user gets wrong about clips, sheet and configuration."""

from __future__ import annotations

import pytest
from walkers import FRAMES, Project, bvh_text

from motionstyle.motion.storage import read_sidecar

pytestmark = pytest.mark.workflow


def edited(change) -> str:
    """Return the walker's BVH with its rows of numbers changed in place."""
    head, _, data = bvh_text().partition("Frame Time:")
    time, *rows = data.strip().split("\n")
    rows = [row.split() for row in rows]
    change(rows)
    return f"{head}Frame Time:{time}\n" + "\n".join(" ".join(row) for row in rows) + "\n"


def not_a_number(rows):
    rows[20][7] = "nan"


def frozen(rows):
    rows[20:32] = [rows[20]] * 12


def flipped(rows):
    rows[25][3 + 3 * 2] = str(float(rows[25][3 + 3 * 2]) + 180.0)  # Chest about z, one frame


CUT = bvh_text().rsplit("\n", 3)[0] + "\n"
FAULTY = {
    # what the user got wrong: (content, cells of the sheet, what the reason must say)
    "cut": (CUT, {}, [f"declares {FRAMES} rows", "has 46"]),
    "empty": ("", {}, ["empty"]),
    "nan": (edited(not_a_number), {}, ["nan", "frame 20"]),
    "in_metres": (bvh_text(), {"unit": "m"}, ["wrong unit", "'cm'"]),
    "z_up": (bvh_text(z_up=True), {"up_axis": "y"}, ["up axis"]),
    "too_fast": (bvh_text(claimed_rate=600), {}, ["m/s at 600 Hz", "lower frame rate"]),
    "renamed": (
        bvh_text(rename={"LeftHip": "LeftHipp", "Chest": "Torso"}),
        {},
        ["lacks joint 'LeftHip' (did you mean LeftHipp", "lacks joint 'Chest'", "'Torso'"],
    ),
    "past_end": (bvh_text(), {"last_frame": FRAMES}, [f"last_frame is {FRAMES}", "0 to 47"]),
}


@pytest.fixture(scope="module")
def faulty(tmp_path_factory, code):
    """Eight faulty clips, the first rows of the sheet, then three that can be used."""
    project = Project(tmp_path_factory.mktemp("faulty") / "own", code)
    for id, (content, cells, _) in FAULTY.items():
        project.add(f"{id}.bvh", content, experiments="gait", mirror="yes", **cells)
    project.add("good.bvh", bvh_text())
    project.add("frozen.bvh", edited(frozen))
    project.add("flipped.bvh", edited(flipped))
    return project, project.run()


@pytest.mark.parametrize("id", FAULTY)
def test_faults_01_02_04_05_of_clips_are_rows_with_a_reason(faulty, id):
    """Fault 1 malformed file, 2 not a number, 4 unit, axis and rate, 5 joint names."""
    project, run = faulty
    row = project.clips()[id]
    assert row["status"] == "failed"
    for words in FAULTY[id][2]:
        assert words.lower() in row["reason"].lower()
    assert row["speed_mps"] == row["frames"] == ""
    assert read_sidecar(project.results / f"motions/captured/{id}.npz")["reason"] == row["reason"]
    assert f"{id}: {row['reason']}".splitlines()[0] in run.output


def test_fault_01_a_malformed_clip_leaves_all_others_and_the_report(faulty):
    project, run = faulty
    assert run.code != 0
    assert f"{len(FAULTY)} of {len(FAULTY) + 3} clips failed; all else is done" in run.output
    assert "Traceback" not in run.output
    assert {id for id, row in project.clips().items() if row["status"] == "ok"} == {
        *("good", "frozen", "flipped")
    }
    assert (project.results / "report.html").stat().st_size > 10_000
    assert not (project.results / "status/clips.ok").exists()
    assert not project.leftovers()


def test_fault_02_repaired_frames_are_counted_and_frozen_ones_named(faulty):
    rows = faulty[0].clips()
    assert rows["good"]["repaired_frames"] == "0"
    assert rows["flipped"]["repaired_frames"] == "1"
    assert "Chest in frame 25" in rows["flipped"]["warnings"]
    assert "frames 20 to 31" in rows["frozen"]["warnings"]


def test_fault_02_nothing_is_repaired_unless_the_configuration_says_so(faulty, tmp_path):
    strict = faulty[0].copy(tmp_path / "strict")
    strict.rows = {id: strict.rows[id] for id in ("good", "frozen", "flipped")}
    strict.write_sheet()
    (strict.folder / "strict.yaml").write_text("retarget: {repair: false}\n")
    run = strict.run("out/tables/clips.csv", "--configfile", str(strict.folder / "strict.yaml"))
    assert run.code == 0, run.output
    rows = strict.clips()
    assert rows["good"]["status"] == "ok"
    assert "joint 'Chest' flips for one frame" in rows["flipped"]["reason"]
    assert "frames 20 to 31 are one and the same pose" in rows["frozen"]["reason"]


def test_fault_01_mending_the_file_redoes_that_clip_alone(faulty, tmp_path):
    mended = faulty[0].copy(tmp_path / "mended")
    (mended.folder / "cut.bvh").write_text(bvh_text())
    run = mended.run("out/tables/clips.csv")
    assert run.code == 0, run.output
    assert run.jobs == ["clips_table", "retarget:cut"]
    assert mended.clips()["cut"]["status"] == "ok"


def test_failed_clips_end_the_run_well_only_if_that_is_allowed(faulty, tmp_path):
    allowed = faulty[0].copy(tmp_path / "allowed")
    run = allowed.run(allow_failed_clips="true")
    assert run.code == 0, run.output
    assert (allowed.results / "status/clips.ok").read_text() == "3 of 11 clips are motions\n"
    assert allowed.clips()["cut"]["status"] == "failed"


def test_fault_01_a_run_whose_only_clip_is_malformed_still_tells_why(project):
    project.add("only.bvh", CUT, experiments="gait")
    run = project.run()
    assert run.code != 0
    assert f"only: {project.clips()['only']['reason']}".splitlines()[0] in run.output
    assert "1 of 1 clips failed" in run.output
    assert (project.results / "report.html").exists()


def test_fault_03_sheet_rows_without_files_or_with_one_id_stop_before_any_job(project):
    """Fault 3: everything that is missing is listed, whatever else is wrong."""
    project.add("good.bvh", bvh_text())
    project.add("gone.bvh", None)
    project.add("gone_too_01.amc", None, skeleton="alto")
    project.write_sheet([*project.rows.values(), project.rows["good"] | {"id": "GOOD"}])
    run = project.run()
    assert run.code != 0
    for line in (
        "sheet.tsv row 3, column path: no such file: gone.bvh",
        "sheet.tsv row 4, column path: no such file: gone_too_01.amc",
        "sheet.tsv row 4, column path: no such file: gone_too.asf",
        "'alto' is not one of the skeletons (did you mean aalto",
        "'GOOD' is already the id of row 2 ('good')",
    ):
        assert line in run.output
    assert "Traceback" not in run.output
    assert run.jobs == []
    assert not project.results.exists()


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("mirors: []", "config key 'mirors': unknown key (did you mean mirrors"),
        ("allow_failed_clips: 'no'", "'allow_failed_clips': found 'no', expected true or false"),
        ("body: {default_mass_kg: }", "config key 'body.default_mass_kg': found null"),
        ("body: {default_mass_kg: 7000}", "found 7000, expected at most 300"),
        ("figures: {body: []}", "'figures.body': found an empty list, expected 1 or more"),
        ("motions: nowhere.tsv", "'motions': found 'nowhere.tsv', expected an existing file"),
        ("retarget: {cutoff_hz: {run: fast}}", "'retarget.cutoff_hz.run': found 'fast', expected"),
    ],
    ids=["typo", "type", "null", "range", "empty list", "file", "nested"],
)
def test_fault_06_a_wrong_configuration_is_one_line_with_the_key(project, text, line):
    project.add("good.bvh", bvh_text())
    (project.folder / "own.yaml").write_text(text + "\n")
    motions = {"motions": ...} if text.startswith("motions") else {}
    run = project.run("--configfile", str(project.folder / "own.yaml"), **motions)
    assert run.code != 0
    (told,) = (one for one in run.output.splitlines() if one.startswith("config key"))
    assert line in told
    assert "Traceback" not in run.output
    assert "additionalProperties" not in run.output
    assert len(run.output.splitlines()) <= 6
    assert not project.results.exists()
