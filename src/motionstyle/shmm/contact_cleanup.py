"""Optional clean-up of skating feet: the root moves so that the standing foot rests.

The paper does none and says so (style_machines.md §11); skating is reported before and after.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.kinematics import contact_points
from motionstyle.motion.motion import Motion
from motionstyle.motion.resample import lowpass

Array = NDArray[np.float64]
SMOOTH_HZ = 6.0


def lower_point_velocity(motion: Motion, height_m: float) -> tuple[Array, NDArray[np.bool_]]:
    """Return the horizontal velocity (F, 3) of the lowest foot point, and where it is low."""
    points = contact_points(motion.body, motion.pose())
    velocity = np.gradient(points, 1 / motion.rate_hz, axis=0)
    velocity[..., 1] = 0.0
    lowest = points[..., 1].argmin(axis=1)
    frames = np.arange(motion.frames)
    return velocity[frames, lowest], points[frames, lowest, 1] < height_m


def clean_up(motion: Motion, height_m: float = 0.03) -> Motion:
    """Return the motion with its pelvis moved so that the lowest foot point does not slide.

    While a foot is lower than `height_m` its velocity is taken off the pelvis'; in flight the
    correction is interpolated. Joint angles stay as they are.
    """
    velocity, standing = lower_point_velocity(motion, height_m)
    frames = np.arange(motion.frames)
    if not standing.any():
        return motion
    correction = np.stack(
        [np.interp(frames, frames[standing], velocity[standing, k]) for k in range(3)], axis=1
    )
    correction = lowpass(correction, motion.rate_hz, SMOOTH_HZ)
    moved = motion.coordinates.copy()
    moved[:, :3] -= np.cumsum(correction, axis=0) / motion.rate_hz
    moved[:, 1] = motion.coordinates[:, 1]
    provenance = {**motion.provenance, "contact_cleanup": True}
    return replace(motion, coordinates=moved, provenance=provenance)
