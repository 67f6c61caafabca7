"""The HTML report: one self-contained page with the clips, the figures and the ledger of a run."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.claims import VERDICTS, ClaimResult
from motionstyle.evaluation.rules import read_table
from motionstyle.files import atomic_write

PAPER_TITLES = {
    "nio": "Learning physics-based motion style with nonlinear inverse optimization (2005)",
    "style_machines": "Style machines (2000)",
    "similarity": "Learning the stylistic similarity between human motions (2006)",
    "ground_truth": "Ground truth",
}
_SYMBOLS = dict(zip(VERDICTS, "✓◐✗–○", strict=True))
_CLIP_COLUMNS = {
    "marker_rms_cm": "marker rms, cm",
    "foot_slip_mm": "foot slip, mm",
    "penetration_mm": "penetration, mm",
    "floor_tilt_deg": "floor tilt, deg",
    "speed_mps": "speed, m/s",
}
_IMAGES = {".png": ("image/png", b"\x89PNG\r\n\x1a\n"), ".svg": ("image/svg+xml", b"<svg")}


@dataclass(frozen=True)
class ClipSummary:
    """What the page says of the clips; `problem` tells why there is nothing to say."""

    problem: str
    total: int
    failed: Sequence[dict[str, str]]
    columns: Sequence[str]
    datasets: Sequence[dict[str, str]]


def summarise_clips(path: Path) -> ClipSummary:
    """Sum up `tables/clips.csv`: rows whose status is not "ok", and medians by dataset.

    A table that is missing, unreadable or without the columns id and status gives a summary with
    its `problem`.
    """
    table = read_table(path)
    if isinstance(table, str):
        return ClipSummary(f"{path.name}: {table}", 0, [], [], [])
    if absent := {"id", "status"} - set(table.columns):
        return ClipSummary(f"{path.name}: no column {', '.join(sorted(absent))}", 0, [], [], [])
    if "dataset" not in table.columns:
        table = table.assign(dataset="all")
    failed = [
        {key: str(row.get(key, "")) for key in ("id", "dataset", "status", "reason")}
        for row in table[table["status"] != "ok"].to_dict("records")
    ]
    present = [name for name in _CLIP_COLUMNS if name in table.columns]
    datasets = []
    for name, rows in table.groupby("dataset", sort=True):
        good = rows[rows["status"] == "ok"]
        medians = {c: _median(good[c]) for c in present}
        counts = {"clips": str(len(rows)), "failed": str(len(rows) - len(good))}
        datasets.append({"dataset": str(name), **counts, **medians})
    return ClipSummary("", len(table), failed, present, datasets)


def _median(column: pd.Series) -> str:
    numbers = pd.to_numeric(column, errors="coerce").to_numpy(dtype=float)
    numbers = numbers[np.isfinite(numbers)]
    return f"{np.median(numbers):.3g}" if numbers.size else "–"


def embed_image(path: str | Path) -> str:
    """Return a PNG or SVG file as a data URI.

    Raises
    ------
    MotionStyleError
        If the file is missing, is of another kind, or is not what its suffix says.
    """
    path = Path(path)
    if path.suffix.lower() not in _IMAGES:
        raise MotionStyleError(f"{path}: the report embeds .png and .svg figures only")
    kind, mark = _IMAGES[path.suffix.lower()]
    try:
        content = path.read_bytes()
    except OSError as problem:
        raise MotionStyleError(f"{path}: figure cannot be read: {problem.strerror}") from problem
    begins = content.startswith(mark) if path.suffix.lower() == ".png" else mark in content
    if not begins:
        raise MotionStyleError(f"{path}: not a {kind} file; draw the figure again")
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"


def _ledger_groups(results: Sequence[ClaimResult]) -> list[dict[str, object]]:
    groups = []
    for paper, title in PAPER_TITLES.items():
        members = [r for r in results if r.claim.paper == paper]
        if members:
            counts = {v: sum(r.verdict == v for r in members) for v in VERDICTS}
            groups.append({"paper": paper, "title": title, "results": members, "counts": counts})
    return groups


def write_report(
    path: str | Path,
    results: Sequence[ClaimResult],
    *,
    results_root: str | Path,
    config_name: str,
    data_kind: str,
    figures: Sequence[tuple[str | Path, str]] = (),
    title: str = "Motion style: a replication of three papers",
) -> None:
    """Write the report as one HTML file without external parts, atomically.

    Parameters
    ----------
    path : file to write.
    results : judged claims, from `motionstyle.evaluation.claims.evaluate_claims`.
    results_root : folder of the run; its `tables/clips.csv` is summed up if there.
    config_name : name of the configuration, as the reader knows it.
    data_kind : what the run's data are, e.g. "captured (embedded clips) and planted".
    figures : PNG or SVG files with their captions, in the order shown.
    title : heading of the page.

    Raises
    ------
    MotionStyleError
        If a figure is missing or is no PNG or SVG file.
    """
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    page = environment.get_template("report.html.j2").render(
        title=title,
        run={"results": str(results_root), "configuration": config_name, "data": data_kind},
        clips=summarise_clips(Path(results_root) / "tables" / "clips.csv"),
        clip_labels=_CLIP_COLUMNS,
        figures=[(embed_image(image), caption) for image, caption in figures],
        groups=_ledger_groups(results),
        totals={v: sum(r.verdict == v for r in results) for v in VERDICTS},
        verdicts=VERDICTS,
        symbols=_SYMBOLS,
    )
    with atomic_write(path) as handle:
        handle.write(page)
