"""Whose foot stood on which force plate, and the force on each foot."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.kinematics import contact_points
from motionstyle.mocap.floor import runs
from motionstyle.mocap.marker_clip import ForceRecord
from motionstyle.motion.motion import Motion

Array = NDArray[np.float64]
LOADED_N = 20.0
FARTHEST_M = 0.30  # from the middle of a foot to a centre of pressure that is its own


def foot_forces(
    record: ForceRecord, feet: Mapping[str, str], motion: Motion
) -> dict[str, tuple[Array, Array]]:
    """Return times (T,) in s and force (T, 3) in N of each foot, "r" and "l".

    Parameters
    ----------
    record : on the motion's clock and in its axes. feet : "right", "left" or "nearest" by plate;
        a nearest plate is given, step by step, to the foot over its centre of pressure, and to
        none where neither is within 30 cm.
    """
    times = record.times
    points = contact_points(motion.body, motion.pose())
    middles = {"r": points[:, :3].mean(axis=1), "l": points[:, 4:7].mean(axis=1)}
    found = {side: np.zeros((len(times), 3)) for side in "rl"}
    for k, name in enumerate(record.names):
        force, centre = record.force[k], record.centre[k]
        if feet[name] != "nearest":
            found[feet[name][0]] += np.nan_to_num(force)
            continue
        for first, last in runs(np.nan_to_num(force[:, 1]) > LOADED_N):
            span = slice(first, last + 1)
            frames = np.round(times[span] * motion.rate_hz).astype(int)
            inside = (frames >= 0) & (frames < motion.frames)
            if not inside.any():
                continue
            pressed = centre[span][inside][:, [0, 2]]
            away = {
                side: float(
                    np.nanmedian(
                        np.linalg.norm(middle[frames[inside]][:, [0, 2]] - pressed, axis=1)
                    )
                )
                for side, middle in middles.items()
            }
            nearest = min(away, key=away.__getitem__)
            if away[nearest] < FARTHEST_M:
                found[nearest][span] += np.nan_to_num(force[span])
    return {side: (times, force) for side, force in found.items() if (force[:, 1] > 0).any()}
