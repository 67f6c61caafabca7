"""Figures of motion adaptation: the paper's Fig. 1 as a triptych, and strips of all tasks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError
from motionstyle.figures.skeleton import BONES, named_points
from motionstyle.figures.style import GROUND, SIDE_COLOURS, SIDE_LINES, new_figure, styled
from motionstyle.motion.motion import Motion
from motionstyle.similarity.surface import Surface

Array = NDArray[np.float64]
MARGIN_M = 0.35


def surface_of(motion: Motion) -> Surface:
    """Return the ground an adapted motion was made for, from its provenance.

    Raises
    ------
    MotionStyleError
        If the motion names none.
    """
    known = motion.provenance.get("surface")
    if not known:
        raise MotionStyleError(f"motion {motion.id} names no surface; it is no adapted motion")
    return Surface(
        tuple(known["places_m"]),
        tuple(known["rises_m"]),
        tuple(known["origin_m"]),
        tuple(known["direction"]),
    )


def _draw(axes: Axes, motion: Motion, surface: Surface, frames: Sequence[int]) -> None:
    """Draw postures at these frames over the ground, seen from the side of the way."""
    points = named_points(motion.body, motion.coordinates)
    flat = {n: np.column_stack([surface.along(p), p[:, 1]]) for n, p in points.items()}
    shades = np.linspace(0.35, 1.0, len(frames))
    for shade, frame in zip(shades, frames, strict=True):
        for bone in BONES:
            line = np.array([flat[name][frame] for name in bone.points])
            axes.plot(
                line[:, 0],
                line[:, 1],
                color=SIDE_COLOURS[bone.side],
                linestyle=SIDE_LINES[bone.side],
                linewidth=0.9,
                alpha=float(shade),
            )
        head = flat["head_top"][frame] * 0.6 + flat["head"][frame] * 0.4
        axes.plot(*head, "o", ms=4.5, mfc="none", mec="#555555", alpha=float(shade))
    every = np.concatenate([path[list(frames)] for path in flat.values()])
    left, right = every[:, 0].min() - MARGIN_M, every[:, 0].max() + MARGIN_M
    u = np.linspace(left - 1, right + 1, 1200)  # axes that are shared may show more
    ground = surface.height_at(u)
    axes.fill_between(u, ground, min(ground.min(), 0.0) - 0.12, color="#DDDDDD", zorder=0)
    axes.plot(u, ground, color=GROUND, linewidth=0.8, zorder=0.5)
    axes.set_xlim(left, right)
    axes.set_aspect("equal")


def _verdict(row: Mapping[str, str]) -> str:
    def cell(name: str, form: str) -> str:
        return form.format(float(row[name])) if row.get(name) else "–"

    return (
        f"penetration {cell('penetration_cm', '{:.1f}')} cm, "
        f"leakage {cell('relative_leakage', '{:.2f}')}"
    )


@styled
def triptych_figure(
    example: Motion,
    full: Motion,
    ablated: Motion,
    rows: Mapping[str, Mapping[str, str]],
    task: str,
) -> Figure:
    """Return the example in the new environment, the adapted motion, and that without style.

    Parameters
    ----------
    example : at the rate and in the window of the adapted ones.
    rows : of adaptations.csv by variant.
    """
    surface = surface_of(full)
    frames = [round(f) for f in np.linspace(0, full.frames - 1, 7)]
    figure = new_figure(6.0)
    grid = figure.subplots(3, 1, sharex=True, sharey=True)
    titles = ("the example itself", "adapted, style kept", "adapted without S and P")
    variants = ("example", "full", "without_style")
    for axes, motion, title, variant in zip(
        grid, (example, full, ablated), titles, variants, strict=True
    ):
        _draw(axes, motion, surface, frames)
        axes.set_title(f"{task}: {title} ({_verdict(rows[variant])})", loc="left")
        axes.set_ylabel("height, m")
    grid[-1].set_xlabel("distance along the way, m")
    return figure


@styled
def adaptation_strips_figure(
    motions: Mapping[str, Motion], rows: Sequence[Mapping[str, str]]
) -> Figure:
    """Return one strip for each adapted motion, full variant, three in a row."""
    names = [r["task"] for r in rows if r["variant"] == "full"]
    columns = 3
    count = max(1, -(-len(names) // columns))
    figure = new_figure(1.35 * count + 0.3)
    grid = figure.subplots(count, columns, squeeze=False).ravel()
    status = {r["task"]: r for r in rows if r["variant"] == "full"}
    for axes, name in zip(grid, names, strict=False):
        row = status[name]
        solved = "solved" if row["solved"] == "yes" else "not solved"
        axes.set_title(f"{name}: {solved}", loc="left", fontsize=7)
        axes.tick_params(labelsize=5.5)
        if name not in motions:
            axes.text(0.5, 0.5, row["status"], ha="center", transform=axes.transAxes)
            axes.set_xticks([])
            continue
        motion = motions[name]
        frames = [round(f) for f in np.linspace(0, motion.frames - 1, 6)]
        _draw(axes, motion, surface_of(motion), frames)
    for axes in grid[len(names) :]:
        axes.set_visible(False)
    figure.supxlabel("distance along the way, m", fontsize=7)
    figure.supylabel("height, m", fontsize=7)
    return figure
