"""Stick figures over time with contacts and streamers (after Brand & Hertzmann's figures)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from motionstyle.body.layout import CONTACT_POINTS
from motionstyle.errors import MotionStyleError
from motionstyle.figures.skeleton import BONES, STREAMER_POINTS, View, named_points, project
from motionstyle.figures.style import (
    GROUND,
    PRINT_WIDTH_IN,
    SIDE_COLOURS,
    SIDE_LINES,
    SMALL_PT,
    motion_title,
    new_figure,
    styled,
)
from motionstyle.figures.treads import tread_lines
from motionstyle.motion.motion import Motion

Array = NDArray[np.float64]
# Between stick figures on paper, as a share of one figure's usual width from foot to foot and
# hand to hand, and at least this much (m); not a whole step, or all would show the same phase.
SPACING_SHARE, SPACING_M = 0.55, 0.45
IN_TIME_SPACING_M = 0.6
LONGEST_M = 6.6  # of travel drawn; what comes later is left out and the title says so
HARDLY_TRAVELS_M = 1.5  # below this, or slower, the figures are pushed apart with time
SLOW_M_PER_S = 0.5
FORCE_SCALE_M = 0.5  # length of an arrow of one body weight
GRAVITY = 9.81
LABEL_M = 0.35  # figures that stand closer have their times on two lines
MARGIN_IN = 0.7  # beside a strip, for its labels
SHORT_TITLE = 46  # letters of a line above half a page
SHORT_M = 4.2  # strips that are no wider may share a row


@dataclass(frozen=True)
class Strip:
    """What a strip draws: frames of the stick figures, and the extra shift in m per frame."""

    frames: tuple[int, ...]
    last_frame: int
    shift: Array
    offset_in_time: bool


def plan_strip(motion: Motion, across: Array, width: float, count: int | None) -> Strip:
    """Choose the frames to draw, given the pelvis' place across the paper (F,), m.

    width : usual extent of one figure across the paper, m. count : number of figures; None for
    as many as can be told apart, 2 to 16.
    """
    forward = across - across[0]
    travelled = float(np.ptp(forward))
    crowded = count is not None and travelled < (count - 1) * SPACING_M / 2
    slow = travelled < SLOW_M_PER_S * motion.times[-1]
    in_time = crowded or slow or travelled < HARDLY_TRAVELS_M
    beyond = np.flatnonzero(np.abs(forward) > LONGEST_M)
    last = int(beyond[0]) - 1 if len(beyond) and not in_time else motion.frames - 1
    if count is None:
        room = LONGEST_M - float(np.ptp(forward)) if in_time else float(np.ptp(forward[: last + 1]))
        spacing = IN_TIME_SPACING_M if in_time else max(SPACING_M, SPACING_SHARE * width)
        count = int(np.clip(room / spacing, 1, 15)) + 1
    if count < 1 or last < 1:
        raise MotionStyleError(
            f"motion {motion.id}: cannot draw {count} stick figures of {last + 1} frames"
        )
    frames = np.unique(np.round(np.linspace(0, last, count)).astype(int))
    shift = np.zeros(motion.frames)
    if in_time:
        per_figure = (LONGEST_M - float(np.ptp(forward))) / max(1, count - 1)
        shift = np.arange(motion.frames) * min(per_figure, 0.8) * max(1, count - 1) / last
    return Strip(tuple(int(f) for f in frames), last, shift, in_time)


@styled
def stick_strip(
    axes: Axes,
    motion: Motion,
    n: int | None = None,
    *,
    view: View = "side",
    title: str | None = None,
    paths: bool = True,
    forces: bool = False,
) -> Strip:
    """Draw stick figures over time with the floor, contacts (dots) and streamers.

    Parameters
    ----------
    n : number of stick figures; None lets the length of the way decide.
    view : see `skeleton.project`; the thin grey line is the level floor y = 0, or, in the oblique
        view, the pelvis' path on it; short ones are treads and ramps under feet that touch them.
    title : by default the motion's id; planted motions are marked. paths : draw the streamers.
    forces : draw each foot's contact force, where known, from its centre of pressure.

    Figures stand where the motion was, or, if it travels less than 1.5 m or slower than 0.5 m/s,
    are pushed to the right in proportion to time. The time of each stands below it.
    """
    points = named_points(motion.body, motion.coordinates)
    points["ground"] = points["pelvis"] * [1, 0, 1]
    arrows = _force_arrows(motion, points) if forces else {}
    treads = tread_lines(motion, points)
    points |= arrows | treads
    flat = project(motion, points, view)
    beside = {*arrows, *treads}
    places = np.stack([path[:, 0] for name, path in flat.items() if name not in beside])
    width = float(np.median(np.ptp(places, axis=0)))
    strip = plan_strip(motion, flat["pelvis"][:, 0], width, n)
    flat = {name: path + np.outer(strip.shift, [1.0, 0.0]) for name, path in flat.items()}
    shown = slice(0, strip.last_frame + 1)
    for name in STREAMER_POINTS if paths else ():
        axes.plot(*flat[name][shown].T, color=SIDE_COLOURS[name[-1]], linewidth=0.5, alpha=0.55)
    for bone in BONES:
        lines = [np.array([flat[name][f] for name in bone.points]) for f in strip.frames]
        axes.add_collection(
            LineCollection(
                lines,
                colors=SIDE_COLOURS[bone.side],
                linestyles=[SIDE_LINES[bone.side]],
                linewidths=1.1,
                capstyle="butt",
                label=f"bones {bone.side or 'trunk'}",
            )
        )
    size = float(np.linalg.norm(motion.body.geometry.end_points[0]))
    heads = [_head(flat["head"][f], flat["head_top"][f], size) for f in strip.frames]
    axes.add_collection(LineCollection(heads, colors=SIDE_COLOURS[""], linewidths=1.1))
    for f in strip.frames:
        touching = [n for n, on in zip(CONTACT_POINTS, motion.contacts[f], strict=True) if on]
        for side in "lr":
            spots = [flat[name][f] for name in touching if name.endswith(f"_{side}")]
            if spots:
                axes.plot(*np.array(spots).T, "o", color=SIDE_COLOURS[side], markersize=2.6)
    for side in "lr" if arrows else "":
        for f in strip.frames:
            foot, tip = flat[f"pressure_{side}"][f], flat[f"force_{side}"][f]
            if np.linalg.norm(tip - foot) > 0.02:
                look = {"arrowstyle": "-|>", "color": SIDE_COLOURS[side], "lw": 0.8}
                look |= {"mutation_scale": 5, "shrinkA": 0, "shrinkB": 0}
                axes.annotate("", tip, foot, arrowprops=look, zorder=3)
    for side in "lr":
        for f in strip.frames:
            ends = np.array([flat[f"tread_{side}{end}"][f] for end in (0, 1)])
            axes.plot(*ends.T, color=GROUND, linewidth=1.2, zorder=0)
    flat = {name: path for name, path in flat.items() if name not in beside}
    _label(axes, motion, strip, flat, view=view, title=title)
    return strip


def _force_arrows(motion: Motion, points: dict[str, Array]) -> dict[str, Array]:
    """Return paths (F, 3) of each foot's centre of pressure and of the tip of its force's arrow."""
    if motion.contact_forces is None:
        return {}
    arrows = {}
    places = np.stack([points[name] for name in CONTACT_POINTS], axis=1)
    per_newton = FORCE_SCALE_M / (motion.body.mass * GRAVITY)
    for side in "rl":
        own = [k for k, name in enumerate(CONTACT_POINTS) if name.endswith(f"_{side}")]
        pushes = motion.contact_forces[:, own]
        weights = np.maximum((pushes * motion.contact_normals[:, own]).sum(axis=-1), 0) + 1e-9
        middle = (weights[..., None] * places[:, own]).sum(axis=1) / weights.sum(axis=1)[:, None]
        arrows[f"pressure_{side}"] = middle
        arrows[f"force_{side}"] = middle + per_newton * pushes.sum(axis=1)
    return arrows


def _head(neck: Array, top: Array, length: float) -> Array:
    """Return a circle (25, 2) around the upper part of a head of some length (m)."""
    angle = np.linspace(0, 2 * np.pi, 25)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    return neck + 0.62 * (top - neck) + 0.38 * length * circle


def _label(
    axes: Axes,
    motion: Motion,
    strip: Strip,
    flat: dict[str, Array],
    *,
    view: View,
    title: str | None,
) -> None:
    """Write times, axis labels and title, and set the limits so that all of it is inside."""
    drawn = np.concatenate([path[: strip.last_frame + 1] for path in flat.values()])
    (left, low), (right, high) = drawn.min(axis=0), drawn.max(axis=0)
    low = min(low, 0.0)
    if view == "oblique":
        axes.plot(*flat["ground"][: strip.last_frame + 1].T, color=GROUND, linewidth=0.6, zorder=0)
    else:
        axes.plot([left - 0.15, right + 0.15], [0.0, 0.0], color=GROUND, linewidth=0.6, zorder=0)
    before = -np.inf
    for f in sorted(strip.frames, key=lambda f: flat["pelvis"][f, 0]):
        place = flat["pelvis"][f, 0]
        lower = place - before < LABEL_M
        before = -np.inf if lower else place
        axes.text(
            place,
            low - (0.17 if lower else 0.05),
            f"{f / motion.rate_hz:.2f}",
            ha="center",
            va="top",
            fontsize=SMALL_PT,
        )
    axes.set_xlim(left - 0.15, right + 0.15)
    axes.set_xticks(np.arange(np.ceil(left), right + 0.15))
    axes.spines["bottom"].set_bounds(left - 0.15, right + 0.15)
    axes.set_ylim(low - 0.28, high + 0.08)
    axes.set_aspect("equal")
    axes.set_yticks([0.0, 0.5, 1.0, 1.5] if view != "oblique" else [])
    axes.set_ylabel("height, m" if view != "oblique" else "")
    if strip.offset_in_time:
        pace = strip.shift[-1] * motion.rate_hz / (motion.frames - 1)
        axes.set_xticks([])
        text = f"forward position, moved right by {pace:.1f} m per second"
    else:
        seen = ", seen obliquely" if view == "oblique" else ""
        text = f"distance along the direction of travel{seen}, m"
    axes.set_xlabel(f"{text} (below each figure: time, s)", loc="left")
    text = motion_title(motion, title)
    if strip.last_frame < motion.frames - 1:
        text += f": first {strip.last_frame / motion.rate_hz:.1f} s of {motion.times[-1]:.1f} s"
    axes.set_title(text, loc="left")


def _rows(widths: Sequence[float], half: float) -> list[list[int]]:
    """Return which strips share a row: two of those at most half a page wide."""
    rows: list[list[int]] = []
    waiting: list[int] | None = None
    for k, width in enumerate(widths):
        if width <= half and waiting is not None:
            waiting.append(k)
            waiting = None
            continue
        rows.append([k])
        if width <= half:
            waiting = rows[-1]
    return rows


def fit_strips(
    motions: Sequence[Motion],
    titles: Sequence[str] | None,
    draw: Callable[[Axes, Motion, str], object],
    *,
    paired: bool = False,
) -> Figure:
    """Return a figure with one strip per motion, drawn by `draw`, all on the same scale.

    paired : two of the shorter strips share a row, so that many motions fit a page.

    Raises
    ------
    MotionStyleError
        If there is no motion, or not one title for each.
    """
    names = [m.id for m in motions] if titles is None else list(titles)
    if not motions or len(names) != len(motions):
        raise MotionStyleError(f"a strip figure of {len(motions)} motions got {len(names)} titles")
    figure = new_figure(1.0)
    grid = figure.subplots(len(motions), 1, squeeze=False)[:, 0]
    for axes, motion, name in zip(grid, motions, names, strict=True):
        draw(axes, motion, name)
    extents = [(np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim())) for axes in grid]
    widest = max(width for width, _height in extents)
    scale = (PRINT_WIDTH_IN - MARGIN_IN) / widest  # inches of paper per metre
    short = [width for width, _height in extents if width <= SHORT_M] if paired else []
    half = max(short, default=0.0)
    if len(short) > 1:
        scale = min(scale, (PRINT_WIDTH_IN / 2 - MARGIN_IN) / half)
    widest = (PRINT_WIDTH_IN - MARGIN_IN) / scale
    rows = _rows([width for width, _height in extents], half)
    heights = [max(extents[k][1] for k in row) * scale + 0.65 for row in rows]
    figure.set_size_inches(PRINT_WIDTH_IN, sum(heights) + 0.35)
    places = figure.add_gridspec(len(rows), 2, height_ratios=heights)
    for at, row in enumerate(rows):
        for column, k in enumerate(row):
            alone = extents[k][0] > half
            grid[k].set_subplotspec(places[at, :] if alone else places[at, column])
            left, right = grid[k].get_xlim()
            room = widest if alone else half
            grid[k].set_xlim(left, right + room - extents[k][0])
            if not alone:
                grid[k].set_xlabel("distance, m (below each figure: time, s)", loc="left")
                title = grid[k].get_title(loc="left")
                grid[k].set_title(fill(title, SHORT_TITLE), loc="left")
    return figure


@styled
def strip_figure(
    motions: Sequence[Motion],
    titles: Sequence[str] | None = None,
    *,
    view: View = "side",
    n: int | None = None,
    forces: bool = False,
    paired: bool = False,
) -> Figure:
    """Return a figure with one strip per motion, one above the other on the same scale.

    forces : draw contact forces, where known; an arrow of half a metre is one body weight.
    paired : two of the shorter strips share a row.

    Raises
    ------
    MotionStyleError
        If there is no motion, or not one title for each.
    """
    figure = fit_strips(
        motions,
        titles,
        lambda axes, motion, name: stick_strip(
            axes, motion, n, view=view, title=name, forces=forces
        ),
        paired=paired,
    )
    handles = [
        Line2D([], [], color=SIDE_COLOURS[side], linestyle=SIDE_LINES[side], label=label)
        for side, label in (("r", "right"), ("l", "left"), ("", "trunk and head"))
    ]
    handles.append(
        Line2D([], [], color=GROUND, marker="o", linestyle="", markersize=3, label="contact point")
    )
    handles.append(
        Line2D([], [], color=GROUND, linewidth=0.5, label="path of hand or ball of the foot")
    )
    if forces:
        text = f"arrow: contact force, {FORCE_SCALE_M:g} m for one body weight"
        handles.append(Line2D([], [], color=GROUND, marker="^", linestyle="", ms=4, label=text))
    columns = 3 if forces else 5
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, handlelength=2.4)
    return figure
