"""Which foot stood on which force plate, and the force on each foot."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.kinematics import contact_points
from motionstyle.body.layout import CONTACT_POINTS
from motionstyle.mocap.fitting.floor import runs
from motionstyle.mocap.formats.marker_clip import ForceRecord
from motionstyle.mocap.formats.mot import LOADED_N
from motionstyle.mocap.markers.ingest import placed_forces
from motionstyle.mocap.markers.markerset import Plates, read_marker_set
from motionstyle.motion.motion import Motion

Array = NDArray[np.float64]
SIDES = ("right", "left")


def middle_of_feet(motion: Motion) -> Array:
    """Return the middle of each foot, half-way from heel to ball, (F, 2, 3), m: right, left."""
    points = contact_points(motion.body, motion.pose())
    feet = []
    for side in "rl":
        heel = points[:, CONTACT_POINTS.index(f"heel_{side}")]
        ball = [CONTACT_POINTS.index(f"ball_{s}_{side}") for s in ("medial", "lateral")]
        feet.append((heel + points[:, ball].mean(axis=1)) / 2)
    return np.stack(feet, axis=1)


def plates_by_foot(motion: Motion, forces_file: str | Path, marker_set: str | Path) -> ForceRecord:
    """Return the measured force on each foot in a motion's frame, t = 0 at its first frame.

    Parameters
    ----------
    motion : from a marker file, perhaps cut since. marker_set : its YAML file.

    Raises
    ------
    MotionStyleError
        If the plates cannot be read, or the motion does not come from markers.
    """
    markers = read_marker_set(Path(marker_set).parent, Path(marker_set).stem)
    record = placed_forces(motion, forces_file, markers)
    cut = motion.provenance.get("cut_start_s", 0.0)
    record = replace(record, start_s=record.start_s - cut)
    return forces_by_foot(motion, record, markers.plates(forces_file))


def forces_by_foot(motion: Motion, record: ForceRecord, plates: Plates) -> ForceRecord:
    """Return the force on the right and the left foot out of a clip's plates.

    A plate belongs to the foot its marker set says; "nearest" goes, for each stretch of load, to
    the foot whose middle is nearest to the centre of pressure. Samples beyond the motion are
    judged by its first or last frame.

    Parameters
    ----------
    record : in the motion's frame and clock, see `ingest.placed_forces`.
    plates : of the marker set.

    Returns
    -------
    ForceRecord
        Plates "right" and "left"; where one foot stands on two, forces add, and the centre is
        their mean weighted by vertical force; free moments add with what the forces turn about
        that centre, vertically.
    """
    feet = middle_of_feet(motion)
    frame = np.clip(np.round(record.times * motion.rate_hz).astype(int), 0, motion.frames - 1)
    owner = np.full((len(record.names), len(frame)), -1)
    for p, name in enumerate(record.names):
        foot = plates.feet.get(name, "nearest")
        loaded = np.isfinite(record.centre[p]).all(axis=1) & (record.force[p, :, 1] > LOADED_N)
        for first, last in runs(loaded):
            stretch = slice(first, last + 1)
            if foot in SIDES:
                owner[p, stretch] = SIDES.index(foot)
                continue
            away = (feet[frame[stretch]] - record.centre[p, stretch, None])[..., [0, 2]]
            owner[p, stretch] = int(np.linalg.norm(away, axis=-1).mean(axis=0).argmin())
    force, centre, moment = (np.zeros((2, len(frame), 3)) for _ in range(3))
    for side in range(2):
        mine = owner == side
        share = np.where(mine[..., None], record.force, 0.0)
        force[side] = share.sum(axis=0)
        at = np.where(mine[..., None], record.centre, 0.0)
        weight = force[side][:, 1:2]
        bearing = weight[:, 0] > 0
        total = np.where(bearing[:, None], weight, 1.0)
        centre[side] = (at * share[..., 1:2]).sum(axis=0) / total
        turning = np.cross(at - centre[side], share) + np.where(mine[..., None], record.moment, 0.0)
        moment[side, :, 1] = np.where(mine, turning[..., 1], 0.0).sum(axis=0)
        centre[side, ~bearing] = np.nan
    return ForceRecord(
        names=SIDES,
        force=force,
        centre=centre,
        moment=moment,
        rate_hz=record.rate_hz,
        source=record.source,
        start_s=record.start_s,
    )
