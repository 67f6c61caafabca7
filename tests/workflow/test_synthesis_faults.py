"""Fault 7: footprints no body can follow are a diagnosis, never a silent bad motion.

Scripts run as Snakemake runs them, with its object made up; nothing here comes to a solve.
"""

from __future__ import annotations

import runpy
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from motionstyle.errors import MotionStyleError
from motionstyle.files import read_json
from motionstyle.motion.motion import Motion
from motionstyle.motion.resample import resample
from motionstyle.motion.storage import load_motion, save_motion
from motionstyle.spacetime.captured_footprints import footprints_of
from motionstyle.spacetime.footprints import Footprint, read_footprints, write_footprints
from motionstyle.spacetime.synthesis_sheet import COLUMNS
from synthetic_walk import make_walk

SCRIPTS = Path(__file__).parents[2] / "workflow/scripts"


class Inputs(dict):
    """Snakemake's inputs: by name as keys and as attributes."""

    __getattr__ = dict.__getitem__


def run(script: str, folder: Path, inputs: dict[str, Path], outputs: dict[str, str]) -> None:
    made_up = SimpleNamespace(
        input=Inputs({name: str(path) for name, path in inputs.items()}),
        output=SimpleNamespace(**{name: str(folder / file) for name, file in outputs.items()}),
        params=SimpleNamespace(sheet=str(folder / "syntheses.tsv")),
        wildcards=SimpleNamespace(synthesis="bad"),
        log=[str(folder / "job.log")],
    )
    runpy.run_path(str(SCRIPTS / script), init_globals={"snakemake": made_up})


@pytest.fixture(scope="module")
def walk() -> Motion:
    return resample(make_walk(), 30.0)


def stance(rows: tuple[Footprint, ...], k: int) -> float:
    """When the k-th stance begins."""
    return sorted({one.t_on for one in rows})[k]


def moved(rows: tuple[Footprint, ...], k: int, **new: object) -> list[Footprint]:
    """The rows with the k-th stance changed; functions get the row."""
    at = stance(rows, k)
    return [
        replace(one, **{n: v(one) if callable(v) else v for n, v in new.items()})
        if one.t_on == at
        else one
        for one in rows
    ]


CASES = {
    "a stride of 5 m": (lambda rows: moved(rows, 4, x=lambda one: one.x + 5), "out of reach"),
    "feet in the wrong order": (
        lambda rows: moved(rows, 4, foot=lambda one: "l" if one.foot == "r" else "r"),
        "must take turns",
    ),
    "a contact that never touches": (lambda rows: moved(rows, 4, y=1.5), "never touch"),
    "a contact of no duration": (
        lambda rows: moved(rows, 4, t_off=lambda one: one.t_on),
        "t_off must lie after t_on",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_fault_07_infeasible_footsteps_leave_their_reason_and_no_motion(tmp_path, walk, case):
    change, reason = CASES[case]
    write_footprints(tmp_path / "mine.tsv", change(footprints_of(walk)))
    cells = dict.fromkeys(COLUMNS, "") | {"id": "bad", "task": "line", "example": "walk"}
    cells |= {"style": "initial", "mood": "neutral", "footprints": "file path=mine.tsv"}
    lines = ["\t".join(COLUMNS), "\t".join(cells[c] for c in COLUMNS)]
    (tmp_path / "syntheses.tsv").write_text("\n".join(lines) + "\n")
    save_motion(tmp_path / "walk.npz", walk)
    inputs = {"example": tmp_path / "walk.npz", "file": tmp_path / "mine.tsv"}
    laid = {"table": "bad.tsv", "status": "bad.json", "svg": "bad.svg", "png": "bad.png"}
    run("footprints.py", tmp_path, inputs, laid)
    status = read_json(tmp_path / "bad.json")
    assert status["status"] == "failed"
    assert reason in status["reason"]
    with pytest.raises(MotionStyleError, match="no footprints"):
        read_footprints(tmp_path / "bad.tsv")
    assert (tmp_path / "bad.png").stat().st_size > 1000  # a picture that says so

    inputs |= {"table": tmp_path / "bad.tsv", "status": tmp_path / "bad.json"}
    inputs |= dict.fromkeys(("style", "code", "second_order"), tmp_path / "never read")
    made = {"motion": "nio.npz", "sidecar": "nio.json", "report": "report.json"}
    run("synthesise.py", tmp_path, inputs, made | {"diagnosis": "diagnosis.json"})
    for name in ("report.json", "diagnosis.json", "nio.json"):
        told = read_json(tmp_path / name)
        assert told["status"] == "failed", name
        assert reason in told["reason"], name
    with pytest.raises(MotionStyleError, match=reason):
        load_motion(tmp_path / "nio.npz")
