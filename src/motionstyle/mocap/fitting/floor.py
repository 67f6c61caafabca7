"""Finding the floor under a clip: when the feet stand, and the plane they stand on."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.mocap.formats.clip import SkeletonClip

Array = NDArray[np.float64]

LEAST_SIGNIFICANCE = 4.0  # slope over its standard error, for a tilt to be believed
CUT_STANCE_S = 0.2  # a stance cut off by the clip's end must be this long to tell the floor
NEARBY_S = 0.5  # on either side of a frame, where a foot's lowest level is looked for


@dataclass(frozen=True)
class StanceThresholds:
    """When a foot point counts as bearing: hysteresis in height (m) and speed (m/s).

    A contact begins below the `enter` and ends above the `leave` values; contacts shorter than
    `shortest_s` are dropped and gaps of up to `gap_s` closed.
    """

    enter_height_m: float = 0.03
    leave_height_m: float = 0.05
    enter_speed_mps: float = 0.25
    leave_speed_mps: float = 0.50
    shortest_s: float = 0.07
    gap_s: float = 0.05


@dataclass(frozen=True)
class FloorFit:
    """The plane height = offset + slope_x·x + slope_z·z in the clip's own axes.

    tilt_deg is the steepest slope; `contacts` the number of stances it rests on; `span_m` their
    horizontal extent. A slope along a direction the stances do not span is taken as zero.
    """

    offset: float
    slope_x: float
    slope_z: float
    contacts: int
    span_m: float

    @property
    def normal(self) -> Array:
        """Unit normal, pointing up."""
        normal = np.array([-self.slope_x, 1.0, -self.slope_z])
        return normal / np.linalg.norm(normal)

    @property
    def tilt_deg(self) -> float:
        """Angle between the plane and the horizontal, in degrees."""
        return float(np.degrees(np.arctan(np.hypot(self.slope_x, self.slope_z))))


def speed(points: Array, rate_hz: float) -> Array:
    """Return the speed in m/s of points (F, ..., 3) by central differences, (F, ...)."""
    return np.linalg.norm(np.gradient(points, 1.0 / rate_hz, axis=0), axis=-1)


def runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return (first, last) of each stretch of true values in a one-dimensional mask."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def hysteresis(
    heights: Array, speeds: Array, thresholds: StanceThresholds, rate_hz: float
) -> NDArray[np.bool_]:
    """Return in which frames one point bears (F,), given its height (m) and speed (m/s)."""
    inside = (heights < thresholds.leave_height_m) & (speeds < thresholds.leave_speed_mps)
    core = (heights < thresholds.enter_height_m) & (speeds < thresholds.enter_speed_mps)
    bearing = np.zeros(len(heights), dtype=bool)
    for first, last in runs(inside):
        if core[first : last + 1].any():
            bearing[first : last + 1] = True
    gap = round(thresholds.gap_s * rate_hz)
    for first, last in runs(~bearing):
        if first > 0 and last < len(bearing) - 1 and last - first + 1 <= gap:
            bearing[first : last + 1] = True
    shortest = max(2, round(thresholds.shortest_s * rate_hz))
    for first, last in runs(bearing):
        if last - first + 1 < shortest and first > 0 and last < len(bearing) - 1:
            bearing[first : last + 1] = False
    return bearing


def standing_points(
    points: Array, rate_hz: float, thresholds: StanceThresholds
) -> list[tuple[int, int, int]]:
    """Return stances (point, first, last) of foot points (F, P, 3) on an unknown floor.

    A point stands where it is slow and low against its own lowest level nearby (0.5 s on either
    side), so that slopes and steps do not hide stances: a foot's former stance on a floor that
    rises by 1.3° lies 4 cm lower, and must be out of sight.
    """
    speeds = speed(points, rate_hz)
    window = max(1, round(NEARBY_S * rate_hz))
    found = []
    for p in range(points.shape[1]):
        height = points[:, p, 1]
        padded = np.pad(height, window, mode="edge")
        lowest = np.lib.stride_tricks.sliding_window_view(padded, 2 * window + 1).min(axis=1)
        bearing = hysteresis(height - lowest, speeds[:, p], thresholds, rate_hz)
        found += [(p, first, last) for first, last in runs(bearing)]
    return found


def fit_floor(
    points: Array,
    rate_hz: float,
    thresholds: StanceThresholds,
    *,
    level: bool,
    shortest_span_m: float = 1.0,
) -> FloorFit:
    """Fit the plane under the feet to the lowest foot points (F, P, 3) while they stand.

    Parameters
    ----------
    points : world positions of ball joints, m, y up.
    level : whether the floor is one plane whose tilt is to be fitted; otherwise (stairs, blocks)
        the slopes are zero and the offset is the height of the lowest stances.
    shortest_span_m : stances must spread this far along a direction for a slope to be fitted.
    """
    stances = standing_points(points, rate_hz, thresholds)
    # a foot still falling when the clip ends is at its lowest there, and would tilt the floor
    whole = [
        (p, a, b)
        for p, a, b in stances
        if (a > 0 and b < len(points) - 1) or b - a + 1 >= CUT_STANCE_S * rate_hz
    ]
    stances = whole or stances
    if not stances:
        return FloorFit(float(np.quantile(points[..., 1], 0.01)), 0.0, 0.0, 0, 0.0)
    spots = np.array([np.median(points[a : b + 1, p], axis=0) for p, a, b in stances])
    heights, ground = spots[:, 1], spots[:, [0, 2]]
    centre = np.median(ground, axis=0)
    spread = ground - centre
    _, _, directions = np.linalg.svd(spread, full_matrices=False)
    span = np.ptp(spread @ directions.T, axis=0)
    span_m = float(span.max())
    if not level:
        return FloorFit(float(np.quantile(heights, 0.1)), 0.0, 0.0, len(stances), span_m)
    usable = directions[span >= shortest_span_m] if len(stances) >= 3 else directions[:0]
    solution, significance = _robust_plane(spread @ usable.T, heights)
    if len(usable) and (significance < LEAST_SIGNIFICANCE).any():
        usable = usable[significance >= LEAST_SIGNIFICANCE]
        solution, _ = _robust_plane(spread @ usable.T, heights)
    slope = solution[1:] @ usable if len(usable) else np.zeros(2)
    offset = float(solution[0] - slope @ centre)
    return FloorFit(offset, float(slope[0]), float(slope[1]), len(stances), span_m)


def _robust_plane(along: Array, heights: Array) -> tuple[Array, Array]:
    """Fit heights (S,) linearly along directions (S, D); return (1 + D,) and slope/error (D,).

    Huber weights: a foot caught in mid-air must not tilt the floor.
    """
    design = np.column_stack([np.ones(len(heights)), along])
    weights = np.ones(len(heights))
    for _ in range(20):
        solution = np.linalg.lstsq(design * weights[:, None], heights * weights, rcond=None)[0]
        residual = np.abs(heights - design @ solution)
        scale = max(float(np.median(residual)), 2e-3)
        weights = np.sqrt(np.minimum(1.0, 1.5 * scale / np.maximum(residual, 1e-12)))
    weighted = design * weights[:, None]
    freedom = max(len(heights) - design.shape[1], 1)
    variance = max(float(((residual * weights) ** 2).sum()) / freedom, 1e-6)
    errors = np.sqrt(variance * np.diag(np.linalg.pinv(weighted.T @ weighted)))
    return solution, np.abs(solution[1:]) / np.maximum(errors[1:], 1e-12)


def move_clip(clip: SkeletonClip, rotation: Array, translation: Array) -> SkeletonClip:
    """Return the clip with every world point p moved to rotation·p + translation."""
    return replace(
        clip,
        positions=clip.positions @ rotation.T + translation,
        rotations=rotation @ clip.rotations,
    )
