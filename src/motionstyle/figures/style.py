"""One figure style: fonts, sizes, colours, and files whose bytes depend on the content alone.

Importing this module selects the Agg backend, so that no display is needed. Figures are made
with `new_figure`, not through pyplot's global state, and belong to nobody once they are saved.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import ParamSpec, TypeVar

import matplotlib

matplotlib.use("Agg")

from matplotlib.figure import Figure

from motionstyle.files import atomic_write
from motionstyle.motion.motion import Motion

P = ParamSpec("P")
R = TypeVar("R")

PRINT_WIDTH_IN = 7.0
SMALL_PT, NORMAL_PT = 7.0, 8.0
PNG_DPI = 200

# Okabe and Ito's palette, which colour-blind readers can tell apart.
RIGHT, LEFT, TRUNK = "#D55E00", "#0072B2", "#555555"
GROUND, BAND = "#888888", "#DDDDDD"
SERIES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#000000", "#E69F00", "#56B4E9")
SERIES_LINES = ("-", (0, (5, 1.2)), (0, (1, 1)), (0, (4, 1, 1, 1)))
SIDE_COLOURS = {"r": RIGHT, "l": LEFT, "": TRUNK}
SIDE_LINES = {"r": "-", "l": (0, (3, 0.8)), "": "-"}

STYLE: dict[str, object] = {
    "font.family": "DejaVu Sans",  # bundled with Matplotlib, so the same everywhere
    "font.size": NORMAL_PT,
    "axes.titlesize": NORMAL_PT,
    "axes.labelsize": NORMAL_PT,
    "xtick.labelsize": SMALL_PT,
    "ytick.labelsize": SMALL_PT,
    "legend.fontsize": SMALL_PT,
    "figure.titlesize": NORMAL_PT,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.frameon": False,
    "text.usetex": False,
    "svg.fonttype": "path",
    "svg.hashsalt": "motionstyle",
}


def styled(function: Callable[P, R]) -> Callable[P, R]:
    """Run a function under the figure style alone, whatever the user's own settings."""

    @functools.wraps(function)
    def inside(*args: P.args, **kwargs: P.kwargs) -> R:
        with matplotlib.rc_context():
            backend = matplotlib.get_backend()
            matplotlib.rcdefaults()
            matplotlib.rcParams.update({**STYLE, "backend": backend})
            return function(*args, **kwargs)

    return inside


@styled
def new_figure(height_in: float, width_in: float = PRINT_WIDTH_IN) -> Figure:
    """Return an empty figure of print width whose layout keeps labels inside."""
    return Figure(figsize=(width_in, height_in), layout="constrained")


@styled
def save(figure: Figure, stem: str | Path) -> tuple[Path, Path]:
    """Write `stem`.svg and `stem`.png, each atomically and without a date; return their paths."""
    stem = Path(stem)
    svg, png = stem.with_name(f"{stem.name}.svg"), stem.with_name(f"{stem.name}.png")
    with atomic_write(svg, "wb") as handle:
        figure.savefig(handle, format="svg", metadata={"Date": None, "Creator": "motionstyle"})
    with atomic_write(png, "wb") as handle:
        figure.savefig(handle, format="png", dpi=PNG_DPI, metadata={"Software": "motionstyle"})
    figure.clear()
    return svg, png


def blank_figure(text: str) -> Figure:
    """Return a figure that says why there is nothing to draw."""
    figure = new_figure(1.0)
    figure.text(0.5, 0.5, text, ha="center", va="center")
    return figure


def motion_title(motion: Motion, title: str | None = None) -> str:
    """Return a motion's title, by default its id; those of planted motions say so."""
    text = motion.id if title is None else title
    planted = motion.kind == "planted" or bool(motion.provenance.get("planted"))
    return f"{text} (planted)" if planted and "planted" not in text.lower() else text


def series_style(index: int) -> dict[str, object]:
    """Return colour and line style of the index-th of several curves."""
    lines = SERIES_LINES[index % len(SERIES_LINES)]
    return {"color": SERIES[index % len(SERIES)], "linestyle": lines}
