"""A preview of footprints: from above, from the side where they climb, and in time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from motionstyle.body.body import Body
from motionstyle.figures.style import (
    BAND,
    GROUND,
    PRINT_WIDTH_IN,
    SIDE_COLOURS,
    SIDE_LINES,
    SMALL_PT,
    new_figure,
    styled,
)
from motionstyle.spacetime.footprint_constraints import PrintPose, print_poses
from motionstyle.spacetime.footprints import GROUPS, SIDES, Footprint, print_axes, sole_of
from motionstyle.spacetime.starts import root_way

Array = NDArray[np.float64]

LEVEL_M = 0.02  # footprints that climb less are shown from above only
_TRACKS = ("heel", "ball", "toe")
_SHAPE = ("heel", "ball_medial", "toe", "ball_lateral")


@styled
def footprint_figure(
    footprints: Sequence[Footprint],
    body: Body,
    frames: int,
    rate_hz: float,
    *,
    title: str = "footprints",
) -> Figure:
    """Return a figure of footprints: top view with the root's way, side view, and timing.

    Prints are numbered in order of time; the way is the spline that a synthesis starts from.
    """
    poses = print_poses(footprints, body, rate_hz)
    way = root_way(footprints, body, frames, rate_hz).places
    outlines = [_outline(pose, body) for pose in poses]
    every = np.concatenate([*outlines, way])
    climbs = float(np.ptp(every[:, 1])) > LEVEL_M
    along, across = _axes_of_way(way)
    flat = np.column_stack([every @ along, every @ across])
    extent = np.ptp(flat, axis=0) + 0.4
    scale = min((PRINT_WIDTH_IN - 0.9) / extent[0], 3.2 / max(extent[1], 0.8))
    heights = [max(extent[1], 0.8) * scale + 0.75]
    if climbs:
        heights.append((float(np.ptp(every[:, 1])) + 0.3) * scale + 0.65)
    heights.append(1.75)
    figure = new_figure(sum(heights) + 0.3)
    grid = figure.subplots(len(heights), 1, squeeze=False, height_ratios=heights)[:, 0]
    _draw(grid[0], poses, outlines, way, (along, across))
    grid[0].set_ylabel("to the left, m")
    grid[0].set_title(f"{title}: from above", loc="left")
    if climbs:
        up = np.array([0.0, 1.0, 0.0])
        _draw(grid[1], poses, outlines, way, (along, up))
        grid[1].set_ylabel("height, m")
        grid[1].set_title("from the right (grey: the surface under the root)", loc="left")
    grid[-2].set_xlabel("forward, m")
    _timing(grid[-1], footprints, frames / rate_hz)
    handles = [
        Line2D([], [], color=SIDE_COLOURS[foot], ls=SIDE_LINES[foot], label=f"{SIDES[foot]} foot")
        for foot in "rl"
    ]
    handles.append(Line2D([], [], color=GROUND, lw=0.8, label="way of the root"))
    if any(one.slide for one in footprints):
        handles.append(Line2D([], [], color="0.4", lw=5, alpha=0.35, label="may slide"))
    figure.legend(handles=handles, loc="outside lower center", ncols=4, handlelength=2.4)
    return figure


def _axes_of_way(way: Array) -> tuple[Array, Array]:
    """Return horizontal unit vectors: the way's direction at first, and to its left."""
    step = (way[min(5, len(way) - 1)] - way[0]) * [1, 0, 1]
    size = float(np.linalg.norm(step))
    along = step / size if size > 1e-6 else np.array([1.0, 0.0, 0.0])
    return along, np.cross([0.0, 1.0, 0.0], along)


def _outline(pose: PrintPose, body: Body) -> Array:
    """Return the corners of a print, (4, 3), m."""
    forward, right = print_axes(pose.yaw, pose.normal)
    sole = sole_of(body, pose.foot)
    return np.array(
        [pose.heel + sole.points[n][0] * forward + sole.points[n][1] * right for n in _SHAPE]
    )


def _draw(
    axes: Axes,
    poses: Sequence[PrintPose],
    outlines: Sequence[Array],
    way: Array,
    plane: tuple[Array, Array],
) -> None:
    """Draw prints and the root's way in the plane of two directions, true to scale."""
    x, y = plane
    axes.plot(way @ x, way @ y, color=GROUND, linewidth=0.8)
    for number, (pose, outline) in enumerate(zip(poses, outlines, strict=True), start=1):
        corners = np.column_stack([outline @ x, outline @ y])
        slides = any(row.slide for row in pose.rows)
        axes.add_patch(
            Polygon(
                corners,
                closed=True,
                facecolor=SIDE_COLOURS[pose.foot],
                alpha=0.15 if slides else 0.35,
                edgecolor="none",
            )
        )
        axes.add_patch(
            Polygon(
                corners,
                closed=True,
                fill=False,
                edgecolor=SIDE_COLOURS[pose.foot],
                linestyle=SIDE_LINES[pose.foot],
                linewidth=1.0 if abs(y[1]) < 0.5 else 2.0,
            )
        )
        middle = corners.mean(axis=0)
        seen_from_above = abs(y[1]) < 0.5
        axes.annotate(
            str(number),
            middle if seen_from_above else (middle[0], corners[:, 1].max()),
            xytext=(0, 0) if seen_from_above else (0, 3),
            textcoords="offset points",
            ha="center",
            va="center" if seen_from_above else "bottom",
            fontsize=SMALL_PT,
        )
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.06)


def _timing(axes: Axes, footprints: Sequence[Footprint], end: float) -> None:
    """Draw when each point of each foot is held, as bars."""
    tracks = [(foot, point) for foot in "rl" for point in _TRACKS]
    for one in footprints:
        members = {name.split("_")[0] for name in GROUPS[one.point]}
        for level, (foot, point) in enumerate(tracks):
            if foot == one.foot and point in members:
                axes.barh(
                    -level,
                    one.t_off - one.t_on,
                    left=one.t_on,
                    height=0.62,
                    color=SIDE_COLOURS[foot],
                    alpha=0.35 if one.slide else 0.9,
                    edgecolor="white",
                    linewidth=0.5,
                )
    axes.axhline(-2.5, color=BAND, linewidth=0.6)
    axes.set_yticks([-k for k in range(len(tracks))])
    axes.set_yticklabels([f"{SIDES[foot]} {point}" for foot, point in tracks])
    axes.set_xlim(0, end)
    axes.set_ylim(-len(tracks) + 0.5, 0.5)
    axes.set_xlabel("time, s")
    axes.set_title("held", loc="left")
