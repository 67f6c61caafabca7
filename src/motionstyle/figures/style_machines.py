"""Figures of what style machines do: explained variance, axes, analogies, driving, twins.

Each function draws one row or two of the checklist (style_machines.md §9) from tables and arrays.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from motionstyle.figures.style import (
    GROUND,
    PRINT_WIDTH_IN,
    SERIES,
    SMALL_PT,
    blank_figure,
    new_figure,
    series_style,
    styled,
)
from motionstyle.figures.style_machine_models import NO_DATA, Arrays

Array = NDArray[np.float64]


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
