"""What every job of the workflow does around its one call: the log, and errors in one sentence.

And what a run does before its first job: see that it can write, and forget the locks of a run
that was killed.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import IO, NoReturn, TextIO

from motionstyle.errors import MotionStyleError

try:
    import fcntl
except ImportError:  # no POSIX system: locks are then removed by `snakemake --unlock` alone
    fcntl = None  # type: ignore[assignment]

_NO_MEMORY = (
    "not enough memory for this job{}; close other programs, raise the limit (ulimit -v), run "
    "one job at a time (--cores 1), or take fewer frames (first_frame, last_frame in the sheet)"
)
_STOPPED = "stopped before its end; no half-written file is left, the next run does this job again"


@contextmanager
def job(log: str | Path) -> Iterator[TextIO]:
    """Run a job with its output in `log`; on a user's mistake end with its sentence alone.

    Standard output and error go to the log. A `MotionStyleError`, an `OSError` (a full disk, a
    read-only folder), a lack of memory, an interrupt or a termination ends the process with a
    non-zero exit code after printing one message, both in the log and on the terminal; anything
    else is a fault of the program and leaves its traceback in the log too.
    """
    terminal = sys.stderr
    path = Path(log)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle = path.open("w", encoding="utf-8", buffering=1)  # lines can be followed
    except OSError as error:
        print(f"error: cannot write the log: {error}", file=terminal)
        raise SystemExit(1) from None
    with handle, _termination_as_interrupt():
        sys.stdout = sys.stderr = handle

        def end(message: str, code: int) -> NoReturn:
            for stream in (handle, terminal):
                print(f"error: {message}", file=stream)
            raise SystemExit(code) from None

        try:
            yield handle
        except (MotionStyleError, OSError) as error:
            end(str(error), 1)
        except MemoryError as error:
            end(_NO_MEMORY.format(f" ({error})" if str(error) else ""), 1)
        except KeyboardInterrupt:
            end(_STOPPED, 130)
        except BaseException:
            traceback.print_exc(file=handle)
            raise
        finally:
            sys.stdout, sys.stderr = sys.__stdout__, terminal


@contextmanager
def _termination_as_interrupt() -> Iterator[None]:
    """Let SIGTERM end the job like an interrupt, so that temporary files are removed."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(number: int, frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    former = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, former)


def check_writable(folder: str | Path) -> None:
    """Refuse a folder for results that neither is one nor can be made, or cannot be written to."""
    folder = Path(folder)
    there = next(one for one in (folder, *folder.absolute().parents) if one.exists())
    if not there.is_dir():
        raise MotionStyleError(f"results_root {folder}: {there} is a file, not a folder")
    if not os.access(there, os.W_OK | os.X_OK):
        raise MotionStyleError(
            f"results_root {folder}: {there} cannot be written to; choose another folder "
            "(--config results_root=FOLDER) or change its permissions"
        )


def forget_killed_runs(folder: str | Path) -> IO[str] | None:
    """Remove Snakemake's locks from its folder `.snakemake` if no run lives that set them.

    A run that was killed leaves its locks, and the next one would be refused. Every run holds a
    lock of the operating system, which dies with it: who can have that alone is the only run.
    Call this before Snakemake locks the folder.

    Returns
    -------
    file
        To be kept open while the run lasts; None where the system has no such locks.
    """
    if fcntl is None:
        return None
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handle = (folder / "motionstyle.lock").open("a", encoding="utf-8")
    except OSError:  # Snakemake will say so itself
        return None
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:  # another run lives, or the file system has no locks
        pass
    else:
        for left in (folder / "locks").glob("*.lock"):
            left.unlink(missing_ok=True)
    try:
        fcntl.flock(handle, fcntl.LOCK_SH)
    except OSError:
        handle.close()
        return None
    return handle
