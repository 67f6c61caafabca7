"""Figures of the similarity models: features, subspaces, leakage, ROC, dose and response."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError
from motionstyle.figures.skeleton import BONES, named_points
from motionstyle.figures.style import (
    GROUND,
    LEFT,
    RIGHT,
    SERIES,
    SIDE_COLOURS,
    SIDE_LINES,
    TRUNK,
    motion_title,
    new_figure,
    series_style,
    styled,
)
from motionstyle.motion.motion import Motion
from motionstyle.similarity.alignment import SETS, Segment, all_segments
from motionstyle.similarity.events import EventRules, clip_events
from motionstyle.similarity.features import (
    PARTS,
    POSTURES,
    part_centres,
    posture_frames,
    whole_body_vector,
)

Array = NDArray[np.float64]
Table = Sequence[Mapping[str, str]]
TITLES = {"whole_body": "whole body", "left_leg": "left leg", "right_leg": "right leg"}
PAPER = "#000000"
_COLOURS = {"upper_body": TRUNK, "left_leg": LEFT, "right_leg": RIGHT}
_MARKS = {"upper_body": "s", "left_leg": "o", "right_leg": "D"}
_METHODS = {
    "one_class_svm": "one-class SVM",
    "leakage": "leakage",
    "euclidean": "Euclid",
    "dtw": "DTW",
    "mahalanobis": "Mahalanobis",
}


def _stick(axes: Axes, points: Mapping[str, Array], frame: int, flat: Array, shift: float) -> None:
    """Draw one posture; `flat` (2, 3) brings points onto paper."""
    for bone in BONES:
        line = np.array([points[name][frame] for name in bone.points]) @ flat.T
        axes.plot(
            line[:, 0] + shift,
            line[:, 1],
            color=SIDE_COLOURS[bone.side],
            linestyle=SIDE_LINES[bone.side],
            linewidth=0.8,
        )


@styled
def features_figure(motion: Motion, rules: EventRules) -> Figure:
    """Return the paper's Fig. 2: K postures facing left, with the three centres of mass.

    Raises
    ------
    MotionStyleError
        If the motion has no whole-body segment.
    """
    segments = [s for s in all_segments(clip_events(motion, rules)) if s.set == "whole_body"]
    if not segments:
        raise MotionStyleError(f"motion {motion.id} has no whole-body segment to draw")
    segment: Segment = segments[len(segments) // 2]
    frames = posture_frames(segment.first, segment.last)
    vectors = whole_body_vector(motion, segment).reshape(POSTURES, 3, 3)
    parts, centre, forward = part_centres(motion, np.append(frames, (frames[0] + frames[-1]) // 2))
    heading = forward[-1] * [1, 0, 1]
    heading /= np.linalg.norm(heading)
    flat = np.array([-heading, [0.0, 1.0, 0.0]])
    points = named_points(motion.body, motion.coordinates)
    figure = new_figure(3.0)
    left, right = figure.subplots(1, 2, width_ratios=[1.7, 1])
    gap = 0.75
    for k, frame in enumerate(frames):
        origin = centre[0] * [1, 0, 1]
        own = {name: path - origin for name, path in points.items()}
        _stick(left, own, int(frame), flat, k * gap)
        place = (parts[k] - origin) @ flat.T
        for number, part in enumerate(PARTS):
            left.plot(
                place[number, 0] + k * gap,
                place[number, 1],
                _MARKS[part],
                ms=5,
                mfc=_COLOURS[part],
                mec="black",
                mew=0.5,
                zorder=5,
            )
    left.axhline(0, color=GROUND, linewidth=0.8)
    left.set_aspect("equal")
    left.set_xticks([])
    left.set_ylabel("height, m")
    left.set_xlabel(f"{POSTURES} postures, equally spaced in time, moved apart to the right")
    left.set_title(f"{motion_title(motion)}: one segment, turned to face left", loc="left")
    for number, part in enumerate(PARTS):
        right.plot(
            vectors[:, number, 0],
            vectors[:, number, 1],
            "-",
            color=_COLOURS[part],
            linewidth=0.8,
            marker=_MARKS[part],
            ms=5,
            mec="black",
            mew=0.5,
            label=part.replace("_", " "),
        )
    right.axvline(0, color=GROUND, linewidth=0.5)
    right.axhline(0, color=GROUND, linewidth=0.8)
    right.set_xlabel("forward is to the left; leg lengths")
    right.set_ylabel("height, leg lengths")
    right.set_title(f"18 K = {18 * POSTURES} numbers a pair", loc="left")
    figure.legend(loc="outside lower center", ncols=3, title="centre of mass of")
    return figure


@styled
def subspaces_figure(rows: Table) -> Figure:
    """Return the cumulative variance of both legs' components, with the paper's point (T1)."""
    figure = new_figure(2.6, 4.6)
    axes = figure.subplots()
    for k, leg in enumerate(SETS[1:]):
        own = [r for r in rows if r["leg"] == leg]
        if not own:
            continue
        count = [int(r["components"]) for r in own]
        share = [float(r["cumulative_variance_pct"]) for r in own]
        label = f"{TITLES[leg]}: {own[0]['segments']} segments of {own[0]['clips']} clips"
        axes.plot(count, 100.0001 - np.array(share), marker=".", **series_style(k), label=label)
    axes.plot(60, 0.1, "*", color=PAPER, ms=9, label="paper: 60 of 175, about 99.9 %")
    axes.set_yscale("log")
    axes.set_ylim(100, 1e-3)
    axes.set_yticks([100, 10, 1, 0.1, 0.01, 0.001], ["0", "90", "99", "99.9", "99.99", "99.999"])
    axes.set_xlabel("principal components of a leg segment (175 angles)")
    axes.set_ylabel("variance held, %")
    axes.legend(loc="lower right")
    axes.set_title(f"Leg subspaces ({rows[0]['data']} motions)" if rows else "", loc="left")
    return figure


@styled
def leakage_figure(rows: Table, held_out: Mapping[str, Array]) -> Figure:
    """Return the paper's Fig. 3 for all three sets, and leakage against kernel width."""
    figure = new_figure(4.6)
    grid = figure.subplots(2, 3, sharey="row")
    bins = np.linspace(0, 1, 26)
    data = rows[0]["data"] if rows else ""
    for column, name in enumerate(SETS):
        axes = grid[0, column]
        for k, way in enumerate(("pattern", "pair", "subject")):
            values = held_out.get(f"{name}.paper.{way}")
            if values is None:
                continue
            label = f"folds by {way}: mean {values.mean():.2f}, {np.mean(values < 0.2):.0%} < 0.2"
            axes.hist(
                values,
                bins,
                weights=np.full(len(values), 100 / len(values)),
                histtype="stepfilled" if way == "pattern" else "step",
                alpha=0.5 if way == "pattern" else 1,
                label=label,
                color=SERIES[k],
                linestyle=["-", "-", ":"][k],
            )
        axes.axvline(0.1, color=PAPER, linewidth=0.7, linestyle=":")
        axes.axvline(0.2, color=PAPER, linewidth=0.7, linestyle="--")
        axes.set_title(TITLES[name], loc="left")
        axes.set_xlabel("relative leakage of held-out patterns")
        legend = axes.legend(loc="upper right", fontsize=5.5, handlelength=1.2, frameon=True)
        legend.get_frame().set(alpha=1.0, linewidth=0)
        axes.set_xlim(0, 1)
        _width_curve(grid[1, column], rows, name)
    grid[0, 0].set_ylabel("patterns, %")
    grid[1, 0].set_ylabel("mean relative leakage")
    handles = [
        Line2D([], [], color=PAPER, linestyle=":", label="paper's mean, about 0.1"),
        Line2D([], [], color=PAPER, linestyle="--", label="paper: about 90 % below 0.2"),
        Line2D([], [], color=SERIES[0], marker=".", label="similar, held out"),
        Line2D([], [], color=SERIES[1], marker=".", linestyle="--", label="not similar"),
        Line2D([], [], color=SERIES[2], marker="v", linestyle="", label="width chosen blindly"),
    ]
    note = "" if data == "captured" else " (planted motions: drawn, not claimed)"
    figure.suptitle(f"Relative leakage of held-out patterns{note}", x=0.01, ha="left")
    figure.legend(handles=handles, loc="outside lower center", ncols=5, columnspacing=1.3)
    return figure


