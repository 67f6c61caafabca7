"""The body of Liu et al. 2005, Fig. 1 (F1), and how well it fits the source's markers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse
from numpy.typing import NDArray

from motionstyle.body.body import Body
from motionstyle.body.kinematics import contact_points, forward_kinematics, points_in_world
from motionstyle.body.layout import COORDINATES, JOINTS, NODES
from motionstyle.errors import MotionStyleError
from motionstyle.figures.skeleton import BONES, named_points
from motionstyle.figures.style import (
    GROUND,
    RIGHT,
    SERIES,
    SIDE_COLOURS,
    SMALL_PT,
    TRUNK,
    blank_figure,
    new_figure,
    styled,
)

Array = NDArray[np.float64]
GOALS_CM = {"virtual": 1.5, "measured": 2.5}  # of a clip's rms over all markers
GOAL_RMS_CM = 1.5
_SIGNS = "os^Dv<>P"  # one more than colours, so that the pairs repeat late
_CENTRAL = ("head", "thorax", "abdomen", "pelvis")
_RIGHT_NODES = tuple(n for n in NODES if n.endswith("_r"))


def _side(node: str) -> str:
    return node[-1] if node.endswith(("_r", "_l")) else ""


def _views(body: Body) -> tuple[dict[str, Array], Array, Array]:
    """Return points (3,), centres of mass (18, 3) and contact points (8, 3) of the zero pose."""
    zero = np.zeros((1, len(COORDINATES)))
    pose = forward_kinematics(body, zero)
    contacts = contact_points(body, pose)[0]
    lift = np.array([0.0, -contacts[:, 1].min(), 0.0])
    points = {name: path[0] + lift for name, path in named_points(body, zero).items()}
    coms = points_in_world(pose, np.arange(len(NODES)), body.coms)[0]
    return points, coms + lift, contacts + lift


def _silhouette(
    axes: Axes, body: Body, across: Array, centre: float, sides: tuple[str, ...]
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Draw ellipsoids, bones, centres of mass and foot points; return points and COMs on paper.

    across : the direction (3,) that points right on paper, ±x or ±z. centre : where the body's
    origin stands across the paper, m. sides : which of "r", "l" and "" (the trunk) to draw.
    """
    points, coms, contacts = _views(body)

    def flat(p: Array) -> Array:
        return np.array([centre + p @ across, p[..., 1]]).T

    flat_coms = {node: flat(com) for node, com in zip(NODES, coms, strict=True)}
    for (node, com), axis in zip(flat_coms.items(), body.semi_axes, strict=True):
        if _side(node) in sides:
            colour = SIDE_COLOURS[_side(node)]
            size = 2 * np.array([axis @ np.abs(across), axis[1]])
            axes.add_patch(
                Ellipse(com, *size, facecolor=colour, alpha=0.22, edgecolor=colour, linewidth=0.5)
            )
            axes.plot(*com, "+", color="black", markersize=4, markeredgewidth=0.7, zorder=5)
    for bone in (b for b in BONES if b.side in sides):
        line = np.array([flat(points[name]) for name in bone.points])
        axes.plot(*line.T, color=SIDE_COLOURS[bone.side], linewidth=1.0)
    axes.plot(*flat(contacts).T, "o", color="black", markersize=2.2)
    return {name: flat(p) for name, p in points.items()}, flat_coms


def _name_nodes(axes: Axes, nodes: tuple[str, ...], places: Array, at: float, left: bool) -> None:
    """Write node names in a column at x = `at`, each with a thin line to its place."""
    order = np.argsort([-p[1] for p in places])
    heights = np.array([places[i][1] for i in order])
    least = 0.085
    for k in range(1, len(heights)):  # keep the names apart
        heights[k] = min(heights[k], heights[k - 1] - least)
    for i, height in zip(order, heights, strict=True):
        axes.annotate(
            nodes[i],
            xy=places[i],
            xytext=(at, height),
            ha="right" if left else "left",
            va="center",
            fontsize=SMALL_PT,
            arrowprops={"arrowstyle": "-", "linewidth": 0.4, "color": GROUND},
        )


@styled
def body_figure(body: Body) -> Figure:
    """Return the body in its zero pose, front and side, beside a table of its nodes.

    Ellipsoids have the segments' masses and inertias; crosses are centres of mass, dots are
    the points that can touch the ground. Nodes of the left side mirror those of the right.
    """
    figure = new_figure(5.0)
    drawing, table = figure.subplots(1, 2, width_ratios=(1.65, 1.0))
    # the viewer of the front sees the right side on the left
    points, coms = _silhouette(drawing, body, np.array([0, 0, -1.0]), 0.0, ("l", "", "r"))
    half = max(abs(p[0]) for p in points.values())
    for nodes, at, left in ((_RIGHT_NODES, -half - 0.2, True), (_CENTRAL, half + 0.2, False)):
        _name_nodes(drawing, nodes, np.array([coms[n] for n in nodes]), at, left)
    centre = half + 0.85
    _silhouette(drawing, body, np.array([1.0, 0, 0]), centre, ("", "r"))
    top = points["head_top"][1] + 0.1
    drawing.text(0.0, top, "front", ha="center")
    drawing.text(centre, top, "right side", ha="center")
    drawing.plot([-half - 0.15, centre + 0.3], [0.0, 0.0], color=GROUND, linewidth=0.6, zorder=0)
    drawing.set_aspect("equal")
    drawing.set_xlim(-half - 0.7, centre + 0.3)
    drawing.set_ylim(-0.12, top + 0.1)
    drawing.set_ylabel("height, m")
    drawing.set_xticks([])
    drawing.spines["bottom"].set_visible(False)
    _node_table(table, body)
    handles = [
        Line2D([], [], color="black", marker="+", linestyle="", label="centre of mass"),
        Line2D([], [], color="black", marker="o", markersize=3, linestyle="", label="foot point"),
    ]
    figure.legend(handles=handles, loc="outside lower left", ncols=2)
    return figure


