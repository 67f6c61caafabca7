"""Figures of NIO: springs and shoe (F2, F3), the segment (F4), learning (F5), likelihood (E16)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from motionstyle.evaluation.nio.checks import shoe_curve, spring_curve, two_sided_joints
from motionstyle.figures.style import SERIES, blank_figure, new_figure, series_style, styled
from motionstyle.spacetime.style import JOINTS_29, Style

Curve = Mapping[str, Sequence[float]]
SHOWN_SPRINGS = 3


def joint_words(name: str) -> str:
    """Return a joint's name for readers: `knee_flexion_l` is "left knee flexion"."""
    stem, _, side = name.rpartition("_")
    if side not in ("l", "r"):
        return name.replace("_", " ")
    return f"{'left' if side == 'l' else 'right'} {stem.replace('_', ' ')}"


@styled
def spring_figure(style: Style, title: str) -> Figure:
    """Return the passive torque of the joints with the clearest kink, and the shoe's force."""
    figure = new_figure(2.6)
    left, right = figure.subplots(1, 2)
    for k, joint in enumerate(two_sided_joints(style)[:SHOWN_SPRINGS]):
        angles, torque = spring_curve(style, joint)
        rest = np.degrees(style.passive.rest_angle[joint])
        look = series_style(k)
        left.plot(np.degrees(angles), torque, lw=1.2, label=joint_words(JOINTS_29[joint]), **look)
        left.plot([rest], [0], "o", ms=3.5, color=look["color"])
    left.axhline(0, color="0.7", lw=0.5, zorder=0)
    left.set_xlabel("joint angle, deg (dots: rest angle)")
    left.set_ylabel("passive torque at rest, N m")
    if left.get_legend_handles_labels()[1]:
        left.legend(fontsize="x-small")
    heights, force = shoe_curve(style)
    right.plot(1000 * heights, force, color="black", lw=1.2)
    right.axvline(1000 * style.shoe_rest_length, color="0.6", lw=0.8, ls=":")
    right.annotate(
        r"rest length $\\bar h$".replace("\\\\", "\\"), (1000 * style.shoe_rest_length, 0.95),
        xycoords=("data", "axes fraction"), xytext=(3, 0), textcoords="offset points",
        fontsize="small", va="top",
    )  # fmt: skip
    right.axhline(0, color="0.7", lw=0.5, zorder=0)
    right.set_xlabel("height of the heel above ground, mm")
    right.set_ylabel("force of the shoe, N")
    figure.suptitle(title)
    return figure


@styled
def segment_figure(segments: Mapping[str, Curve], title: str) -> Figure:
    """Return E along the way from X_T to X_S before and after learning, each over E(X_T).

    segments : of `evaluation.spacetime.landscape.landscape`, by name: `before`, `after`.
    """
    figure = new_figure(2.8)
    axes = figure.subplots(1, len(segments), sharey=True, squeeze=False)[0]
    ordered = [(name, segments[name]) for name in ("before", "after") if name in segments]
    for axis, (name, found) in zip(axes, ordered, strict=True):
        s, total = np.asarray(found["s"]), np.asarray(found["total"])
        start, end = np.interp([0.0, 1.0], s, total)
        axis.plot(s, total / start, color="black", lw=1.4, label="all that is minimised")
        axis.plot(s, np.asarray(found["muscles"]) / start, lw=1.0, label="muscles alone",
                  **series_style(0))  # fmt: skip
        axis.plot([0, 1], [1, end / start], "o", ms=4, color=SERIES[1])
        for place, value, text in ((0, 1, "$X_T$"), (1, end / start, "$X_S$")):
            axis.annotate(text, (place, value), xytext=(4, -9), textcoords="offset points")
        axis.set_yscale("log")
        axis.margins(y=0.1)
        axis.set_title(f"{name} learning: drop {1 - end / start:.2f} of $E(X_T)$")
        axis.set_xlabel("s, share of the way from $X_T$ to $X_S$")
    axes[0].set_ylabel("over the value at $X_T$")
    axes[0].legend(fontsize="x-small")
    figure.suptitle(title)
    return figure


@styled
def learning_figure(rows: Sequence[Mapping[str, str]], shown: Sequence[str]) -> Figure:
    """Return G/E(X_T) over inner solves of both algorithms, and where converged solves end (F5).

    rows : of `tables/nio_learning.csv`, as text. shown : styles.
    """
    names = [n for n in shown if any(row["style"] == n for row in rows)]
    figure = new_figure(0.4 + 2.1 * ((len(names) + 2) // 3))
    if not names:
        figure.text(0.5, 0.5, "no style was learnt", ha="center")
        return figure
    grid = figure.subplots((len(names) + 2) // 3, min(3, len(names)), squeeze=False, sharey=True)
    for axis in grid.ravel()[len(names) :]:
        axis.set_visible(False)
    for axis, name in zip(grid.ravel(), names, strict=False):
        for k, algorithm in enumerate(("paper", "ours")):
            own = [r for r in rows if r["style"] == name and r["algorithm"] == algorithm]
            steps = [r for r in own if r["last"] == "no" and r["accepted"] == "yes" and r["G"]]
            if not steps:
                continue
            look = series_style(1 - k)
            x = [float(r["iteration"]) for r in steps]
            y = [float(r["G_over_E_target"]) for r in steps]
            label = {"paper": "paper's, truncated solves", "ours": "ours, with a pull to $X_T$"}
            axis.plot(x, y, lw=1.0, marker=".", ms=2.5, label=label[algorithm], **look)
            free = [(a, b) for a, b, r in zip(x, y, steps, strict=True)
                    if r["closeness"] == "0" and algorithm == "ours"]  # fmt: skip
            if free:
                axis.plot(*zip(*free, strict=True), "s", ms=3, color=look["color"],
                          label="ours, no pull")  # fmt: skip
            for last in (r for r in own if r["last"] == "yes"):
                axis.plot(
                    [float(last["iteration"]) + 2], [float(last["G_over_E_target"])], "*", ms=9,
                    color=look["color"], mec="black", mew=0.5,
                    label=f"{'paper’s' if algorithm == 'paper' else 'ours'}, converged",
                )  # fmt: skip
        axis.axhline(0.059, color="0.5", lw=0.8, ls=":")
        axis.set_yscale("log")
        axis.set_title(name)
        axis.set_xlabel("step of θ")
    for axis in grid[:, 0]:
        axis.set_ylabel("$G / E(X_T)$")
    grid[0, 0].annotate(
        "paper: 0.059", (0, 0.059), xycoords=("axes fraction", "data"), fontsize="x-small",
        xytext=(2, 2), textcoords="offset points", color="0.4",
    )  # fmt: skip
    handles: dict[str, object] = {}
    for axis in grid.ravel():
        handles |= dict(zip(*reversed(axis.get_legend_handles_labels()), strict=True))
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=5,
                  fontsize="x-small")  # fmt: skip
    return figure


@styled
def likelihood_figure(
    curves: Mapping[str, Curve], temperatures: Sequence[float], energies: Mapping[str, Curve]
) -> Figure:
    """Return one-dimensional energies, and L_τ over the temperature by (27) and by (28) (E16).

    energies : `x` and `E` of each bowl.
    """
    figure = new_figure(2.6)
    left, right = figure.subplots(1, 2)
    for k, (name, curve) in enumerate(curves.items()):
        look = series_style(k)
        left.plot(energies[name]["x"], energies[name]["E"], lw=1.0, label=name, **look)
        right.plot(temperatures, curve["by_27"], lw=1.2, label=f"{name}, (27)", **look)
        right.plot(temperatures, curve["by_28"], "o", ms=3, mfc="none", color=look["color"])
        right.axhline(curve["G"][0], color=look["color"], lw=0.6, ls=":")
    left.set_ylim(-0.2, 8)
    left.set_xlabel("X")
    left.set_ylabel("E(X)")
    left.legend(fontsize="x-small")
    right.set_xscale("log")
    right.set_ylim(0, None)
    right.set_xlabel("temperature τ")
    right.set_ylabel(r"$L_\tau$ (circles: (28); dotted: $G$)")
    return figure


@styled
def identifiability_figure(twins: Sequence[Mapping[str, Sequence[object]]]) -> Figure:
    """Return singular values of the optimum's derivative by scaled θ, one curve a twin.

    twins : records with `rows` and `singular_values`, degrees rms per unit of scaled θ.
    """
    shown = {}
    for one in twins:
        if one["singular_values"]:
            row = one["rows"][0]
            shown.setdefault(row["seed"], one["singular_values"])  # type: ignore[index]
    if not shown:
        return blank_figure("no twin was made, see the logs")
    figure = new_figure(2.6, 4.0)
    axes = figure.subplots()
    for k, (seed, values) in enumerate(shown.items()):
        axes.plot(
            np.arange(1, len(values) + 1), values, lw=1.0, label=f"twin {seed}", **series_style(k)
        )
    for level, text in ((1.0, "1° per unit"), (0.1, "0.1° per unit")):
        axes.axhline(level, color="0.6", lw=0.6, ls=":")
        axes.annotate(text, (0.02, level), xycoords=("axes fraction", "data"), ha="left",
                      va="bottom", fontsize="x-small", color="0.4")  # fmt: skip
    axes.set_yscale("log")
    axes.set_ylim(bottom=max(1e-6, min(float(min(v)) for v in shown.values())))
    axes.set_xlabel("number of the direction of scaled θ (of 147)")
    axes.set_ylabel("movement of joint angles, deg rms")
    axes.legend(fontsize="x-small")
    return figure
