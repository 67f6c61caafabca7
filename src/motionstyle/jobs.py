"""What every job of the workflow does around its one call: the log, and errors in one sentence."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from motionstyle.errors import MotionStyleError


@contextmanager
def job(log: str | Path) -> Iterator[TextIO]:
    """Run a job with its output in `log`; on a user's mistake end with its sentence alone.

    Standard output and error go to the log. A `MotionStyleError` or an `OSError` (a full disk, a
    read-only folder) ends the process with exit code 1 after printing one message, both in the
    log and on the terminal; anything else is a fault of the program and leaves its traceback in
    the log too.
    """
    terminal = sys.stderr
    path = Path(log)
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8") as handle:
        sys.stdout = sys.stderr = handle
        try:
            yield handle
        except (MotionStyleError, OSError) as error:
            message = f"error: {error}"
            print(message, file=handle)
            print(message, file=terminal)
            handle.flush()
            sys.stdout, sys.stderr = sys.__stdout__, terminal
            raise SystemExit(1) from None
        except BaseException:
            traceback.print_exc(file=handle)
            raise
        finally:
            sys.stdout, sys.stderr = sys.__stdout__, terminal