def _node_table(axes: Axes, body: Body) -> None:
    """Write the nodes with joint kind, DOF and mass; the last row holds the sums."""
    axes.set_axis_off()
    rows: list[tuple[str, str, str, str]] = [("node", "DOF", "mass, kg", "mass, %")]
    for joint, mass in zip(JOINTS, body.masses, strict=True):
        share = 100 * mass / body.mass
        rows.append((joint.node, str(len(joint.names)), f"{mass:.2f}", f"{share:.2f}"))
    shares = 100 * body.masses / body.mass
    rows.append(("sum", str(len(COORDINATES)), f"{body.mass:.2f}", f"{shares.sum():.2f}"))
    columns = (0.0, 0.56, 0.80, 1.04)
    step = 1.0 / len(rows)
    for k, row in enumerate(rows):
        weight = "bold" if k in {0, len(rows) - 1} else "normal"
        for x, text in zip(columns, row, strict=True):
            axes.text(
                x,
                1 - (k + 0.5) * step,
                text,
                ha="left" if x == 0 else "right",
                va="center",
                fontsize=SMALL_PT,
                fontweight=weight,
                transform=axes.transAxes,
            )
    for k in (1, len(rows) - 1):
        line = Line2D([0, 1.04], [1 - k * step] * 2, color=TRUNK, linewidth=0.6)
        line.set_transform(axes.transAxes)
        line.set_clip_on(False)
        axes.add_line(line)


@styled
def marker_figure(marker_rms: Mapping[str, Mapping[str, float]]) -> Figure:
    """Return how far each virtual marker stays from the fitted body, clip by clip.

    Parameters
    ----------
    marker_rms : clip id → marker name → rms distance over the clip, cm. The bar is the mean over
        the clips that have the marker, the signs are the clips.

    Raises
    ------
    MotionStyleError
        If no clip has a marker.
    """
    names = list(dict.fromkeys(name for clip in marker_rms.values() for name in clip))
    if not names:
        raise MotionStyleError("the figure of marker distances got no clip with markers")
    figure = new_figure(1.0 + 0.135 * len(names))
    axes = figure.subplots()
    rows = np.arange(len(names))
    means = [np.mean([clip[n] for clip in marker_rms.values() if n in clip]) for n in names]
    axes.barh(rows, means, height=0.7, color="#CCCCCC", label="mean of the clips")
    for k, (clip_id, clip) in enumerate(marker_rms.items()):
        known = [i for i, name in enumerate(names) if name in clip]
        axes.plot(
            [clip[names[i]] for i in known],
            known,
            linestyle="",
            marker=_SIGNS[k % len(_SIGNS)],
            color=SERIES[k % len(SERIES)],
            markersize=3,
            label=clip_id,
        )
    axes.axvline(GOAL_RMS_CM, color="black", linewidth=0.7, linestyle=(0, (4, 2)))
    axes.text(GOAL_RMS_CM, -1.2, " goal 1.5 cm, clip rms", fontsize=SMALL_PT, va="bottom")
    axes.set_yticks(rows, names)
    axes.set_ylim(len(names) - 0.4, -1.2)
    axes.set_xlim(left=0)
    axes.set_xlabel("rms distance of the virtual marker from the fitted body, cm")
    figure.legend(loc="outside lower center", ncols=min(4, len(marker_rms) + 1))
    return figure


@styled
def marker_fit_figure(pooled: Mapping[str, Mapping[str, Sequence[float]]]) -> Figure:
    """Return boxes of the distance from the fitted body over clips, a box per marker place.

    Boxes span the quartiles, whiskers the 5th to 95th percentile.

    Parameters
    ----------
    pooled : kind ("measured", "virtual") → place → rms distance per clip and side, cm; see
        `evaluation.marker_fit.pooled_distances`.
    """
    kinds = [
        (kind, dict(sorted(pooled[kind].items())))
        for kind in ("virtual", "measured")
        if pooled.get(kind)
    ]
    if not kinds:
        return blank_figure("no markers in this run")
    tallest = max(len(places) for _kind, places in kinds)
    figure = new_figure(1.2 + 0.155 * tallest)
    grid = figure.subplots(1, len(kinds), squeeze=False)[0]
    for axes, (kind, places) in zip(grid, kinds, strict=True):
        axes.boxplot(
            list(places.values()),
            orientation="horizontal",
            whis=(5, 95),
            widths=0.6,
            patch_artist=True,
            showfliers=False,
            boxprops={"facecolor": "#CCCCCC", "linewidth": 0.6},
            medianprops={"color": RIGHT, "linewidth": 1.4},
            whiskerprops={"linewidth": 0.6},
            capprops={"linewidth": 0.6},
        )
        names = [f"{place} ({len(found)})" for place, found in places.items()]
        axes.set_yticks(range(1, len(names) + 1), names)
        axes.set_ylim(len(names) + 0.7, 0.3)
        goal = GOALS_CM[kind]
        axes.axvline(goal, color="black", linewidth=0.7, linestyle=(0, (4, 2)))
        axes.set_xlim(left=0)
        axes.set_title(f"{kind} (clip goal {goal:g} cm)", loc="left")
        axes.set_xlabel("rms distance from the fitted body, cm")
    return figure
