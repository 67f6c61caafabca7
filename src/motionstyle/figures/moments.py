"""Joint moments over the gait cycle against published bands (biomechanics.md §4.4)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from motionstyle.evaluation.normative import Band, Normative
from motionstyle.figures.style import BAND, LEFT, RIGHT, blank_figure, new_figure, styled

Array = NDArray[np.float64]
PERCENT = np.linspace(0, 100, 101)
BAR_WIDTH_PCT = 5.0
JOINT_TITLES = ("hip, flexion +", "knee, flexion +", "ankle, dorsiflexion +")
OWN, PLATE, SINGLE, EDGE = "#000000", "#009E73", "#AAAAAA", "#CC79A7"


def _cycles(clips: list[Mapping[str, Any]], source: str, joint: str) -> Array:
    """Return the mean cycles of all clips and sides, (C, 101), N·m/kg."""
    found = [cycle for clip in clips for cycle in clip[source][joint].values()]
    return np.array(found).reshape(len(found), 101)


def _panel(
    axes: Axes, clips: list[Mapping[str, Any]], joint: str, bands: Mapping[int, Band]
) -> None:
    """Draw the bands as bars, the clips' cycles and their medians."""
    for percent, band in bands.items():
        bar = (percent, band.high - band.low, BAR_WIDTH_PCT, band.low)
        axes.bar(*bar, color=BAND, zorder=0)
        axes.bar(*bar, fill=False, edgecolor=EDGE, linewidth=0.9, zorder=4)
        ends = [percent - BAR_WIDTH_PCT / 2, percent + BAR_WIDTH_PCT / 2]
        axes.plot(ends, [band.midpoint] * 2, color=EDGE, lw=0.9, zorder=4)
    own, plate = (_cycles(clips, source, joint) for source in ("estimated", "measured"))
    axes.plot(PERCENT, own.T, color=SINGLE, linewidth=0.4, alpha=0.7)
    for cycles, colour, style in ((own, OWN, "-"), (plate, PLATE, (0, (4, 1.5)))):
        if len(cycles):
            axes.plot(PERCENT, np.median(cycles, axis=0), color=colour, linestyle=style, lw=1.6)
    low, high = np.percentile(np.concatenate([own, plate]) if len(plate) else own, [1, 99])
    edges = [edge for band in bands.values() for edge in (band.low, band.high)]
    axes.set_ylim(min([low, *edges]) - 0.2, max([high, *edges]) + 0.2)
    axes.axhline(0, color="black", linewidth=0.4)
    axes.set_xlim(-4, 104)
    axes.set_xticks([0, 25, 50, 75, 100])


@styled
def joint_moment_figure(clips: Mapping[str, Mapping[str, Any]], normative: Normative) -> Figure:
    """Return hip, knee and ankle moments over the cycle, of level walks and of runs.

    Parameters
    ----------
    clips : by id, of `evaluation.joint_moments.cycle_curves`.
    """
    kinds = [
        ("walks", [c for c in clips.values() if c["level_walk"]]),
        ("runs", [c for c in clips.values() if c["action"].startswith(("run", "dash"))]),
    ]
    kinds = [(name, some) for name, some in kinds if len(_cycles(some, "estimated", "hip"))]
    if not kinds:
        return blank_figure("no physical walk or run with a complete cycle")
    figure = new_figure(0.6 + 2.1 * len(kinds))
    grid = figure.subplots(len(kinds), 3, squeeze=False)
    for row, (name, some) in zip(grid, kinds, strict=True):
        for axes, joint, title in zip(row, normative.moments, JOINT_TITLES, strict=True):
            _panel(axes, some, joint, normative.moments[joint] if name == "walks" else {})
            axes.set_title(f"{name}: {title}", loc="left")
        sides = len(_cycles(some, "estimated", "hip"))
        seen = len(_cycles(some, "measured", "hip"))
        legs = f"(legs: {sides}, on plates: {seen})" if seen else f"(legs: {sides})"
        row[0].set_ylabel(f"moment, N·m/kg\n{legs}")
    for axes in grid[-1]:
        axes.set_xlabel("cycle from heel strike, %")
    handles = [
        Patch(facecolor=BAND, edgecolor=EDGE, label="published 2.5–97.5 %, midpoint"),
        Line2D([], [], color=SINGLE, label="one leg of a clip, estimated forces"),
        Line2D([], [], color=OWN, lw=1.6, label="their median"),
    ]
    if any(len(_cycles(some, "measured", "hip")) for _name, some in kinds):
        dashes = (0, (4, 1.5))
        handles += [Line2D([], [], color=PLATE, ls=dashes, lw=1.6, label="median, plates' forces")]
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure


@styled
def plate_moment_figure(clips: Mapping[str, list[Mapping[str, Any]]]) -> Figure:
    """Return moments under estimated forces over those under the plates', clip by clip.

    clips : by id, of `evaluation.joint_moments.plate_curves`.
    """
    figure = new_figure(0.85 * len(clips) + 0.8)
    grid = figure.subplots(len(clips), 3, squeeze=False, sharex="row")
    for row, (id, curves) in zip(grid, clips.items(), strict=True):
        for k, axes in enumerate(row):
            for curve in curves:
                times = np.array(curve["times"])
                measured = np.array(curve["measured"][k], dtype=float)
                seen = np.isfinite(measured)
                estimated = np.where(seen, curve["estimated"][k], np.nan)
                colour = RIGHT if curve["foot"] == "r" else LEFT
                axes.plot(times, measured, color="0.25", lw=1.8, alpha=0.55)
                axes.plot(times, estimated, color=colour, lw=1.0)
            axes.axhline(0, color="0.6", lw=0.5)
        row[0].set_ylabel(id.replace("_", "\n", 1), rotation=0, ha="right", va="center")
    for axes, title in zip(grid[0], JOINT_TITLES, strict=True):
        axes.set_title(f"{title}, N·m/kg", loc="left")
    for axes in grid[-1]:
        axes.set_xlabel("time, s")
    handles = [
        Line2D([], [], color=RIGHT, label="right leg, estimated forces"),
        Line2D([], [], color=LEFT, label="left leg, estimated forces"),
        Line2D([], [], color="0.25", lw=1.8, alpha=0.55, label="plates' forces"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure
