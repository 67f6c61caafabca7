"""Figures of style machines: models, priors, explained variance, dances, annealing, analogies.

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
    PRINT_WIDTH_IN,
    SERIES,
    SMALL_PT,
    blank_figure,
    new_figure,
    series_style,
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
def dof_figure(explained: pd.DataFrame) -> Figure:
    """Return Fig. 3 and E1: explained variance by style DOF, and its distribution over draws."""
    sets = [s for s in explained["set"].unique() if s != "draw"]
    if not sets:
        return blank_figure(NO_DATA)
    figure = new_figure(2.8)
    left, right = figure.subplots(1, 2, width_ratios=[1.5, 1])
    k = 0
    for name in sets:
        rows = explained[explained["set"] == name]
        for prior in rows["prior"].unique():
            part = rows[rows["prior"] == prior]
            label = (
                f"{name.replace('_', ', ')}, {'cross-entropy' if prior != 'none' else 'no'} prior"
            )
            left.plot(part["dof"], 100 * part["cumulative_share"], **series_style(k), label=label)
            k += 1
    left.axhline(93, color=GROUND, linewidth=0.8)
    left.annotate("paper: 93 % with 3", (1, 94), ha="left", va="bottom", fontsize=SMALL_PT)
    left.set_xlabel("style degrees of freedom")
    left.set_ylabel("explained variation about the generic model, %")
    left.set_ylim(0, 104)
    left.legend(loc="lower right")
    draws = explained[(explained["set"] == "draw") & (explained["dof"] == 3)]
    if len(draws):
        values = 100 * draws["cumulative_share"].astype(float)
        right.hist(values, bins=20, color=SERIES[0])
        right.axvline(values.median(), color="black", linewidth=1)
        right.set_title(
            f"{len(draws)} random draws of ten, median {values.median():.0f} %", loc="left"
        )
        right.set_xlabel("explained by 3 DOF, %")
        right.set_ylabel("draws")
    else:
        right.text(
            0.5, 0.5, "random draws of ten\nare made in the full run", ha="center", va="center"
        )
        right.set_axis_off()
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


@styled
def axes_figure(style_dof: pd.DataFrame, arrays: Arrays) -> Figure:
    """Return E2: models in the style space, and the correlation of its axes with gait."""
    if not len(style_dof):
        return blank_figure(NO_DATA)
    figure = new_figure(3.1)
    left, right = figure.subplots(1, 2, width_ratios=[1, 1.2])
    v = np.asarray(arrays["style_coordinates"], dtype=float)
    for place, name in zip(v, arrays["style_names"], strict=True):
        run = "run" in str(name)
        left.plot(
            place[0],
            place[1] if v.shape[1] > 1 else 0,
            "s" if run else "o",
            color=SERIES[int(run)],
            markersize=4,
        )
        words = (
            str(name)
            .replace("planted-", "")
            .replace("bandai2_", "")
            .removesuffix("-take1")
            .removesuffix("_001")
        )
        left.annotate(
            words.replace("_", " "),
            (place[0], place[1] if v.shape[1] > 1 else 0),
            fontsize=5.5,
            xytext=(2, 2),
            textcoords="offset points",
        )
    left.plot(0, 0, "+", color="black")
    left.set_xlabel("style axis 1 (+: the generic model)")
    left.set_ylabel("style axis 2")
    left.margins(0.15)
    quantities = list(style_dof["quantity"].unique())
    dofs = sorted(style_dof["dof"].unique())
    for k, dof in enumerate(dofs):
        rows = style_dof[style_dof["dof"] == dof].set_index("quantity")
        places = np.arange(len(quantities)) + (k - (len(dofs) - 1) / 2) * 0.26
        right.barh(
            places,
            rows.loc[quantities, "correlation"].astype(float),
            0.24,
            color=SERIES[k],
            label=f"axis {dof}",
        )
    right.set_yticks(
        range(len(quantities)), [q.rpartition("_")[0].replace("_", " ") for q in quantities]
    )
    right.axvline(0, color="black", linewidth=0.5)
    right.set_xlim(-1, 1)
    right.set_xlabel("correlation over the models")
    right.legend(loc="best")
    return figure


@styled
def analogies_figure(table: pd.DataFrame) -> Figure:
    """Return the pose distance of each method's answers, one panel a set, pairs as dots."""
    ok = table[table["status"] == "ok"]
    sets = list(ok["set"].unique())
    if not sets:
        return blank_figure(NO_DATA)
    figure = new_figure(2.9)
    panels = figure.subplots(1, len(sets), sharey=True, squeeze=False)[0]
    for axes, name in zip(panels, sets, strict=True):
        rows = ok[ok["set"] == name]
        methods = list(rows["method"].unique())
        medians = rows.groupby(["method", "pair"])["pose_distance_deg"].median()
        for k, method in enumerate(methods):
            values = medians[method].to_numpy(dtype=float)
            spread = (np.arange(len(values)) / max(1, len(values) - 1) - 0.5) * 0.5
            axes.plot(k + spread, np.sort(values), ".", color=SERIES[k % len(SERIES)], markersize=3)
            axes.plot([k - 0.35, k + 0.35], [np.median(values)] * 2, color="black", linewidth=1)
            axes.text(k, 0.3, f"{np.median(values):.1f}", ha="center", fontsize=SMALL_PT)
        labels = [m.replace("style_machine", "style machine").replace("_", " ") for m in methods]
        axes.set_xticks(
            range(len(methods)), [label.replace(" ", "\n") for label in labels], fontsize=SMALL_PT
        )
        takes = rows["take"].nunique()
        axes.set_title(f"{name}: {rows['pair'].nunique()} pairs, {takes} take(s)", loc="left")
    panels[0].set_ylim(bottom=0)  # shared: once all panels hold their points
    panels[0].set_ylabel(
        "pose distance to the true run, deg\n(median over takes; line: median of pairs)"
    )
    return figure


@styled
def held_out_figure(table: pd.DataFrame) -> Figure:
    """Return E10: likelihood of unseen takes against ordinary EM, and style retrieval."""
    if not len(table):
        return blank_figure(NO_DATA)
    figure = new_figure(2.8)
    left, right = figure.subplots(1, 2)
    likelihood = table[table["test"] == "likelihood"]
    wide = likelihood.pivot_table(index="motion", columns="method", values="loglik_nat_per_frame")
    ordinary = wide["ordinary"].to_numpy(dtype=float)
    for k, method in enumerate(("entropic", "cross_entropy")):
        own = wide[method].to_numpy(dtype=float)
        wins = float((own > ordinary).mean())
        label = f"{method.replace('_', '-')}: better in {100 * wins:.0f} %"
        left.plot(ordinary, own, "o", color=SERIES[k], markersize=3, label=label)
    low = float(np.nanmin(wide.to_numpy(dtype=float)))
    ends = [min(2 * low, -10.0), 100.0]
    left.plot(ends, ends, color=GROUND, linewidth=0.8)
    for axis in (left.set_xscale, left.set_yscale):
        axis("symlog", linthresh=10.0)
    ticks = [-(10.0**k) for k in (5, 3, 1)] + [0.0, 10.0]
    ticks = [t for t in ticks if t >= ends[0]]
    left.set_xticks(ticks, [f"{t:.0f}" for t in ticks])
    left.set_yticks(ticks, [f"{t:.0f}" for t in ticks])
    left.minorticks_off()
    left.set_xlim(*ends)
    left.set_ylim(*ends)
    left.set_xlabel("ordinary EM, nat per frame of an unseen take")
    left.set_ylabel("with priors, nat per frame")
    left.legend(loc="lower right")
    found = table[table["test"] == "retrieval"]
    share = (
        found.assign(correct=found["correct"] == "yes").groupby(["set", "method"])["correct"].mean()
    )
    sets, methods = list(found["set"].unique()), list(found["method"].unique())
    for k, method in enumerate(methods):
        values = [100 * float(share[one, method]) for one in sets]
        places = np.arange(len(sets)) + (k - (len(methods) - 1) / 2) * 0.2
        right.bar(places, values, 0.18, color=SERIES[k], label=method.replace("_", " "))
    counts = [found[found["set"] == one]["style"].nunique() for one in sets]
    right.set_xticks(
        range(len(sets)), [f"{one}\n{c} styles" for one, c in zip(sets, counts, strict=True)]
    )
    right.set_ylabel("style of an unseen take found, %")
    right.set_ylim(0, 135)
    right.legend(loc="upper center", ncols=2)
    return figure


@styled
def driving_figure(table: pd.DataFrame, arrays: Arrays) -> Figure:
    """Return E7: silhouettes, and the joint error of driven dances against a look-up."""
    if not len(table):
        return blank_figure(NO_DATA)
    figure = new_figure(3.2)
    grid = figure.add_gridspec(2, 6, height_ratios=[1, 1.7])
    for k, image in enumerate(arrays["silhouettes"]):
        axes = figure.add_subplot(grid[0, k])
        axes.imshow(image, origin="lower", cmap="Greys", interpolation="nearest")
        axes.set_xticks([])
        axes.set_yticks([])
        if k == 0:
            axes.set_title("rendered silhouettes", loc="left", fontsize=SMALL_PT)
    axes = figure.add_subplot(grid[1, :])
    methods, cues = list(table["method"].unique()), list(table["cue"].unique())
    for k, method in enumerate(methods):
        for c, cue in enumerate(cues):
            rows = table[(table["method"] == method) & (table["cue"] == cue)]
            values = rows["joint_rms_deg"].to_numpy(dtype=float)
            place = c + (k - (len(methods) - 1) / 2) * 0.22
            axes.bar(
                place,
                np.median(values),
                0.2,
                color=SERIES[k],
                label=method.replace("_", " ") if c == 0 else None,
            )
            axes.plot(np.full(len(values), place), values, ".", color="black", markersize=3)
    axes.axhline(10, color=GROUND, linewidth=0.8)
    axes.set_xticks(range(len(cues)), [f"cue: {c}" for c in cues])
    axes.set_ylabel("joint error on unseen parts, deg rms")
    axes.legend(loc="upper left", ncols=3)
    axes.set_ylim(0, 1.25 * float(table["joint_rms_deg"].astype(float).max()))
    return figure


@styled
def phases_figure(arrays: Arrays, checks: pd.DataFrame) -> Figure:
    """Return E8: the states of all models over time; their order shows the phases of gait."""
    if "phases_names" not in arrays:
        return blank_figure(NO_DATA)
    names = [str(n) for n in arrays["phases_names"]]
    figure = new_figure(0.26 * len(names) + 0.9)
    axes = figure.subplots()
    longest = max(len(arrays[f"phases_{r}"]) for r in range(len(names)))
    image = np.full((len(names), longest), np.nan)
    for r in range(len(names)):
        image[r, : len(arrays[f"phases_{r}"])] = arrays[f"phases_{r}"]
    shown = axes.imshow(image, aspect="auto", cmap="twilight", interpolation="nearest")
    figure.colorbar(shown, ax=axes, label="state")
    axes.set_yticks(range(len(names)), names, fontsize=SMALL_PT)
    axes.set_xlabel("frame")
    numbers = dict(zip(checks["quantity"], checks["value"], strict=True))
    axes.set_title(
        f"phase purity {float(numbers['phase_purity']):.2f}, by chance "
        f"{float(numbers['phase_purity_chance']):.2f}",
        loc="left",
    )
    return figure


@styled
def twin_figure(table: pd.DataFrame) -> Figure:
    """Return E9: errors in states, subspace and style coordinates of known models."""
    figure = new_figure(2.4)
    panels = figure.subplots(1, 3)
    columns = {
        "states_found": "states found",
        "subspace_angle_deg": "angle of style subspaces, deg",
        "v_correlation": "correlation of v",
    }
    noises = list(table["noise"].unique())
    for axes, (column, label) in zip(panels, columns.items(), strict=True):
        for k, noise in enumerate(noises):
            values = table[table["noise"] == noise][column].to_numpy(dtype=float)
            axes.plot(np.full(len(values), k), values, "o", color=SERIES[k], markersize=4)
        axes.set_xticks(range(len(noises)), [f"{n} noise" for n in noises])
        axes.set_xlim(-0.5, len(noises) - 0.5)
        axes.set_ylabel(label)
    panels[0].axhline(float(table["states_true"].iloc[0]), color=GROUND, linewidth=0.8)
    panels[1].axhline(15, color=GROUND, linewidth=0.8)
    panels[1].set_ylim(bottom=0)
    panels[2].axhline(0.9, color=GROUND, linewidth=0.8)
    return figure


@styled
def novice_figure(table: pd.DataFrame) -> Figure:
    """Return E5 in numbers: a simulated novice before and after, by seed."""
    if not len(table):
        return blank_figure(NO_DATA)
    figure = new_figure(2.3, PRINT_WIDTH_IN)
    panels = figure.subplots(1, 3)
    before = table["novice_error_deg"].astype(float)
    after = table["improved_error_deg"].astype(float)
    for k in range(len(table)):
        panels[0].plot([0, 1], [before.iloc[k], after.iloc[k]], "o-", color=SERIES[0], markersize=3)
    panels[0].set_xticks([0, 1], ["novice", "improved"])
    panels[0].set_xlim(-0.4, 1.4)
    panels[0].set_ylim(bottom=0)
    panels[0].set_ylabel("error to the clean original, deg rms")
    for axes, column, label in (
        (panels[1], "jerk_ratio", "jerk after / before"),
        (panels[2], "loglik_gain_nat_per_frame", "gain under expert, nat/frame"),
    ):
        axes.bar(range(len(table)), table[column].astype(float), color=SERIES[1])
        axes.set_xticks(range(len(table)), [f"seed {s}" for s in table["seed"]], fontsize=SMALL_PT)
        axes.set_ylabel(label)
        axes.axhline(0, color="black", linewidth=0.5)
    panels[0].set_title("simulated novice", loc="left")
    return figure
