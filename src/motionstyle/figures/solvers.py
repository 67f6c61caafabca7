"""How solvers get on: energy over time from all starts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure

from motionstyle.figures.style import blank_figure, new_figure, series_style, styled


@styled
def solver_figure(problems: Sequence[Mapping[str, Any]]) -> Figure:
    """Return E over seconds of the structured solver, one panel a problem, a line a start.

    problems : results of `spacetime.comparison.compare_designs`, each row naming its problem.
    """
    drawn = [one for one in problems if one["traces"]]
    if not drawn:
        return blank_figure("no solver comparison in this run")
    columns = min(3, len(drawn))
    rows = -(-len(drawn) // columns)
    figure = new_figure(1.9 * rows + 0.5)
    grid = figure.subplots(rows, columns, squeeze=False)
    for axes, one in zip(grid.flat, drawn, strict=False):
        best = min(row["E"] for row in one["rows"])
        for k, trace in enumerate(one["traces"]):
            seconds = [step["seconds"] for step in trace["steps"]]
            energy = [max(step["E"] / best, 1.0) for step in trace["steps"]]
            done = "" if trace["status"] == "converged" else " (not converged)"
            axes.plot(seconds, energy, label=f"{trace['start']}{done}", lw=0.9, **series_style(k))
        axes.set_yscale("log")
        axes.set_ylim(0.8, 1e4)  # starts lie far above
        axes.axhline(1.01, color="0.6", lw=0.5)
        axes.set_title(one["rows"][0]["problem"])
        axes.legend(fontsize="x-small")
    for axes in grid.flat[len(drawn) :]:
        axes.set_visible(False)
    for axes in grid[:, 0]:
        axes.set_ylabel("E / best E")
    for k, axes in enumerate(grid.flat[: len(drawn)]):
        if k + columns >= len(drawn):  # nothing drawn below it
            axes.set_xlabel("seconds")
    return figure
