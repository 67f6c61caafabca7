"""The ground under each foot where it is not the level floor: treads and ramps in strips."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.layout import CONTACT_POINTS
from motionstyle.motion.motion import Motion

Array = NDArray[np.float64]
HALF_M = 0.18  # drawn of the ground to either side of a foot's middle
# Up to which the ground is the level floor. Points that bear just before they lift or after they
# land are some centimetres above it; treads are higher than that, and ramps show by their slope.
LEVEL_M, LEVEL_COS = 0.1, np.cos(np.radians(1.0))


def tread_lines(motion: Motion, points: dict[str, Array]) -> dict[str, Array]:
    """Return both ends (F, 3) of the ground drawn under each foot, m, as `tread_{side}{0, 1}`.

    They are NaN where the foot touches nothing, or the level floor.

    Parameters
    ----------
    points : places of the contact points, (F, 3), by name.
    """
    way = motion.coordinates[-1, :3] - motion.coordinates[0, :3]
    way[1] = 0.0
    length = np.linalg.norm(way)
    ahead = way / length if length > 0.1 else np.array([1.0, 0.0, 0.0])
    places = np.stack([points[name] for name in CONTACT_POINTS], axis=1)
    lines = {}
    for side in "rl":
        own = np.array([name.endswith(f"_{side}") for name in CONTACT_POINTS])
        held = (motion.contacts & own)[..., None]
        count = held.sum(axis=1)
        with np.errstate(invalid="ignore"):
            middle = np.where(held, places, 0.0).sum(axis=1) / count
            normal = np.where(held, motion.contact_normals, 0.0).sum(axis=1) / count
        level = (np.abs(middle[:, 1]) < LEVEL_M) & (normal[:, 1] > LEVEL_COS)
        middle[level] = np.nan
        along = ahead - normal * (normal @ ahead)[:, None]
        along /= np.linalg.norm(along, axis=1)[:, None]
        for end, sign in enumerate((-1.0, 1.0)):
            lines[f"tread_{side}{end}"] = middle + sign * HALF_M * along
    return lines
