"""Joint ranges in degrees, in the signs of `layout` (biomechanics.md §3, recommended bounds).

The spine's ranges hold for both spine joints together; they are split by their usual shares.
Captured data may exceed a range slightly: widen it to the clip's own range plus 5°.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.layout import COORDINATES

_SIDED = {
    "hip_flexion": (-30, 120),
    "hip_adduction": (-50, 30),
    "hip_rotation": (-40, 40),
    "knee_flexion": (-5, 140),
    "ankle_dorsiflexion": (-50, 30),
    "foot_inversion": (-20, 20),
    "toes_extension": (-30, 60),
    "shoulder_flexion": (-60, 170),
    "shoulder_abduction": (-40, 170),
    "shoulder_rotation": (-90, 90),
    "elbow_flexion": (0, 150),
}
_CENTRAL = {
    "abdomen_flexion": (-15, 40),
    "abdomen_bending": (-35, 35),
    "abdomen_rotation": (-15, 15),
    "thorax_flexion": (-10, 20),
    "thorax_rotation": (-30, 30),
    "head_flexion": (-50, 50),
    "head_rotation": (-70, 70),
}


def joint_ranges() -> NDArray[np.float64]:
    """Return lower and upper bounds of all 35 coordinates in rad (m for the root), (35, 2).

    The six root coordinates are unbounded.
    """
    bounds = np.full((len(COORDINATES), 2), (-np.inf, np.inf))
    for i, name in enumerate(COORDINATES):
        degrees = _CENTRAL.get(name) or _SIDED.get(name[:-2])
        if degrees is not None:
            bounds[i] = np.radians(degrees)
    return bounds
