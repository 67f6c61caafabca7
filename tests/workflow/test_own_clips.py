"""A user's own clips go end to end; reruns do what is needed and no more."""

from __future__ import annotations

import html

import pytest
from walkers import ANKLE, STRIDE_M, STRIDE_S, TARGETS

from motionstyle.mocap.formats.bvh import read_bvh
from motionstyle.tables import read_table

pytestmark = pytest.mark.workflow


@pytest.mark.parametrize("id", ["steady", "short", "own_01", "mimic"])
def test_own_clips_of_every_format_are_measured_rightly(finished, id):
    row = finished.clips()[id]
    assert (row["status"], row["reason"], row["dataset"]) == ("ok", "", "own")
    stride = 0.7 if id == "short" else STRIDE_M
    assert float(row["speed_mps"]) == pytest.approx(stride / STRIDE_S, rel=0.01)
    assert float(row["step_length_m"]) == pytest.approx(stride / 2, rel=0.01)
    assert float(row["marker_rms_cm"]) < 0.5
    assert float(row["foot_slip_mm"]) < 5


def test_own_clips_reach_the_report_and_every_table(finished):
    page = (finished.results / "report.html").read_text(encoding="utf-8")
    figures = list((finished.results / "figures").glob("*.png"))
    assert page.count("data:image/png;base64,") == len(figures) >= 5
    assert "clips of the user's own sheet" in html.unescape(page)
    assert "embedded in one pinned wheel" not in page
    kinds = {
        row["id"]: row["status"] for row in read_table(finished.results / "tables/motions.csv")
    }
    assert kinds == dict.fromkeys(("steady", "short", "short_mirror", "own_01", "mimic"), "ok")
    assert [row["id"] for row in read_table(finished.results / "tables/gait.csv")] == ["steady"]
    assert len(read_table(finished.results / "tables/claims.csv")) > 60
    assert not finished.leftovers()


@pytest.mark.parametrize("id", ["steady", "own_01", "mimic"])
def test_own_clips_are_exported_as_bvh_that_stands_on_the_floor(finished, id):
    clip = read_bvh(finished.results / f"bvh/captured/{id}.bvh")
    assert clip.frames == int(finished.clips()[id]["frames"])
    feet = [i for i, name in enumerate(clip.joints) if name in ("foot_r", "foot_l")]
    assert len(feet) == 2
    lowest_cm = clip.positions[:, feet, 1].min()
    assert lowest_cm == pytest.approx(100 * ANKLE, abs=0.3)


def test_a_rerun_does_nothing(twin):
    before = twin.files("**/*")
    again = twin.run(*TARGETS)
    assert again.code == 0
    assert again.idle, again.output
    assert twin.files("**/*") == before


def test_changing_one_sheet_row_reruns_only_what_hangs_on_it(twin):
    twin.rows["short"]["first_frame"] = 2
    twin.write_sheet()
    planned = twin.run("-n", *TARGETS).jobs
    assert [job for job in planned if job.startswith(("retarget", "mirror", "bvh"))] == [
        "mirror:short",
        "retarget:short",
    ]
    assert {"clips_table", "motions_table", "report", "figure_strips"} <= set(planned)
    assert "gait_tables" not in planned


def test_changing_a_note_remeasures_nothing(twin):
    twin.rows["short"]["note"] = "seen on a Tuesday"
    twin.write_sheet()
    again = twin.run("-n", *TARGETS)
    assert again.code == 0
    assert again.idle, again.output


def test_publish_of_another_than_the_full_run_is_refused_in_one_sentence(twin, code):
    refused = twin.run("publish")
    assert refused.code != 0
    sentence = "error: publish is made from the full run, this is 'default': snakemake publish"
    assert sentence in refused.output
    assert "Traceback" not in refused.output
    assert not (code / "results").exists()
