"""`tables/figure_checks.csv`: what the figures of NIO show, in numbers (nio.md F2–F4, E14, E16)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.dynamics.passive import passive_forces
from motionstyle.dynamics.shoes import Shoes
from motionstyle.spacetime.style import JOINTS_29, Style

Array = NDArray[np.float64]
CHECK_COLUMNS = (
    "config",
    "data",
    "figure",
    "style",
    "algorithm",
    "quantity",
    "value",
    "unit",
    "note",
)
REACH_RAD, STEPS = np.radians(20.0), 4001
BLUR_M = 0.01  # beyond the rest length by that much the shoe's sigmoid is 0 to 5e-5
CLEAR_RAD = 0.01  # from the rest angle on the sigmoid is 1 to 1e-4: slopes are the springs' own


def spring_curve(style: Style, joint: int) -> tuple[Array, Array]:
    """Return angles and the passive torque at rest of one joint, eqs. (6), (7): rad, N·m."""
    rest = style.passive.rest_angle
    angles = np.tile(rest, (STEPS, 1))
    angles[:, joint] += np.linspace(-REACH_RAD, REACH_RAD, STEPS)
    torque = passive_forces(style.passive, angles, np.zeros_like(angles))
    return angles[:, joint], torque[:, joint]


def two_sided_joints(style: Style) -> list[int]:
    """Return joints with two different springs, those whose stiffness differs most first."""
    p = style.passive
    gap = np.abs(p.stiffness_above - p.stiffness_below)
    order = np.argsort(-gap, kind="stable")
    return [int(j) for j in order if gap[j] > 1.0]


def spring_checks(style: Style) -> list[dict[str, Any]]:
    """Return where the curve of the joint with the clearest kink bends, and its slopes' error.

    Both are read off the curve alone: the kink is where its slope is half-way between those of
    its outer parts.
    """
    joints = two_sided_joints(style)
    if not joints:
        return []
    joint = joints[0]
    angles, torque = spring_curve(style, joint)
    rest = style.passive.rest_angle[joint]
    high, low = angles > rest + CLEAR_RAD, angles < rest - CLEAR_RAD
    above = np.polyfit(angles[high], torque[high], 1)
    below = np.polyfit(angles[low], torque[low], 1)
    kink = (below[1] - above[1]) / (above[0] - below[0])
    wanted = (style.passive.stiffness_above[joint], style.passive.stiffness_below[joint])
    largest = max(wanted)
    error = max(abs(-s[0] - w) for s, w in zip((above, below), wanted, strict=True)) / largest
    note = JOINTS_29[joint]
    return [
        {"figure": "nio-F2", "quantity": "kink_offset_deg", "unit": "deg", "note": note,
         "value": float(np.degrees(kink - rest))},
        {"figure": "nio-F2", "quantity": "slope_error_pct", "unit": "%", "note": note,
         "value": float(100 * error)},
    ]  # fmt: skip


def shoe_curve(style: Style) -> tuple[Array, Array]:
    """Return heights of the heel above ground (m) and the shoe's force (N), eq. (9)."""
    heights = np.linspace(0.0, style.shoe_rest_length + 3 * BLUR_M, STEPS)
    return heights, Shoes(style.shoe_stiffness, style.shoe_rest_length).force(heights)


def shoe_checks(style: Style) -> list[dict[str, Any]]:
    """Return the force above the rest length, and the least below it.

    Above counts from beyond the sigmoid's width on. Within it eq. (9) as printed pulls by a trace,
    which has a row of its own.
    """
    if style.shoe_stiffness <= 0 or style.shoe_rest_length <= 0:
        return []
    heights, force = shoe_curve(style)
    rest, peak = style.shoe_rest_length, float(force.max())
    note = f"peak {peak:.0f} N, rest length {1000 * rest:.1f} mm"
    values = {
        "force_above_rest_pct_of_peak": (100 * force[heights > rest + BLUR_M], "%"),
        "pull_near_rest_pct_of_peak": (100 * force[heights > rest], "%"),
        "least_force_below_rest_n": (force[heights <= rest], "N"),
    }
    rows = []
    for quantity, (found, unit) in values.items():
        value = float(found.min()) if unit == "N" else float(np.abs(found).max()) / peak
        rows.append(
            {"figure": "nio-F3", "quantity": quantity, "value": value, "unit": unit, "note": note}
        )
    return rows


def segment_checks(segments: Mapping[str, Mapping[str, Sequence[float]]]) -> list[dict[str, Any]]:
    """Return the relative drop from X_T to X_S along the segment, before and after learning.

    Parameters
    ----------
    segments : of `evaluation.spacetime.landscape.landscape`, by name: `before`, `after`.
    """
    rows = []
    for name, found in segments.items():
        s, total = np.asarray(found["s"]), np.asarray(found["total"])
        start, end = np.interp([0.0, 1.0], s, total)
        rows.append(
            {"figure": "nio-F4", "quantity": f"drop_{name}", "unit": "fraction of E(X_T)",
             "value": float((start - end) / start), "note": ""}
        )  # fmt: skip
    return rows
