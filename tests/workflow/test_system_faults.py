"""Faults 14 to 19 and 21 to 27: what disk, system, network and the user's hands do to a run."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from walkers import Project, bvh_text, stop_group

from motionstyle.errors import MotionStyleError
from motionstyle.jobs import check_writable, forget_killed_runs, job
from motionstyle.mocap.datasets.doors import DATASET_COLUMNS, cached_file
from motionstyle.motion.storage import load_motion

pytestmark = pytest.mark.workflow

TABLE = "out/tables/clips.csv"
DEAD = "http://127.0.0.1:9"
OFFLINE = {
    **dict.fromkeys(("http_proxy", "https_proxy", "HTTP_PROXY", "HTTPS_PROXY"), DEAD),
    **{"no_proxy": None, "NO_PROXY": None, "PIP_NO_INDEX": "1"},
}


@pytest.fixture
def two(project):
    """Two good clips, unrun."""
    project.add("steady.bvh", bvh_text())
    project.add("short.bvh", bvh_text(stride=0.7))
    return project


# Disk


def test_fault_14_a_full_disk_leaves_no_half_file_and_the_next_run_recovers(two):
    """The system refuses bytes beyond a limit, as it does on a full disk."""
    two.add("long.bvh", bvh_text(frames=480))  # its motion is larger than Snakemake's own files
    full = two.run("out/motions/captured/long.npz", limits="ulimit -f 64")
    assert full.code != 0
    assert "error: [Errno 27] File too large" in full.output
    assert "Traceback" not in full.output
    assert two.files("motions/**/*") == {}
    assert not two.leftovers()
    assert two.run("out/motions/captured/long.npz").code == 0
    assert load_motion(two.results / "motions/captured/long.npz").frames == 480


def test_fault_17_results_that_cannot_be_written_are_one_line(two):
    """A file stands where the folder must be: what permissions forbid binds everybody but root."""
    two.results.write_text("not a folder")
    run = two.run("out/motions/captured/steady.npz")
    assert run.code != 0
    assert "results_root out: out is a file, not a folder" in run.output
    assert "Traceback" not in run.output
    assert two.results.read_text() == "not a folder"


@pytest.mark.skipif(os.geteuid() == 0, reason="permissions do not bind the superuser")
def test_fault_17_a_read_only_results_folder_is_one_line(two):
    two.results.mkdir()
    two.results.chmod(0o555)
    run = two.run("out/motions/captured/steady.npz")
    two.results.chmod(0o755)
    assert run.code != 0
    assert "cannot be written" in run.output
    assert "Traceback" not in run.output
    assert two.run("out/motions/captured/steady.npz").code == 0


def test_fault_17_a_folder_nobody_may_write_to_is_one_sentence(tmp_path, monkeypatch):
    check_writable(tmp_path / "new" / "results")
    assert list(tmp_path.iterdir()) == []
    monkeypatch.setattr(os, "access", lambda path, mode: path != tmp_path)
    with pytest.raises(MotionStyleError, match="cannot be written to; choose another") as caught:
        check_writable(tmp_path / "new" / "results")
    assert f": {tmp_path} " in str(caught.value)


def test_fault_17_a_log_that_cannot_be_written_is_one_line(tmp_path, capsys):
    (tmp_path / "logs").write_text("")
    with pytest.raises(SystemExit) as caught, job(tmp_path / "logs" / "a.log"):
        raise AssertionError("must not be reached")
    assert caught.value.code == 1
    told = capsys.readouterr().err
    assert told.startswith("error: cannot write the log: ")
    assert told.count("\n") == 1


# Killed, interrupted, twice at once


@pytest.mark.parametrize(
    ("number", "whole_group"),
    [(signal.SIGTERM, True), (signal.SIGKILL, True), (signal.SIGKILL, False)],
    ids=["TERM", "KILL", "KILL of Snakemake alone"],
)
def test_fault_15_a_run_killed_mid_rule_redoes_that_job_alone(two, number, whole_group):
    """The plain command again, with no --unlock and no --rerun-incomplete."""
    assert two.run("out/motions/captured/short.npz").code == 0
    short = two.files("motions/captured/short.*")
    process = two.start_and_pause("steady.npz", TABLE)
    (os.killpg if whole_group else os.kill)(process.pid, number)
    assert process.wait(60) != 0
    assert not (two.results / "motions/captured/steady.npz").exists()
    two.go_on()
    again = two.run(TABLE)
    stop_group(process)
    assert again.code == 0, again.output
    assert again.jobs == ["clips_table", "retarget:steady"]
    assert {row["status"] for row in two.clips().values()} == {"ok"}
    assert two.files("motions/captured/short.*") == short
    assert not two.leftovers()
    if number == signal.SIGTERM:
        assert "stopped before its end" in two.output_of_start()
        assert "Traceback" not in two.output_of_start()


def test_fault_15_only_locks_of_dead_runs_are_forgotten(tmp_path):
    lock = tmp_path / "locks" / "0.output.lock"
    lock.parent.mkdir()
    lock.touch()
    first = forget_killed_runs(tmp_path)
    assert first is not None
    assert not lock.exists()
    lock.touch()  # now of the first run, which lives
    second = forget_killed_runs(tmp_path)
    assert lock.exists()
    first.close()
    third = forget_killed_runs(tmp_path)  # the second lives still
    assert lock.exists()
    second.close()
    third.close()
    forget_killed_runs(tmp_path).close()
    assert not lock.exists()


def test_fault_16_a_second_run_at_once_stops_and_the_first_is_unharmed(two):
    process = two.start_and_pause("steady.npz", TABLE)
    began = time.monotonic()
    second = two.run(TABLE)
    assert second.code != 0
    assert time.monotonic() - began < 30
    assert "no other Snakemake process is trying to create the same files" in second.output
    assert second.jobs == []
    assert process.poll() is None
    two.go_on()
    assert process.wait(90) == 0, two.output_of_start()
    assert {row["status"] for row in two.clips().values()} == {"ok"}
    assert two.run(TABLE).idle


def test_fault_27_an_interrupt_while_a_figure_is_written_leaves_no_broken_file(twin):
    before = twin.files("figures/*", "report.html")
    for file in ("figures/strips.png", "figures/strips.svg", "report.html"):
        (twin.results / file).unlink()
    for name in ("strips.png", "report.html"):
        process = twin.start_and_pause(name)
        os.killpg(process.pid, signal.SIGINT)
        assert process.wait(60) != 0
        assert "stopped before its end" in twin.output_of_start()
        twin.go_on()
        assert not twin.leftovers()
        assert not (twin.results / "report.html").exists()
        whole = twin.files("figures/*")
        assert whole == {file: before[file] for file in whole}
    again = twin.run()
    assert again.code == 0, again.output
    assert twin.files("figures/*", "report.html") == before


# Code, places, surroundings


@pytest.fixture
def editing(code):
    """A function that changes a source file of the package until the test ends."""
    former: dict[Path, str] = {}

    def edit(name: str) -> None:
        path = code / "src/motionstyle" / name
        former[path] = path.read_text(encoding="utf-8")
        path.write_text(former[path] + "\nEDITED = True\n", encoding="utf-8")

    yield edit
    for path, text in former.items():
        path.write_text(text, encoding="utf-8")


def test_fault_18_an_edited_library_file_reruns_what_it_touches(twin, editing):
    editing("figures/gait.py")
    planned = twin.run("-n").jobs
    assert {"figure_body", "figure_gait", "figure_strips", "figure_markers"} <= set(planned)
    assert not {"clips_table", "gait_tables", "motions_table"} & set(planned)
    assert not [name for name in planned if name.startswith(("retarget", "mirror"))]
    editing("mocap/fitting/contacts.py")
    planned = twin.run("-n").jobs
    wanted = {f"retarget:{id}" for id in ("steady", "short", "own_01", "mimic")}
    assert wanted <= set(planned)


def test_fault_19_spaces_letters_beyond_ascii_long_names_and_another_folder(tmp_path, code):
    deep = tmp_path / "Meine Läufe, schnell & lang" / ("größer " * 12).strip() / "步行"
    project = Project(deep, code)
    project.add("Gang – normal's (1).bvh", bvh_text(), id="gang", experiments="gait")
    elsewhere = tmp_path / "another place"
    elsewhere.mkdir()
    targets = ("out/tables/gait.csv", "out/figures/body.svg", "out/bvh/captured/gang.bvh")
    run = project.run(TABLE, *targets, cwd=elsewhere)
    assert run.code == 0, run.output
    assert project.clips()["gang"]["status"] == "ok"
    assert all((project.folder / target).exists() for target in targets)
    assert list(elsewhere.iterdir()) == []
    assert project.run(TABLE, *targets, cwd=elsewhere).idle


@pytest.fixture(scope="session")
def odd(finished, tmp_path_factory):
    """The shared run's input, run anew in odd surroundings: faults 21, 22, 23."""
    folder = tmp_path_factory.mktemp("odd")
    (folder / "matplotlibrc").write_text("text.usetex: True\nfont.size: 30\naxes.grid: True\n")
    env = {
        **OFFLINE,
        **{"DISPLAY": None, "MPLBACKEND": "TkAgg", "MATPLOTLIBRC": str(folder / "matplotlibrc")},
        **{"OMP_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "2", "PYTHONHASHSEED": "4711"},
        **{"TZ": "Asia/Kathmandu", "PATH": path_without(folder, "latex", "dvipng", "pdflatex")},
        **comma_locale(folder),
    }
    project = Project(folder / "own", finished.code)
    for file in finished.folder.iterdir():
        if file.is_file():
            shutil.copy(file, project.folder)
    return project, project.run(env=env)


def path_without(folder: Path, *names: str) -> str:
    """Return a PATH on which these programs are not to be found."""
    found = [Path(p) for p in os.environ["PATH"].split(os.pathsep) if Path(p).is_dir()]
    kept = [str(p) for p in found if not any((p / name).exists() for name in names)]
    for name in ("bash", "sh", "env"):  # if they stood beside them
        if not shutil.which(name, path=os.pathsep.join(kept)) and (there := shutil.which(name)):
            (folder / "bin").mkdir(exist_ok=True)
            (folder / "bin" / name).symlink_to(there)
    return os.pathsep.join([*kept, str(folder / "bin")])


def comma_locale(folder: Path) -> dict[str, str | None]:
    """Return the environment of a locale with decimal commas, made here if need be, else of C."""
    made = None
    if shutil.which("localedef"):
        command = ["localedef", "-i", "de_DE", "-f", "UTF-8", str(folder / "de_DE.UTF-8")]
        made = subprocess.run(command, capture_output=True, check=False).returncode == 0
    if not made:
        return {"LC_ALL": "C"}
    return {"LOCPATH": str(folder), "LC_ALL": "de_DE.UTF-8"}


def test_fault_23_two_runs_in_other_surroundings_give_the_same_bytes(finished, odd):
    """Other thread counts, decimal commas, another time zone, another seed of hashes."""
    again, run = odd
    assert run.code == 0, run.output
    wanted = finished.files("tables/*.csv", "motions/**/*", "quality/*")
    assert len(wanted) >= 5 + 10 + 4
    assert again.files("tables/*.csv", "motions/**/*", "quality/*") == wanted


def test_fault_22_no_display_no_latex_and_the_user_s_own_style_change_no_figure(finished, odd):
    again, run = odd
    assert run.code == 0, run.output
    wanted = finished.files("figures/*.svg", "figures/*.png")
    assert len(wanted) >= 10
    assert again.files("figures/*.svg", "figures/*.png") == wanted


def test_fault_21_without_network_a_run_that_needs_none_is_unaffected(odd):
    project, run = odd
    assert run.code == 0, run.output
    assert "fetch" not in run.output
    assert (project.results / "status/clips.ok").exists()


def dataset(project: Project, content: bytes) -> dict[str, object]:
    """Write a table with one pinned file of a dataset; return its cells of the sheet."""
    row = ("toy", "toy/far.bvh", "nobody/nothing", "0" * 40, "far.bvh")
    lines = ["\t".join(DATASET_COLUMNS)]
    lines.append("\t".join((*row, sha256(content).hexdigest(), "CC0", "")))
    (project.folder / "datasets.tsv").write_text("\n".join(lines) + "\n")
    settings = "datasets: datasets.tsv\nmirrors: [mirror]\n"
    (project.folder / "toy.yaml").write_text(settings)
    return {"id": "far", "dataset": "toy", "path": "toy/far.bvh"}


def test_fault_21_a_dataset_nobody_gives_is_one_clean_error_and_recovers(project):
    """No network, a wrong file in the mirror; then the user does what the error says."""
    content = bvh_text(stride=0.6).encode()
    project.add("near.bvh", bvh_text())
    project.add("far.bvh", None, **dataset(project, content))
    mirrored = project.folder / "mirror/toy/far.bvh"
    mirrored.parent.mkdir(parents=True)
    mirrored.write_bytes(content[: len(content) // 2])
    # the copy of the workflow is where mirrors are sought from
    mirrors = f"['{project.folder / 'mirror'}']"
    cache = project.folder / "cache"
    env = {**OFFLINE, "MOTIONSTYLE_CACHE": str(cache)}
    options = ("--configfile", str(project.folder / "toy.yaml"))
    failed = project.run(TABLE, *options, env=env, mirrors=mirrors)
    assert failed.code != 0
    assert "clip toy/far.bvh (dataset toy): no source gave the file with sha256" in failed.output
    assert f"{mirrored}: wrong checksum" in failed.output
    assert f"Put the file into {cached_file(cache, sha256(content).hexdigest())}" in failed.output
    assert "Traceback" not in failed.output
    assert load_motion(project.results / "motions/captured/near.npz").frames == 48
    assert project.files("sources/**/*") == {}
    assert not project.leftovers()
    kept = cached_file(cache, sha256(content).hexdigest())
    kept.parent.mkdir(parents=True, exist_ok=True)
    kept.write_bytes(content)
    again = project.run(TABLE, *options, env=env, mirrors=mirrors)
    assert again.code == 0, again.output
    assert again.jobs == ["clips_table", "fetch_clip:toy/far.bvh", "retarget:far"]
    assert project.clips()["far"]["status"] == "ok"


# Memory, damaged intermediates, input


def test_fault_24_a_ten_times_longer_clip_needs_bounded_memory(project):
    project.add("long.bvh", bvh_text(frames=480))
    run = project.run(TABLE, limits="ulimit -v 3000000", env={"OPENBLAS_NUM_THREADS": "1"})
    assert run.code == 0, run.output
    assert project.clips()["long"]["frames"] == "480"


def test_fault_24_a_lack_of_memory_is_a_clear_refusal(tmp_path, capsys):
    with pytest.raises(SystemExit) as caught, job(tmp_path / "a.log"):
        np.empty((1 << 46,), dtype=float)
    assert caught.value.code == 1
    told = capsys.readouterr().err
    assert told.startswith("error: not enough memory for this job (Unable to allocate 512. TiB")
    assert "first_frame" in told
    assert (tmp_path / "a.log").read_text() == told


def test_fault_24_too_little_memory_for_the_clip_stops_cleanly(project):
    """The limit falls within the job: what the hook sets is far below what the clip needs."""
    (project.folder / "hooks").mkdir()
    (project.folder / "hooks/sitecustomize.py").write_text(
        "import resource, sys\n"
        "class Limit:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name == 'motionstyle.mocap.skeletons.ingest':\n"
        "            import numpy, scipy.spatial.transform, scipy.signal, scipy.optimize\n"
        "            square = numpy.eye(200) @ numpy.eye(200)\n"  # BLAS takes its buffers now
        "            numpy.linalg.solve(square, square), scipy.linalg.svd(square)\n"
        "            used = int(open('/proc/self/statm').read().split()[0]) * 4096\n"
        "            resource.setrlimit(resource.RLIMIT_AS, (used + 60_000_000,) * 2)\n"
        "sys.meta_path.insert(0, Limit())\n"
    )
    project.add("long.bvh", bvh_text(frames=4800))
    run = project.run("out/motions/captured/long.npz")
    assert run.code != 0
    assert "error: not enough memory for this job" in run.output, run.output
    assert project.files("motions/**/*") == {}
    assert not project.leftovers()


def test_fault_25_a_damaged_or_older_intermediate_is_refused_and_deleting_it_recovers(twin):
    motions = twin.results / "motions/captured"
    good = twin.files("motions/**/*", "tables/*.csv")
    whole = (motions / "steady.npz").read_bytes()
    (motions / "steady.npz").write_bytes(whole[: len(whole) // 2])
    sidecar = motions / "own_01.json"
    sidecar.write_text(sidecar.read_text().replace('"schema_version": 1', '"schema_version": 0'))
    refused = twin.run(TABLE, "out/tables/motions.csv", "--rerun-triggers", "mtime")
    assert refused.code != 0
    assert "captured/steady.npz: not a readable motion file" in refused.output
    assert "delete it and run Snakemake again to remake motion captured/steady" in refused.output
    assert "own_01.json: motion schema version 0, this program reads 1" in refused.output
    assert "Traceback" not in refused.output
    (motions / "steady.npz").unlink()
    sidecar.unlink()
    again = twin.run("all")
    assert again.code == 0, again.output
    assert {"retarget:steady", "retarget:own_01"} <= set(again.jobs)
    assert not {"retarget:short", "retarget:mimic"} & set(again.jobs)
    assert twin.files("motions/**/*", "tables/*.csv") == good


def test_fault_26_symlinked_read_only_input_works_and_its_change_is_noticed(project, tmp_path):
    real = tmp_path / "archive" / "0001.bvh"
    real.parent.mkdir()
    real.write_text(bvh_text())
    real.chmod(0o444)
    project.add("linked.bvh", None)
    (project.folder / "linked.bvh").symlink_to(real)
    project.sheet.chmod(0o444)
    run = project.run(TABLE)
    assert run.code == 0, run.output
    speed = float(project.clips()["linked"]["speed_mps"])
    time.sleep(1.1)
    os.utime(real)
    assert project.run("-n", TABLE).idle
    real.chmod(0o644)
    real.write_text(bvh_text(stride=0.6))
    changed = project.run(TABLE)
    assert changed.jobs == ["clips_table", "retarget:linked"]
    assert float(project.clips()["linked"]["speed_mps"]) == pytest.approx(0.75 * speed, rel=0.02)
