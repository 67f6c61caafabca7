"""Figures of style machines as models: states, priors, graphs, annealing, the dance.

Each function draws one row or two of the checklist (style_machines.md §9) from tables and arrays.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Ellipse, FancyArrowPatch
from numpy.typing import NDArray

from motionstyle.figures.style import (
    BAND,
    GROUND,
    SERIES,
    SMALL_PT,
    blank_figure,
    new_figure,
    styled,
)
from motionstyle.shmm.choreography import leaving

Array = NDArray[np.float64]
Arrays = Mapping[str, NDArray[np.generic]]
LEAST_ARC = 0.15  # of the exits from a state
NO_DATA = "no motions for this figure in this run"


def _ellipse(axes: Axes, mean: Array, covariance: Array, colour: str, **style: object) -> None:
    """Draw the one-sigma ellipse of a two-dimensional Gaussian."""
    values, vectors = np.linalg.eigh(covariance[:2, :2])
    angle = float(np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1])))
    width, height = 2 * np.sqrt(np.maximum(values[::-1], 0))
    axes.add_patch(
        Ellipse(tuple(mean[:2]), width, height, angle=angle, fill=False, edgecolor=colour, **style)
    )


@styled
def models_figure(arrays: Arrays, checks: pd.DataFrame) -> Figure:
    """Return Fig. 1 with real walks: data, one model, individual, cross-entropy, generic + v."""
    if "walks_walk_0" not in arrays:
        return blank_figure(NO_DATA)
    figure = new_figure(2.35)
    panels = figure.subplots(1, 5, sharex=True, sharey=True)
    walks = [arrays[k] for k in sorted(arrays) if k.startswith("walks_walk_")]
    titles = [
        "A: three walks",
        "B: one for all",
        "C: individual",
        "D: cross-entropy",
        "E: generic + v",
    ]
    names = (None, "one_for_all", "individual", "cross_entropy", None)
    numbers = dict(zip(checks["quantity"], checks["value"], strict=True))
    for axes, title, name in zip(panels, titles, names, strict=True):
        for r, walk in enumerate(walks):
            axes.plot(*walk.T[:2], color=SERIES[r], linewidth=0.5, alpha=0.6)
        text = title
        if name:
            text += f"\nheld-out {float(numbers[f'held_out_{name}']):.1f} nat/frame"
        axes.set_title(text, loc="left", fontsize=SMALL_PT)
        axes.set_xlabel("PC 1, m")
    for mean, cov in zip(
        arrays["walks_pooled_means"], arrays["walks_pooled_covariances"], strict=True
    ):
        _ellipse(panels[1], mean, cov, "black", linewidth=0.7)
    for axes, kind in ((panels[2], "alone"), (panels[3], "cross")):
        stack = zip(arrays[f"walks_{kind}_means"], arrays[f"walks_{kind}_covariances"], strict=True)
        for r, (means, covs) in enumerate(stack):
            for mean, cov in zip(means, covs, strict=True):
                _ellipse(axes, mean, cov, SERIES[r], linewidth=0.7)
        for state in range(arrays[f"walks_{kind}_means"].shape[1]):  # same state in all models
            axes.plot(*arrays[f"walks_{kind}_means"][:, state].T, color=GROUND, linewidth=0.4)
    generic = arrays["walks_generic_means"]
    for mean, cov in zip(generic, arrays["walks_generic_covariances"], strict=True):
        _ellipse(panels[4], mean, cov, "black", linewidth=0.7)
    for r, means in enumerate(arrays["walks_cross_means"]):
        for state in range(len(means)):
            panels[4].plot(
                [generic[state, 0], means[state, 0]],
                [generic[state, 1], means[state, 1]],
                color=SERIES[r],
                linewidth=0.7,
            )
    panels[0].set_ylabel("PC 2, m")
    return figure


@styled
def priors_figure(arrays: Arrays) -> Figure:
    """Return Fig. 2: growing entropy and cross-entropy priors on one cloud, eq. (17)."""
    figure = new_figure(2.9)
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    labels = ("entropy", "holding"), ("Z (entropy: shrinks)", "Z′ (cross-entropy: draws)")
    for axes, kind, title in zip(panels, *labels, strict=True):
        axes.plot(*arrays["priors_points"].T, ".", color=BAND, markersize=4)
        strengths = arrays[f"priors_{kind}"]
        for k, strength in enumerate(strengths):
            shade = SERIES[k % len(SERIES)]
            mean = arrays[f"priors_{kind}_means"][k]
            _ellipse(axes, mean, arrays[f"priors_{kind}_covariances"][k], shade, linewidth=1.1)
            axes.plot(*mean, "+", color=shade)
            axes.plot([], [], color=shade, label=f"{strength:g}")
        axes.set_title(title, loc="left")
        axes.legend(title="data points", title_fontsize=SMALL_PT, loc="lower right")
        axes.set_xlabel("feature 1")
        axes.set_aspect("equal")
    reference = arrays["priors_reference_mean"], arrays["priors_reference_covariance"]
    _ellipse(panels[1], *reference, "black", linewidth=1.2, linestyle="--")
    panels[1].annotate("reference", reference[0], fontsize=SMALL_PT, ha="center")
    panels[0].set_ylabel("feature 2")
    return figure


@styled
def dance_figure(arrays: Arrays, name: str, row: Mapping[str, object] | None) -> Figure:
    """Return Fig. 4: the state machine of the dances, and when each dance is in which state."""
    if row is None:
        return blank_figure(NO_DATA)
    transitions = np.asarray(arrays[f"{name}_transitions"], dtype=float)
    names = [str(n) for n in arrays[f"{name}_names"]]
    figure = new_figure(1.35 * len(names) + 0.6)
    grid = figure.add_gridspec(len(names), 2, width_ratios=[1, 1.25])
    graph = figure.add_subplot(grid[:, 0])
    places = _graph_places(np.asarray(arrays[f"{name}_means"], dtype=float))
    next_state = leaving(transitions)
    for i, j in np.argwhere(next_state > LEAST_ARC):
        graph.add_patch(
            FancyArrowPatch(
                tuple(places[i]),
                tuple(places[j]),
                arrowstyle="-|>",
                mutation_scale=4,
                linewidth=0.2 + 0.8 * float(next_state[i, j]),
                color=GROUND,
                connectionstyle="arc3,rad=0.15",
                shrinkA=3,
                shrinkB=3,
            )
        )
    stay = np.diagonal(transitions)
    dots = graph.scatter(
        *places.T, c=1 / np.maximum(1 - stay, 0.02), s=16, cmap="viridis", zorder=2
    )
    figure.colorbar(dots, ax=graph, location="bottom", shrink=0.8, label="mean dwell, frames")
    graph.set_title(
        f"{row['states_start']} to {row['states_end']} states, {row['parameters']} parameters, "
        f"{row['frames']} frames\n(paper: 75 to 69, about 3500, over 6000);\n"
        "arcs: over 15 % of exits",
        loc="left",
        fontsize=SMALL_PT,
    )
    graph.set_xlabel("mean pose, PC 1, m")
    graph.set_ylabel("mean pose, PC 2, m")
    rate = float(row["rate_hz"])  # type: ignore[arg-type]
    for r, dance in enumerate(names):
        axes = figure.add_subplot(grid[r, 1])
        gamma = np.asarray(arrays[f"{name}_occupancy_{r}"], dtype=float)
        axes.imshow(
            gamma.T,
            aspect="auto",
            origin="lower",
            cmap="Greys",
            extent=(0, len(gamma) / rate, 0, gamma.shape[1]),
            interpolation="nearest",
            vmin=0,
            vmax=1,
        )
        axes.set_title(f"occupancy of {dance}", loc="left", fontsize=SMALL_PT)
        axes.set_ylabel("state")
        axes.set_xlabel("time, s" if r == len(names) - 1 else "")
    return figure


def _graph_places(means: Array) -> Array:
    """Return where states stand on paper: their means' first two principal components."""
    centred = means - means.mean(axis=0)
    _, _, axes = np.linalg.svd(centred, full_matrices=False)
    return centred @ axes[:2].T


