"""How far two movements of one body lie apart."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.layout import JOINT_COORDINATES

Array = NDArray[np.float64]


def joint_rms_deg(found: Array, wanted: Array) -> float:
    """Return the rms difference of the 29 joint coordinates of two (F, 35), degrees."""
    away = (found - wanted)[:, JOINT_COORDINATES]
    return float(np.degrees(np.sqrt((away**2).mean())))