def _width_curve(axes: Axes, rows: Table, name: str) -> None:
    """Draw mean leakage against kernel width, with the chosen width and the paper's level."""
    own = [r for r in rows if r["set"] == name and r["size"] == "paper"]
    own = [r for r in own if r["folds"] == "pattern" and r["status"] == "ok"]
    fixed = [r for r in own if r["width"] != "chosen"]
    width = [float(r["width"]) for r in fixed]
    axes.plot(
        width, [float(r["mean_relative_leakage"]) for r in fixed], marker=".", color=SERIES[0]
    )
    other = [float(r["mismatched_mean_relative_leakage"] or "nan") for r in fixed]
    axes.plot(width, other, marker=".", linestyle="--", color=SERIES[1])
    axes.axhline(0.1, color=PAPER, linewidth=0.7, linestyle=":")
    for row in own:
        if row["width"] == "chosen":
            axes.plot(
                float(row["relative_width"]),
                float(row["mean_relative_leakage"]),
                "v",
                color=SERIES[2],
                ms=6,
                zorder=5,
            )
    axes.set_xscale("log")
    axes.set_ylim(0, 1)
    axes.set_xlabel("kernel width Γ · median ‖p − p′‖²")


@styled
def discrimination_figure(rows: Table) -> Figure:
    """Return areas under the ROC curve at three levels, with 95 % intervals (T8)."""
    figure = new_figure(2.9)
    levels = ("type", "style", "subject")
    grid = figure.subplots(1, 3, sharey=True)
    for axes, level in zip(grid, levels, strict=True):
        for k, (method, label) in enumerate(_METHODS.items()):
            for n, name in enumerate(SETS):
                own = [
                    r
                    for r in rows
                    if (r["level"], r["set"], r["method"], r["status"])
                    == (level, name, method, "ok")
                ]
                if not own:
                    continue
                value, low, high = (float(own[0][c]) for c in ("auc", "ci_low", "ci_high"))
                x = n + (k - 2) * 0.15
                axes.plot([x, x], [low, high], color=SERIES[k], linewidth=1.2)
                axes.plot(x, value, "o", color=SERIES[k], ms=4, label=label if n == 0 else None)
        axes.axhline(0.5, color=GROUND, linewidth=0.6, linestyle=":")
        axes.set_xticks(range(3), [TITLES[name] for name in SETS])
        axes.set_ylim(0.4, 1.02)
        if not axes.lines[:-1]:
            reason = next((r["reason"] for r in rows if r["level"] == level), "")
            words = reason.replace(" of any", "\nof any")
            axes.text(0.5, 0.5, words, ha="center", transform=axes.transAxes, fontsize=6)
    grid[0].set_title("two types of movement", loc="left")
    grid[1].set_title("two styles of one type", loc="left")
    grid[2].set_title("two subjects, one style", loc="left")
    grid[0].set_ylabel("area under ROC curve")
    handles, labels = grid[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5)
    return figure


