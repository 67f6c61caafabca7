"""Joint angles of the mean gait cycle against published bands (biomechanics.md §4.3)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.gait import joint_cycles
from motionstyle.evaluation.normative import Normative
from motionstyle.figures.style import BAND, motion_title, new_figure, series_style, styled
from motionstyle.motion.motion import Motion

_TITLES = {
    "hip_flexion": "hip flexion",
    "knee_flexion": "knee flexion",
    "ankle_dorsiflexion": "ankle dorsiflexion",
}
_BAR_WIDTH_PCT = 5.0
_BAND_LABEL = "published 2.5–97.5 %, midpoint"


def _bars(axes: Axes, normative: Normative, joint: str) -> None:
    """Draw the published bands as bars with a line at the midpoint."""
    for percent, band in normative.angles[joint].items():
        height = band.high - band.low
        axes.bar(percent, height, _BAR_WIDTH_PCT, band.low, color=BAND, zorder=0)
        half = _BAR_WIDTH_PCT / 2
        line = [percent - half, percent + half]
        axes.plot(line, [band.midpoint] * 2, color="#999999", linewidth=1, zorder=0.5)


@styled
def gait_figure(
    motions: Sequence[Motion],
    normative: Normative,
    titles: Sequence[str] | None = None,
) -> Figure:
    """Return hip, knee and ankle angle of each motion's mean cycle ± SD over the bands.

    The mean is over the complete cycles of both legs, each from its own heel strike. Motions
    without a complete cycle are named in the legend as such.

    Raises
    ------
    MotionStyleError
        If there is no motion, or not one title for each.
    """
    names = [m.id for m in motions] if titles is None else list(titles)
    if not motions or len(names) != len(motions):
        raise MotionStyleError(f"a gait figure of {len(motions)} motions got {len(names)} titles")
    columns = min(3, len(motions))
    rows = -(-(len(motions) + 1) // columns)
    figure = new_figure(2.5 + 0.17 * rows)
    grid = figure.subplots(1, len(normative.angles))
    handles = [Patch(color=BAND, label=_BAND_LABEL)]
    percent = np.linspace(0, 100, 101)
    for axes, joint in zip(grid, normative.angles, strict=True):
        _bars(axes, normative, joint)
        handles = handles[:1]
        for k, (motion, name) in enumerate(zip(motions, names, strict=True)):
            cycles = joint_cycles(motion, joint, 101)
            label = motion_title(motion, name)
            style = series_style(k)
            if not len(cycles):
                handles += axes.plot([], [], **style, label=f"{label}: no complete cycle")
                continue
            mean, deviation = cycles.mean(axis=0), cycles.std(axis=0)
            axes.fill_between(
                percent, mean - deviation, mean + deviation, color=style["color"], alpha=0.15, lw=0
            )
            label += f": {len(cycles)} cycle{'s' if len(cycles) > 1 else ''}"
            handles += axes.plot(percent, mean, **style, linewidth=1.2, label=label)
        axes.set_title(_TITLES.get(joint, joint), loc="left")
        axes.set_xlim(-4, 104)
        axes.set_xticks([0, 25, 50, 75, 100])
        axes.set_xlabel("cycle from heel strike, %")
        axes.axhline(0, color="black", linewidth=0.4, zorder=0.2)
    grid[0].set_ylabel("angle, deg (mean ± SD)")
    figure.legend(handles=handles, loc="outside lower center", ncols=columns)
    return figure
