"""The force and moment at the pelvis before and after the physics fit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from motionstyle.figures.style import LEFT, RIGHT, SMALL_PT, blank_figure, new_figure, styled

BEFORE, AFTER = "#777777", LEFT
LIMIT_PCTBW = 1.0  # goal for physical clips
_PANELS = (
    ("force at the pelvis, % of body weight (rms)", "force_before_pctbw", "force_after_pctbw"),
    ("moment at the pelvis, N·m (rms)", "moment_before_nm", "moment_after_nm"),
)


@styled
def residual_figure(rows: Sequence[dict[str, str]]) -> Figure:
    """Return a line per clip from its residual before the fit to that after, on log scales.

    rows : of `tables/root_residual.csv`, cells as text; failed clips are left out.
    """
    known = [row for row in rows if row["status"] != "failed"]
    if not known:
        return blank_figure("no physical motion to show")
    known.sort(key=lambda row: float(row["force_before_pctbw"]))
    places = np.arange(len(known))
    figure = new_figure(0.9 + 0.13 * len(known))
    grid = figure.subplots(1, 2, sharey=True)
    for axes, (title, before, after) in zip(grid, _PANELS, strict=True):
        for place, row in zip(places, known, strict=True):
            done = row["status"] == "converged"
            colour = AFTER if done else RIGHT
            ends = [float(row[before]), float(row[after])]
            axes.plot(ends, [place] * 2, color="#CCCCCC", linewidth=0.8, zorder=0)
            axes.plot(ends[0], place, "o", color=BEFORE, markersize=3)
            axes.plot(ends[1], place, "o" if done else "X", color=colour, markersize=4)
        axes.set_xscale("log")
        axes.set_xlabel(title)
        axes.grid(axis="x", color="#EEEEEE", linewidth=0.5)
        axes.set_axisbelow(True)
    grid[0].axvline(LIMIT_PCTBW, color="black", linewidth=0.7, linestyle=(0, (4, 2)))
    grid[0].text(LIMIT_PCTBW, len(known) - 0.4, "goal 1 %", fontsize=SMALL_PT, ha="center")
    grid[0].set_yticks(places, [row["id"] for row in known])
    grid[0].set_ylim(-0.7, len(known) + 0.3)
    handles = [
        Line2D([], [], color=BEFORE, marker="o", ls="", ms=3, label="before: best contact forces"),
        Line2D([], [], color=AFTER, marker="o", ls="", ms=4, label="after the fit"),
        Line2D([], [], color=RIGHT, marker="X", ls="", ms=4, label="after, fit not converged"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure
