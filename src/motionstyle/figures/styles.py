"""A style as a picture that a biomechanist can read: per joint α, springs, damping, rest angle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from motionstyle.figures.style import SERIES, SIDE_COLOURS, blank_figure, new_figure, styled
from motionstyle.spacetime.style import JOINTS_29, Style

PANELS = (
    ("preference α × 29", "log"),
    ("stiffness above rest, N m/rad", "linear"),
    ("stiffness below rest, N m/rad", "linear"),
    ("damping, N m s/rad", "linear"),
    ("rest angle, deg", "linear"),
)


def joint_lines() -> dict[str, dict[str, int]]:
    """Return, for each joint without its side, the numbers of its coordinates by side."""
    lines: dict[str, dict[str, int]] = {}
    for k, name in enumerate(JOINTS_29):
        stem, _, side = name.rpartition("_")
        sided = side in ("l", "r")
        lines.setdefault(stem if sided else name, {})[side if sided else ""] = k
    return lines


def _values(style: Style) -> tuple[np.ndarray, ...]:
    p = style.passive
    count = len(style.preferences)
    return (
        count * style.preferences,
        p.stiffness_above,
        p.stiffness_below,
        p.damping,
        np.degrees(p.rest_angle),
    )


def _panels(figure: Figure, lines: Mapping[str, object]) -> list[Axes]:
    axes = list(figure.subplots(1, len(PANELS), sharey=True))
    for axis, (label, scale) in zip(axes, PANELS, strict=True):
        axis.set_xscale(scale)
        if scale == "log":
            axis.xaxis.set_minor_formatter(NullFormatter())
        axis.set_xlabel(label, fontsize="x-small")
        axis.tick_params(labelsize="x-small")
        axis.grid(axis="y", color="0.92", lw=0.5)
    axes[0].set_yticks(range(len(lines)), [name.replace("_", " ") for name in lines])
    axes[0].invert_yaxis()
    return axes


@styled
def style_sides_figure(style: Style, initial: Style, title: str) -> Figure:
    """Return one style's parameters per joint, right and left in their colours, and their start."""
    lines = joint_lines()
    figure = new_figure(4.6)
    axes = _panels(figure, lines)
    away = {"r": -0.15, "l": 0.15, "": 0.0}
    words = {"r": "right", "l": "left", "": "trunk and head"}
    for axis, values, before in zip(axes, _values(style), _values(initial), strict=True):
        for side, shift in away.items():
            at = [(y + shift, k[side]) for y, k in enumerate(lines.values()) if side in k]
            places, numbers = zip(*at, strict=True)
            chosen = list(numbers)
            axis.plot(values[chosen], places, "o", ms=3.5, color=SIDE_COLOURS[side],
                      label=words[side])  # fmt: skip
            axis.plot(before[chosen], places, "|", ms=6, color="0.5",
                      label=None if side else "start of learning")  # fmt: skip
    axes[0].axvline(1, color="0.8", lw=0.6, zorder=0)
    handles = axes[0].get_legend_handles_labels()
    figure.legend(*handles, loc="outside lower center", ncols=4, fontsize="x-small")
    shoes = f"shoes {style.shoe_stiffness / 1000:.1f} N/mm, {1000 * style.shoe_rest_length:.1f} mm"
    figure.suptitle(f"{title}; {shoes}")
    return figure


@styled
def style_compared_figure(pairs: Sequence[tuple[str, Style, str, Style]]) -> Figure:
    """Return styles beside those they are compared with, means of both sides.

    pairs : name and style, and name and style it is held against.
    """
    if not pairs:
        return blank_figure("no two styles to compare were learnt")
    lines = joint_lines()
    figure = new_figure(3.1 * len(pairs))
    for part, (name, style, other_name, other) in zip(
        np.atleast_1d(figure.subfigures(len(pairs), 1)), pairs, strict=True
    ):
        axes = _panels(part, lines)
        for axis, a, b in zip(axes, _values(other), _values(style), strict=True):
            before = [float(a[list(k.values())].mean()) for k in lines.values()]
            after = [float(b[list(k.values())].mean()) for k in lines.values()]
            for y, (x0, x1) in enumerate(zip(before, after, strict=True)):
                axis.plot([x0, x1], [y, y], color="0.7", lw=1.0, zorder=1)
            axis.plot(before, range(len(lines)), "o", ms=3.5, mfc="white", color=SERIES[0],
                      label=other_name)  # fmt: skip
            axis.plot(after, range(len(lines)), "o", ms=3.5, color=SERIES[1], label=name)
        part.suptitle(f"{name} against {other_name} (means of both sides)")
        part.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2,
                    fontsize="x-small")  # fmt: skip
    return figure
