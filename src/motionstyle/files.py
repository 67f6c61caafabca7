"""Writing files so that no half-written one is ever seen under its final name."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from glob import escape
from hashlib import sha256
from pathlib import Path
from typing import IO, Any

try:
    import fcntl
except ImportError:  # no POSIX system: leftovers of killed writers then stay
    fcntl = None  # type: ignore[assignment]


@contextmanager
def atomic_write(path: str | Path, mode: str = "w") -> Iterator[IO[Any]]:
    """Open a temporary file beside `path`; sync it and rename it onto `path` on success.

    On any error, a full disk and an interrupt included, the temporary file is removed and
    `path` keeps its former content. What a writer of the same file left that was killed is
    removed by the next one.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    encoding = None if "b" in mode else "utf-8"
    newline = None if "b" in mode else "\n"
    _remove_leftovers(path)
    descriptor, temporary, guard = _temporary(path)
    try:
        with os.fdopen(descriptor, mode, encoding=encoding, newline=newline) as handle:
            yield handle
            handle.flush()
            os.fsync(handle.fileno())
        temporary.chmod(0o644)
        temporary.replace(path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    finally:
        os.close(guard)


def _temporary(path: Path) -> tuple[int, Path, int]:
    """Return a new temporary file beside `path`, and a descriptor that keeps its lock.

    The lock tells a file that is being written from one whose writer was killed.
    """
    while True:
        descriptor, name = tempfile.mkstemp(
            dir=path.parent, prefix=f".{path.name[:80]}.", suffix=".part"
        )
        _locked(descriptor, wait=True)
        if os.fstat(descriptor).st_nlink:  # else another writer has just taken it for a leftover
            return descriptor, Path(name), os.dup(descriptor)
        os.close(descriptor)


def _remove_leftovers(path: Path) -> None:
    """Remove temporary files of `path` whose writers are no more."""
    for left in path.parent.glob(escape(f".{path.name[:80]}.") + "????????.part"):
        with suppress(OSError):
            descriptor = os.open(left, os.O_RDWR)
            try:
                if _locked(descriptor, wait=False):
                    left.unlink()
            finally:
                os.close(descriptor)


def _locked(descriptor: int, *, wait: bool) -> bool:
    """Lock an open file, and return whether that is done; a lock ends with its process."""
    if fcntl is None:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except OSError:  # held by another process, or a file system without locks
        return False
    return True


def write_json(path: str | Path, value: object) -> None:
    """Write `value` as indented JSON with sorted keys, atomically."""
    with atomic_write(path) as handle:
        json.dump(value, handle, indent=2, sort_keys=True, ensure_ascii=False, allow_nan=False)
        handle.write("\n")


def read_json(path: str | Path) -> Any:  # noqa: ANN401 - whatever the JSON holds
    """Read one JSON file."""
    return json.loads(Path(path).read_text(encoding="utf-8"))


def file_sha256(path: str | Path) -> str:
    """Return the SHA-256 of a file as 64 hexadecimal digits."""
    digest = sha256()
    with Path(path).open("rb") as handle:
        while block := handle.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()