@styled
def graphs_figure() -> Figure:
    """Return Fig. 7: the dependences of a hidden Markov model, a stylistic one and a path map."""
    figure = new_figure(2.3)
    panels = figure.subplots(1, 3)
    rows = {
        "hidden Markov model": (("s", 1.0), ("x", 0.0)),
        "stylistic model": (("s", 1.0), ("x", 0.0), ("v", -1.0)),
        "path map": (("u", 2.0), ("s", 1.0), ("y", 0.0)),
    }
    for axes, (title, layers) in zip(panels, rows.items(), strict=True):
        for letter, y in layers:
            for t in range(3):
                if letter == "v" and t != 1:
                    continue
                seen = letter in "xyu"
                axes.add_patch(
                    Circle(
                        (t, y),
                        0.24,
                        facecolor=BAND if seen else "white",
                        edgecolor="black",
                        zorder=2,
                    )
                )
                sign = {0: "{t-1}", 1: "t", 2: "{t+1}"}[t]
                text = f"${letter}$" if letter == "v" else f"${letter}_{sign}$"
                axes.text(t, y, text, ha="center", va="center", zorder=3, fontsize=6)
        for t in range(3):
            pairs = [((t, 1.0), (t, 0.0))]
            if t < 2:
                pairs.append(((t, 1.0), (t + 1, 1.0)))
            if title == "stylistic model":
                pairs.append(((1, -1.0), (t, 0.0)))
            if title == "path map":
                pairs.append(((t, 1.0), (t, 2.0)))
            for a, b in pairs:
                axes.add_patch(
                    FancyArrowPatch(
                        a, b, arrowstyle="-|>", mutation_scale=8, shrinkA=13, shrinkB=13
                    )
                )
        axes.set_title(title, loc="left")
        axes.set_xlim(-0.5, 2.5)
        axes.set_ylim(-1.5, 2.5)
        axes.set_aspect("equal")
        axes.set_axis_off()
    return figure


