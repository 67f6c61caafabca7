"""Which foot points bear on the ground, from the fitted body (nio.md A2, our detector)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.layout import CONTACT_POINTS
from motionstyle.mocap.fitting.floor import StanceThresholds, hysteresis, runs, speed

Array = NDArray[np.float64]


def ground_height(
    points: Array, rate_hz: float, thresholds: StanceThresholds, *, level: bool
) -> Array:
    """Return the height (m) of the ground under each foot point, (F, P).

    On a level floor it is 0. On stairs and blocks it is the level at which the point last rested
    or will rest next, whichever is nearer in time, and never above the point itself. A foot going
    down stairs rests on its step until it leaves it, however low it treads next.
    """
    if level:
        return np.zeros(points.shape[:2])
    ground = np.array(points[..., 1])
    speeds = speed(points, rate_hz)
    frames, shortest = np.arange(len(points)), max(2, round(thresholds.shortest_s * rate_hz))
    for p in range(points.shape[1]):
        resting = speeds[:, p] < thresholds.enter_speed_mps
        rests = [(a, b) for a, b in runs(resting) if b - a + 1 >= shortest]
        if not rests:
            ground[:, p] = points[:, p, 1].min()
            continue
        levels = np.array([points[a : b + 1, p, 1].min() for a, b in rests])
        away = np.array([np.maximum(np.maximum(a - frames, frames - b), 0) for a, b in rests])
        ground[:, p] = np.minimum(levels[away.argmin(axis=0)], points[:, p, 1])
    return ground


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
