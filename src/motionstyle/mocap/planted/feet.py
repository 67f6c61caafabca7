"""Feet that neither skate nor sink: stances of a foot's path made exact.

The rigid foot is three points (heel, medial and lateral ball). Where they bear, their heights
become 0 and their horizontal drift is taken out; what that shifts fades away in swing.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from motionstyle.body.rotations import exponential, logarithm
from motionstyle.mocap.fitting.floor import runs

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
# A point that the base counts as bearing but that has left the floor by more does not bear here.
LIFTED_M = 0.025
SLIDING_MPS = 0.8  # nor one that still, or already, slides faster
SMOOTH_S = 0.01  # s, standard deviation of the smoothing at the ends of stances
FADE_S = 0.12  # s over which a change of a foot point's height fades before and after it bears
# At push-off the foot rolls over ball and toes, which cannot both stay: each gives way a little.
# Heel, both sides of the ball, and the joint of the toes.
DRIFT_WEIGHTS = np.array([1.0, 1.0, 1.0, 0.5])


def smooth(values: Array, rate_hz: float) -> Array:
    """Return values smoothed in time by SMOOTH_S."""
    return gaussian_filter1d(values, SMOOTH_S * rate_hz, axis=0, mode="nearest")


def trimmed(bearing: Mask, points: Array, rate_hz: float) -> Mask:
    """Return stances (F, P) without ends at which the point (F, P, 3) is off the floor or slides.

    Only what lies between the first and the last quiet sample of a stance is kept.
    """
    slides = np.linalg.norm(np.gradient(points, 1 / rate_hz, axis=0)[..., [0, 2]], axis=-1)
    quiet = (points[..., 1] < LIFTED_M) & (slides < SLIDING_MPS)
    result = np.zeros_like(bearing)
    for p in range(bearing.shape[1]):
        for first, last in runs(bearing[:, p]):
            low = first + np.flatnonzero(quiet[first : last + 1, p])
            if len(low):
                result[low[0] : low[-1] + 1, p] = True
    return result


def grounded_foot(
    points: Array, rotations: Array, bearing: Mask, toe_joint: Array, rate_hz: float
) -> tuple[Array, Array]:
    """Return the foot's points (F, 3, 3) and rotations (F, 3, 3) with stances made exact.

    Parameters
    ----------
    points : world paths of heel and both sides of the ball, m. rotations : of the foot.
    bearing : which of them, and of the toes, bear on the floor y = 0, (F, 4).
    toe_joint : where the toes turn, from the middle of the points, in the foot's frame (3,), m.
    rate_hz : samples per second.
    """
    heights, rigid = points[..., 1], bearing[:, :3]
    change = smooth(_faded(np.where(rigid, -heights, 0.0), rigid, rate_hz), rate_hz)
    wanted = np.maximum(heights + change, 0.0)
    points, rotations = _at_heights(points, rotations, wanted, rigid.any(axis=1), rate_hz)
    joint = points.mean(axis=1) + rotations @ toe_joint
    rolls = bearing[:, 1:].any(axis=1)  # over the toe joint
    yaw, shift = _drift(
        np.concatenate([points, joint[:, None]], axis=1), np.column_stack([rigid, rolls])
    )
    yaw, shift = smooth(yaw, rate_hz), smooth(shift, rate_hz)
    return _turned(points, rotations, yaw[:, None] * [0.0, 1.0, 0.0], shift)


def _turned(points: Array, rotations: Array, turn: Array, shift: Array) -> tuple[Array, Array]:
    """Turn the foot about its middle by rotation vectors (F, 3) and shift it (F, 3)."""
    matrices = exponential(turn)
    middle = points.mean(axis=1, keepdims=True)
    moved = np.einsum("fab,fpb->fpa", matrices, points - middle) + middle + shift[:, None]
    return moved, matrices @ rotations


def _faded(change: Array, bearing: Mask, rate_hz: float) -> Array:
    """Return changes (F, P) that go on from where a point bears and fade within FADE_S."""
    result = np.array(change)
    fade = 1 - ease(round(FADE_S * rate_hz))
    for p in range(change.shape[1]):
        free = ~bearing[:, p]
        for first, last in runs(bearing[:, p]):
            before = np.arange(first - 1, max(-1, first - 1 - len(fade)), -1)
            after = np.arange(last + 1, min(len(change), last + 1 + len(fade)))
            for frames, edge in ((before, first), (after, last)):
                result[frames, p] += free[frames] * fade[: len(frames)] * change[edge, p]
    return result


def _at_heights(
    points: Array, rotations: Array, wanted: Array, stance: Mask, rate_hz: float
) -> tuple[Array, Array]:
    """Tilt and raise the foot until its three points have the heights (F, 3) in stance (F,).

    Tilt and rise fade before and after; in swing the foot is only raised above the floor.
    """
    tilted, moved = rotations, points
    for _ in range(3):
        arm = moved - moved.mean(axis=1, keepdims=True)
        design = np.stack([np.ones(arm.shape[:2]), -arm[..., 2], arm[..., 0]], axis=2)
        design[~stance] = np.eye(3)
        up, about_x, about_z = np.linalg.solve(design, (wanted - moved[..., 1])[..., None])[
            ..., 0
        ].T
        zero = np.zeros_like(up)
        turn = np.stack([about_x, zero, about_z], axis=1) * stance[:, None]
        moved, tilted = _turned(moved, tilted, turn, np.stack([zero, up, zero], axis=1))
    own = np.swapaxes(rotations, 1, 2)
    rise = (moved - points).mean(axis=1)[:, 1:2]
    change = np.concatenate([logarithm(own @ tilted), rise], axis=1) * stance[:, None]
    change = smooth(_faded(change, np.repeat(stance[:, None], 4, axis=1), rate_hz), rate_hz)
    middle = points.mean(axis=1) + change[:, 3:] * [0.0, 1.0, 0.0]
    rotations = rotations @ exponential(change[:, :3])
    local = own[0] @ (points[0] - points[0].mean(axis=0)).T
    points = middle[:, None] + np.swapaxes(rotations @ local, 1, 2)
    sunken = np.maximum(-points[..., 1].min(axis=1), 0.0)
    points[..., 1] += sunken[:, None]
    return points, rotations


def _drift(points: Array, bearing: Mask) -> tuple[Array, Array]:
    """Return the yaw (F,) and shift (F, 3) that stop the bearing points (F, 4) from drifting.

    The foot turns about the middle of its first three points.
    """
    count = len(points)
    both = (bearing[1:] & bearing[:-1])[..., None] * DRIFT_WEIGHTS[:, None]
    number = np.maximum(both.sum(axis=1), 1.0)
    step = np.diff(points, axis=0) * [1.0, 0.0, 1.0]
    middle = (points[1:] + points[:-1]) / 2 * [1.0, 0.0, 1.0]
    centre = (both * middle).sum(axis=1) / number
    mean = (both * step).sum(axis=1) / number
    arm = middle - centre[:, None]
    turned = arm[..., 2] * step[..., 0] - arm[..., 0] * step[..., 2]
    size = (both * arm**2).sum(axis=(1, 2))
    yaw_step = -(both[..., 0] * turned).sum(axis=1) / np.maximum(size, 1e-4)
    lever = middle[:, :3].mean(axis=1) - centre
    across = np.stack([lever[:, 2], np.zeros(count - 1), -lever[:, 0]], axis=1)
    change = np.column_stack([yaw_step, -mean + yaw_step[:, None] * across])
    path = np.zeros((count, 4))
    stances = runs(bearing.any(axis=1))
    for first, last in stances:
        within = np.concatenate([[np.zeros(4)], np.cumsum(change[first:last], axis=0)])
        path[first : last + 1] = within - within.mean(axis=0)
    for first, last in runs(~bearing.any(axis=1)):
        before = path[first - 1] if first else np.zeros(4)
        after = path[last + 1] if last + 1 < count else np.zeros(4)
        path[first : last + 1] = before + ease(last - first + 1)[:, None] * (after - before)
    return path[:, 0], path[:, 1:]


def ease(count: int) -> Array:
    """Return a smooth rise from 0 to 1 over the inside of `count` frames (quintic)."""
    s = np.arange(1, count + 1) / (count + 1)
    return s**3 * (10 - 15 * s + 6 * s**2)


def plant_path(middle: Array, bearing: Mask) -> Array:
    """Return where along x (m) a foot is planted, (F,): constant in stance, going on in swing.

    Parameters
    ----------
    middle : path of the foot's middle, (F, 3). bearing : its points, (F, P).

    Between two stances the path runs on as the foot itself does, so that scaling it by a factor
    lengthens the steps by that factor without moving a planted foot.
    """
    x = middle[:, 0]
    path = np.array(x)
    stances = runs(bearing.any(axis=1))
    for first, last in stances:
        flat = np.flatnonzero(bearing[first : last + 1, :3].all(axis=1)) + first
        path[first : last + 1] = np.median(x[flat] if len(flat) else x[first : last + 1])
    for (_, end), (start, _) in pairwise(stances):
        swing = slice(end + 1, start)
        far = x[start] - x[end]
        rise = (x[swing] - x[end]) / far if abs(far) > 0.05 else ease(start - end - 1)
        path[swing] = path[end] + rise * (path[start] - path[end])
    if stances:
        path[: stances[0][0]] += path[stances[0][0]] - x[stances[0][0]]
        path[stances[-1][1] + 1 :] += path[stances[-1][1]] - x[stances[-1][1]]
    return path
