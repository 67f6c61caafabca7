"""The index of all motions of a run, `tables/motions.csv`, from their sidecars alone."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from motionstyle.motion.storage import read_sidecar

MOTION_COLUMNS = (
    *("id", "dataset", "config", "kind", "example", "style", "edit", "footprints", "subject"),
    *("action", "source_frames", "frames", "rate_hz", "planted", "status", "reason", "path"),
)
_FROM_PROVENANCE = (
    *("dataset", "example", "style", "edit", "footprints", "subject", "action", "source_frames"),
)


def index_motions(motions: str | Path | Iterable[str | Path], config: str) -> list[dict[str, Any]]:
    """List motions, sorted by kind and id.

    Parameters
    ----------
    motions : the folder of a run's results, for all motions in its `motions/{kind}`, or the
        motion files `…/motions/{kind}/{id}.npz` to list.
    config : name of the run's configuration, repeated in every row.

    Returns
    -------
    One row a motion with the keys `MOTION_COLUMNS`; `rate_hz` in Hz, `path` of the .npz relative
    to the run's folder with forward slashes. What a motion does not have is None; one that failed
    has the status `failed`, a reason and no frames.

    Raises
    ------
    MotionStyleError
        If a sidecar is not readable.
    """
    if isinstance(motions, str | Path):
        motions = (Path(motions) / "motions").glob("*/*.json")
    rows = [_row(Path(path), config) for path in motions]
    return sorted(rows, key=lambda row: (row["kind"], row["id"]))


def _row(path: Path, config: str) -> dict[str, Any]:
    """Return the row of one motion, by either of its files."""
    sidecar = read_sidecar(path)
    provenance = sidecar["provenance"]
    values: dict[str, Any] = {name: provenance.get(name) for name in _FROM_PROVENANCE}
    values |= {name: sidecar.get(name) for name in ("id", "kind", "frames", "rate_hz")}
    values |= {name: sidecar.get(name) for name in ("status", "reason")}
    values["config"] = config
    values["planted"] = bool(provenance.get("planted", sidecar["kind"] == "planted"))
    values["path"] = "/".join(path.with_suffix(".npz").parts[-3:])
    return {name: values[name] for name in MOTION_COLUMNS}
