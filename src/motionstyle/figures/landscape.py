"""Energy along the straight way from a captured motion to the optimum, after Fig. 4."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from motionstyle.figures.style import new_figure, series_style, styled

# Label, and the number of the series' style (black is the total's).
TERMS = {
    "muscles": (r"muscles, $\Sigma\,\alpha\,Q_m^2$", 0),
    "root": (r"root residual, $w_r\,\Sigma\,Q_0^2$", 1),
    "feet": ("held feet off their targets", 2),
    "ranges": ("beyond joint ranges", 3),
    "clearance": ("swinging feet below ground", 5),
    "contact forces": ("size of contact forces", 6),
}
LEAST_SHARE = 1e-6  # of the largest total, shown at least


@styled
def landscape_figure(found: Mapping[str, Sequence[float]], title: str) -> Figure:
    """Return the terms of the objective over s, with X_T at 0 and X_S at 1.

    Left all terms on a logarithmic scale, right what the muscles do alone. In between the straight
    way leaves the physics: the root residual is large there, whatever the contact forces.

    found : of `evaluation.spacetime.landscape.landscape`.
    """
    s = np.asarray(found["s"])
    total = np.asarray(found["total"])
    figure = new_figure(3.0)
    left, right = figure.subplots(1, 2)
    left.plot(s, total, color="black", lw=1.6, label="all terms")
    floor = LEAST_SHARE * total.max()
    for name, (label, k) in TERMS.items():
        values = np.asarray(found[name])
        if values.max() > floor:
            left.plot(s, np.maximum(values, floor / 10), label=label, lw=1.0, **series_style(k))
    left.set_yscale("log")
    left.set_ylim(floor, 3 * total.max())
    left.set_ylabel("terms of the objective")
    right.plot(s, found["muscles"], lw=1.2, **series_style(0))
    right.set_ylim(bottom=0)
    right.set_ylabel(TERMS["muscles"][0])
    for axes in (left, right):
        axes.set_xlabel("s, share of the way from $X_T$ to $X_S$")
        for place, name in ((0.0, "$X_T$"), (1.0, "$X_S$")):
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