@styled
def dose_figure(points: Table) -> Figure:
    """Return leakage and SVM score of pairs against the planted change."""
    series = sorted({p["series"] for p in points})
    figure = new_figure(3.6)
    if not series:
        figure.text(0.5, 0.5, "no planted doses in this run", ha="center")
        return figure
    grid = figure.subplots(2, len(series), squeeze=False, sharey="row")
    for column, name in enumerate(series):
        for row, score in enumerate(("relative_leakage", "svm_score")):
            axes = grid[row, column]
            for k, set_name in enumerate(SETS):
                own = [p for p in points if p["series"] == name and p["set"] == set_name]
                dose = np.array([float(p["dose"]) for p in own])
                value = np.array([float(p[score]) for p in own])
                axes.plot(dose, value, ".", color=SERIES[k], ms=4)
                levels = np.unique(dose)
                means = [value[dose == d].mean() for d in levels]
                axes.plot(levels, means, **series_style(k), linewidth=1, label=TITLES[set_name])
        grid[0, column].set_title(name, loc="left")
        unit = "deg" if "posture" in name else "share"
        grid[1, column].set_xlabel(f"planted change, {unit}")
    grid[0, 0].set_ylabel("relative leakage")
    grid[1, 0].set_ylabel("SVM score")
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure
