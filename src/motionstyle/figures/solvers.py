"""How solvers get on: energy over time from all starts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from motionstyle.figures.style import blank_figure, new_figure, series_style, styled


@styled
def solver_figure(problems: Sequence[Mapping[str, Any]]) -> Figure:
    """Return E over seconds of the structured solver, one panel a problem, a line a start.

    A cross ends the line of a solve that did not converge.

    problems : results of `spacetime.comparison.compare_designs`, each row naming its problem.
    """
    drawn = [one for one in problems if one["traces"]]
    if not drawn:
        return blank_figure("no solver comparison in this run")
    columns = min(3, len(drawn))
    rows = -(-len(drawn) // columns)
    figure = new_figure(1.9 * rows + 0.7)
    grid = figure.subplots(rows, columns, squeeze=False)
    starts = list(dict.fromkeys(trace["start"] for one in drawn for trace in one["traces"]))
    for axes, one in zip(grid.flat, drawn, strict=False):
        best = min(row["E"] for row in one["rows"])
        for trace in one["traces"]:
            seconds = [step["seconds"] for step in trace["steps"]]
            energy = [max(step["E"] / best, 1.0) for step in trace["steps"]]
            look = series_style(starts.index(trace["start"]))
            axes.plot(seconds, energy, lw=0.9, **look)
            if trace["status"] != "converged":
                axes.plot(seconds[-1], energy[-1], "x", color=look["color"], ms=5)
        axes.set_yscale("log")
        axes.set_ylim(0.8, 1e4)  # starts lie far above
        axes.axhline(1.01, color="0.6", lw=0.5)
        axes.set_title(one["rows"][0]["problem"])
    for axes in grid.flat[len(drawn) :]:
        axes.set_visible(False)
    for axes in grid[:, 0]:
        axes.set_ylabel("E / best E")
    for k, axes in enumerate(grid.flat[: len(drawn)]):
        if k + columns >= len(drawn):  # nothing drawn below it
            axes.set_xlabel("seconds")
    handles = [Line2D([], [], label=one, **series_style(k)) for k, one in enumerate(starts)]
    handles.append(Line2D([], [], marker="x", ls="", color="0.3", label="not converged"))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    return figure
