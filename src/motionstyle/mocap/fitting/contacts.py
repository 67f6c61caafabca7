"""Which foot points bear on the ground, from the fitted body (nio.md A2, our detector)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.layout import CONTACT_POINTS
from motionstyle.mocap.fitting.floor import StanceThresholds, hysteresis, speed

Array = NDArray[np.float64]


def ground_height(points: Array, rate_hz: float, *, level: bool) -> Array:
    """Return the height (m) of the ground under each foot point, (F, P).

    On a level floor it is 0. On stairs and blocks it is the lowest level of the point within
    half a second on either side.
    """
    if level:
        return np.zeros(points.shape[:2])
    window = max(1, round(0.5 * rate_hz))
    padded = np.pad(points[..., 1], ((window, window), (0, 0)), mode="edge")
    views = np.lib.stride_tricks.sliding_window_view(padded, 2 * window + 1, axis=0)
    return views.min(axis=-1)


def detect_contacts(
    points: Array, rate_hz: float, thresholds: StanceThresholds, ground: Array
) -> NDArray[np.bool_]:
    """Return which of the 8 contact points (F, 8, 3) bear in which frame, (F, 8).

    Heel, ball and toe are judged by height and speed with hysteresis; both sides of the ball
    together, by their middle.
    """
    speeds = speed(points, rate_hz)
    heights = points[..., 1] - ground
    bearing = np.zeros(heights.shape, dtype=bool)
    for side in "rl":
        column = {n: CONTACT_POINTS.index(f"{n}_{side}") for n in ("heel", "toe")}
        ball = [CONTACT_POINTS.index(f"ball_{s}_{side}") for s in ("medial", "lateral")]
        for index in column.values():
            bearing[:, index] = hysteresis(heights[:, index], speeds[:, index], thresholds, rate_hz)
        middle = hysteresis(
            heights[:, ball].mean(axis=1), speeds[:, ball].mean(axis=1), thresholds, rate_hz
        )
        bearing[:, ball] = middle[:, None]
    return bearing
