"""Stick figures with the force of the ground on each foot as an arrow."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from motionstyle.dynamics.inverse import GRAVITY
from motionstyle.figures.skeleton import project
from motionstyle.figures.strips import Strip, fit_strips, stick_strip
from motionstyle.figures.style import LEFT, RIGHT, SIDE_COLOURS, SIDE_LINES, styled
from motionstyle.motion.motion import Motion
from motionstyle.motion.opensim_export import ground_reactions

METRES_PER_WEIGHT = 0.5  # length on paper of an arrow of one body weight
LEAST_BW = 0.02  # arrows below this are not drawn
FIGURES = 9
SCALE_WIDTH_M = 0.55  # of paper left of the first figure, for the scale of the arrows


def draw_forces(axes: Axes, motion: Motion, strip: Strip) -> None:
    """Draw each foot's ground reaction at its centre of pressure over a strip seen from the side.

    Raises
    ------
    MotionStyleError
        If the motion has no contact forces.
    """
    columns = ground_reactions(motion)
    weight = motion.body.mass * GRAVITY
    for side, colour in (("r", RIGHT), ("l", LEFT)):
        force, centre = (
            np.stack([columns[f"ground_force_{side}_{kind}{a}"] for a in "xyz"], axis=1)
            for kind in "vp"
        )
        ends = {"foot": centre, "tip": centre + METRES_PER_WEIGHT * force / weight}
        flat = project(motion, ends, "side")
        for frame in strip.frames:
            if np.linalg.norm(force[frame]) < LEAST_BW * weight:
                continue
            foot, tip = (flat[name][frame] + [strip.shift[frame], 0.0] for name in ("foot", "tip"))
            axes.annotate(
                "",
                xy=tip,
                xytext=foot,
                arrowprops={
                    "arrowstyle": "-|>,head_width=0.18,head_length=0.35",
                    "color": colour,
                    "linewidth": 1.8,
                    "shrinkA": 0,
                    "shrinkB": 0,
                },
                zorder=5,
            )


@styled
def force_strip_figure(motions: Sequence[Motion], titles: Sequence[str] | None = None) -> Figure:
    """Return one strip with ground reaction arrows per physical motion, on the same scale.

    Raises
    ------
    MotionStyleError
        If there is no motion, not one title for each, or one without contact forces.
    """

    def draw(axes: Axes, motion: Motion, title: str) -> None:
        draw_forces(axes, motion, stick_strip(axes, motion, FIGURES, title=title, paths=False))
        left, right = axes.get_xlim()
        axes.set_xlim(left - SCALE_WIDTH_M, right)
        bar = left - SCALE_WIDTH_M + 0.06
        axes.plot([bar] * 2, [0.0, METRES_PER_WEIGHT], color="black", linewidth=1.8)
        axes.text(bar + 0.05, METRES_PER_WEIGHT / 2, "1 body\nweight", va="center")

    figure = fit_strips(motions, titles, draw)
    handles = [
        Line2D([], [], color=SIDE_COLOURS[s], linestyle=SIDE_LINES[s], label=f"{name} limbs, force")
        for s, name in (("r", "right"), ("l", "left"))
    ]
    handles.append(Line2D([], [], color=SIDE_COLOURS[""], label="trunk and head"))
    figure.legend(handles=handles, loc="outside lower center", ncols=3, handlelength=2.4)
    return figure
