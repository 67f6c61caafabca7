"""Energy along the straight way from a captured motion to the optimum, after Fig. 4."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from motionstyle.figures.style import new_figure, series_style, styled

LABELS = {
    "muscles": "muscles, Σ α Q_m²",
    "root": "root residual, 100 Σ Q_0²",
    "feet": "held feet off their targets",
    "ranges": "beyond joint ranges",
    "clearance": "swinging feet below ground",
    "contact forces": "size of contact forces",
}
LEAST_SHARE = 1e-6  # of the largest total, shown at least


@styled
def landscape_figure(found: Mapping[str, Sequence[float]], title: str) -> Figure:
    """Return the terms of the objective over s, with X_T at 0 and X_S at 1.

    Left all terms on a logarithmic scale, right E of eq. (13) and the total between the two.

    found : of `evaluation.spacetime.landscape.landscape`.
    """
    s = np.asarray(found["s"])
    total = np.asarray(found["total"])
    energy = np.asarray(found["muscles"]) + np.asarray(found["root"])
    figure = new_figure(3.0)
    left, right = figure.subplots(1, 2)
    left.plot(s, total, color="black", lw=1.6, label="all terms")
    floor = LEAST_SHARE * total.max()
    for k, (name, label) in enumerate(LABELS.items()):
        values = np.asarray(found[name])
        if values.max() > floor:
            left.plot(s, np.maximum(values, floor / 10), label=label, lw=1.0, **series_style(k))
    left.set_yscale("log")
    left.set_ylim(floor, 3 * total.max())
    left.set_ylabel("N² m² (root: N² too)")
    inside = (s >= -0.05) & (s <= 1.05)
    right.plot(s[inside], total[inside], color="black", lw=1.6, label="all terms")
    right.plot(s[inside], energy[inside], lw=1.0, label="E, eq. (13)", **series_style(0))
    right.set_ylim(bottom=0)
    right.set_ylabel("N² m²")
    right.legend()
    for axes in (left, right):
        axes.set_xlabel("s, share of the way from X_T to X_S")
        for place, name in ((0.0, "X_T"), (1.0, "X_S")):
            axes.axvline(place, color="0.6", lw=0.5)
            axes.annotate(
                name, (place, 1.0), xycoords=("data", "axes fraction"), fontsize="small",
                xytext=(2, -2), textcoords="offset points", va="top",
            )  # fmt: skip
    figure.legend(
        *left.get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize="x-small"
    )
    figure.suptitle(title)
    return figure
