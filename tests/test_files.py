"""No half-written file is ever seen under its final name (fault 14)."""

from __future__ import annotations

import errno
import os
import stat
import tempfile
from pathlib import Path

import pytest

from motionstyle.files import atomic_write, file_sha256, read_json, write_json


def names(folder):
    return sorted(p.name for p in folder.iterdir())


@pytest.fixture
def former(tmp_path):
    path = tmp_path / "out.txt"
    path.write_text("former")
    return path


def assert_untouched(path):
    assert path.read_text() == "former"
    assert names(path.parent) == [path.name]


def test_content_appears_only_at_the_end(former):
    with atomic_write(former) as handle:
        handle.write("new")
        handle.flush()
        assert former.read_text() == "former"
        (part,) = (name for name in names(former.parent) if name != former.name)
        assert part.startswith(f".{former.name}.")
        assert part.endswith(".part")
    assert former.read_text() == "new"
    assert names(former.parent) == [former.name]


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit, RuntimeError, MemoryError])
def test_an_interrupt_or_an_exception_keeps_the_former_content(former, error):
    def write():
        with atomic_write(former) as handle:
            handle.write("half of the new")
            handle.flush()
            assert len(names(former.parent)) == 2
            raise error

    with pytest.raises(error):
        write()
    assert_untouched(former)


def test_a_failed_first_write_leaves_nothing(tmp_path):
    def write():
        with atomic_write(tmp_path / "new.txt") as handle:
            handle.write("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        write()
    assert names(tmp_path) == []


@pytest.mark.parametrize("mode", ["w", "wb"])
@pytest.mark.parametrize("size", [1 << 12, 1 << 22])
def test_a_full_disk_keeps_the_former_content(former, mode, size):
    """The system itself refuses the bytes beyond a limit, as it does on a full disk."""
    resource = pytest.importorskip("resource")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    content = "x" * size if mode == "w" else b"x" * size
    resource.setrlimit(resource.RLIMIT_FSIZE, (1024, limits[1]))
    try:
        with pytest.raises(OSError) as caught, atomic_write(former, mode) as handle:  # noqa: PT011
            handle.write(content)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert caught.value.errno == errno.EFBIG
    assert_untouched(former)


@pytest.mark.parametrize("step", ["fsync", "replace"])
def test_an_error_of_the_last_steps_keeps_the_former_content(former, monkeypatch, step):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    owner = os if step == "fsync" else Path
    monkeypatch.setattr(owner, step, full)
    with pytest.raises(OSError, match="No space left"), atomic_write(former) as handle:
        handle.write("new")
    monkeypatch.undo()
    assert_untouched(former)


def test_content_is_synced_before_the_rename(former, monkeypatch):
    calls = []
    fsync, replace = os.fsync, Path.replace

    def synced(descriptor):
        calls.append(("fsync", os.fstat(descriptor).st_size, former.read_text()))
        fsync(descriptor)

    def replaced(self, target):
        calls.append(("replace", self.stat().st_size, former.read_text()))
        return replace(self, target)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(Path, "replace", replaced)
    with atomic_write(former) as handle:
        handle.write("all of it")
    assert calls == [("fsync", 9, "former"), ("replace", 9, "former")]


@pytest.fixture
def read_only_folder():
    """A folder in which this process may not write, even if it is the superuser's."""
    folder = Path(tempfile.mkdtemp())
    (folder / "out.txt").write_text("former")
    (folder / "out.txt").chmod(0o444)
    folder.chmod(0o555)
    superuser = hasattr(os, "geteuid") and os.geteuid() == 0
    if superuser:
        os.seteuid(65534)
    try:
        if os.access(folder, os.W_OK, effective_ids=os.access in os.supports_effective_ids):
            pytest.skip("this system lets the process write everywhere")
        yield folder
    finally:
        if superuser:
            os.seteuid(0)
        folder.chmod(0o755)
        for path in folder.iterdir():
            path.unlink()
        folder.rmdir()


def test_a_read_only_folder_is_an_error_with_the_file_s_name(read_only_folder):
    path = read_only_folder / "out.txt"
    with pytest.raises(PermissionError, match=r"out\.txt") as caught, atomic_write(path) as handle:
        handle.write("new")
    assert str(read_only_folder) in str(caught.value)
    assert_untouched(path)


def test_a_folder_below_a_file_is_an_error_with_the_file_s_name(former):
    with pytest.raises(OSError, match=r"out\.txt"), atomic_write(former / "below" / "x.txt"):
        pass
    assert_untouched(former)


def test_folders_are_made(tmp_path):
    with atomic_write(tmp_path / "a" / "b" / "c.txt") as handle:
        handle.write("x")
    assert (tmp_path / "a" / "b" / "c.txt").read_text() == "x"


def test_text_is_utf_8_with_plain_line_ends(tmp_path):
    with atomic_write(tmp_path / "t.txt") as handle:
        handle.write("ä\nβ\n")
    assert (tmp_path / "t.txt").read_bytes() == "ä\nβ\n".encode()


def test_a_very_long_name_can_be_written(tmp_path):
    path = tmp_path / ("n" * 250)
    with atomic_write(path) as handle:
        handle.write("x")
    assert path.read_text() == "x"


@pytest.mark.skipif(os.name != "posix", reason="file modes are POSIX")
def test_others_may_read_the_file(tmp_path):
    with atomic_write(tmp_path / "t.txt") as handle:
        handle.write("x")
    assert stat.S_IMODE((tmp_path / "t.txt").stat().st_mode) == 0o644


def test_json_is_sorted_and_comes_back(tmp_path):
    path = tmp_path / "t.json"
    write_json(path, {"b": [1, 2.5, None], "a": "ä"})
    assert path.read_text(encoding="utf-8").startswith('{\n  "a": "ä",\n  "b": [')
    assert path.read_bytes().endswith(b"}\n")
    assert read_json(path) == {"a": "ä", "b": [1, 2.5, None]}


@pytest.mark.parametrize("value", [{"x": float("nan")}, {"x": object()}])
def test_json_that_cannot_be_written_keeps_the_former_content(former, value):
    with pytest.raises((ValueError, TypeError)):
        write_json(former, value)
    assert_untouched(former)


def test_sha256_of_a_file_larger_than_a_block(tmp_path):
    path = tmp_path / "t.bin"
    path.write_bytes(b"abc")
    assert file_sha256(path) == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    path.write_bytes(b"a" * 1_000_000 + b"a" * 2_000_000)
    whole = file_sha256(path)
    path.write_bytes(b"a" * 2_999_999 + b"b")
    assert len(whole) == 64
    assert file_sha256(path) != whole