@styled
def annealing_figure(arrays: Arrays) -> Figure:
    """Return Fig. 8: log-posterior over the steps of annealed and plain runs from random starts."""
    if "annealing_annealed" not in arrays:
        return blank_figure(NO_DATA)
    figure = new_figure(2.8)
    left, right = figure.subplots(1, 2, width_ratios=[2, 1])
    finals = []
    for k, kind in enumerate(("annealed", "plain")):
        lines = np.asarray(arrays[f"annealing_{kind}"], dtype=float)
        for r, line in enumerate(lines):
            left.plot(line, color=SERIES[k], linewidth=0.7, label=kind if r == 0 else None)
        finals.append(lines[:, -1])
    left.set_xlabel("EM step (the objective of annealed runs changes with the temperature)")
    left.set_ylabel("log-posterior, nat per frame")
    low = float(np.quantile(np.concatenate([arrays["annealing_plain"].ravel()]), 0.02))
    left.set_ylim(bottom=low)
    left.legend(loc="lower right")
    for k, values in enumerate(finals):
        right.plot(np.full(len(values), k), values, "o", color=SERIES[k], markersize=3)
        right.plot([k - 0.2, k + 0.2], [np.median(values)] * 2, color="black", linewidth=1)
        right.text(
            k,
            1.0,
            f"range {np.ptp(values):.2f}",
            transform=right.get_xaxis_transform(),
            fontsize=SMALL_PT,
            ha="center",
            va="bottom",
        )
    right.set_xticks([0, 1], ["annealed", "plain"])
    right.set_xlim(-0.6, 1.6)
    right.set_ylabel("at the end, nat per frame")
    return figure
