"""Ground reaction forces: estimated from markers, over what force plates measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from motionstyle.figures.style import LEFT, RIGHT, new_figure, styled

_COMPONENTS = ("vertical", "fore–aft", "lateral")
_COLOURS = {"r": RIGHT, "l": LEFT}


@styled
def force_plate_figure(clips: Mapping[str, Sequence[Mapping[str, Any]]]) -> Figure:
    """Return one row of axes per clip and one column per component, in body weights.

    clips : by id, the curves of `evaluation.force_plates.force_curves`.
    """
    figure = new_figure(0.8 * len(clips) + 0.8)
    grid = figure.subplots(len(clips), 3, squeeze=False, sharex="row")
    for axes, (id, curves) in zip(grid, clips.items(), strict=True):
        for k, one in enumerate(axes):
            for curve in curves:
                colour, times = _COLOURS[curve["foot"]], np.array(curve["times"])
                measured = np.array(curve["measured"][k], dtype=float)
                one.plot(times, measured, color="0.25", lw=1.6, alpha=0.6)
                one.plot(times, curve["estimated"][k], color=colour, lw=1.0)
            one.axhline(0, color="0.6", lw=0.5)
        axes[0].set_ylabel(id, rotation=0, ha="right", va="center")
    for one, name in zip(grid[0], _COMPONENTS, strict=True):
        one.set_title(f"{name}, body weights")
    for one in grid[-1]:
        one.set_xlabel("time, s")
    handles = [
        Line2D([], [], color=RIGHT, label="right foot, estimated"),
        Line2D([], [], color=LEFT, label="left foot, estimated"),
        Line2D([], [], color="0.25", lw=1.6, alpha=0.6, label="force plates"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure
