"""Where a user's cache is: downloaded files and compiled code, shared by all projects."""

from __future__ import annotations

import os
from pathlib import Path

CACHE_VARIABLE = "MOTIONSTYLE_CACHE"


def cache_folder() -> Path:
    """Return the user's cache folder: `$MOTIONSTYLE_CACHE`, or the platform's own place."""
    if chosen := os.environ.get(CACHE_VARIABLE):
        return Path(chosen).expanduser()
    from platformdirs import user_cache_dir  # noqa: PLC0415 - only when it is needed

    return Path(user_cache_dir("motionstyle", appauthor=False))
