"""Writing what an experiment found: tables, motions, arrays for figures."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.style_machines.runs import COLUMNS, Outcome, check_made
from motionstyle.files import atomic_write, write_json
from motionstyle.motion.motion import Motion
from motionstyle.motion.storage import load_motion, save_motion
from motionstyle.tables import write_table


def load_by_id(files: Iterable[str | Path]) -> dict[str, Motion]:
    """Read motions by id; one that could not be made ends the job with its reason."""
    return {Path(file).stem: load_motion(file) for file in files}


def save_outcome(
    outcome: Outcome,
    *,
    tables: Mapping[str, str | Path],
    motions: Iterable[str | Path] = (),
    rows: str | Path | None = None,
    arrays: str | Path | None = None,
) -> None:
    """Write an experiment's tables, its motions, the rows about them, and arrays for figures."""
    files = {Path(file).stem: file for file in motions}
    check_made(outcome.motions, list(files))
    for name, file in tables.items():
        write_table(file, COLUMNS[name], outcome.tables[name])
    for id, motion in outcome.motions.items():
        save_motion(files[id], motion)
    if rows is not None:
        write_json(rows, [_plain(row) for row in outcome.syntheses])
    if arrays is not None:
        save_arrays(arrays, outcome.arrays)


def _plain(row: Mapping[str, object]) -> dict[str, object]:
    """Return a row with Python's own numbers and None for what is no number."""
    plain: dict[str, object] = {}
    for key, value in row.items():
        own = value.item() if isinstance(value, np.generic) else value
        plain[key] = None if isinstance(own, float) and not np.isfinite(own) else own
    return plain


def save_arrays(path: str | Path, arrays: Mapping[str, NDArray[np.generic]]) -> None:
    """Write arrays as an .npz without time stamps: equal arrays, equal bytes."""
    with atomic_write(path, "wb") as handle, zipfile.ZipFile(handle, "w") as archive:
        for name in sorted(arrays):
            buffer = io.BytesIO()
            np.lib.format.write_array(
                buffer, np.asarray(arrays[name], order="C"), allow_pickle=False
            )
            info = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
            info.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(info, buffer.getvalue())


def load_arrays(path: str | Path) -> dict[str, NDArray[np.generic]]:
    """Read the arrays of `save_arrays`."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            return {name: stored[name] for name in stored.files}
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        raise MotionStyleError(
            f"{path}: not readable ({error}); delete it and run Snakemake again"
        ) from error
