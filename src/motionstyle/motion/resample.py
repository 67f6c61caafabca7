"""Changing a motion's rate, the one way for every stage."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from scipy.signal import butter, sosfiltfilt
from scipy.spatial.transform import Rotation

from motionstyle.body.layout import EXPONENTIAL_BLOCKS
from motionstyle.body.rotations import logarithm, slerp, unroll
from motionstyle.errors import MotionStyleError
from motionstyle.motion.motion import Motion

Array = NDArray[np.float64]


def lowpass(values: Array, rate_hz: float, cutoff_hz: float, order: int = 2) -> Array:
    """Filter along the time axis with a zero-phase Butterworth filter of order 2·`order`.

    Values whose rate is too low for the cut-off (cut-off ≥ 0.45 of the rate) come back unchanged,
    and so do sequences too short to filter (fewer than 10 frames).
    """
    if cutoff_hz >= 0.45 * rate_hz or len(values) < 10:
        return np.array(values)
    sections = butter(order, cutoff_hz, fs=rate_hz, output="sos")
    padding = min(len(values) - 1, round(rate_hz / cutoff_hz * 3))
    return sosfiltfilt(sections, values, axis=0, padtype="odd", padlen=padding)


def _rebranched_blocks(motion: Motion) -> list[slice]:
    """Return the exponential maps that jump at one of the motion's re-branched frames."""
    after = np.array(motion.rebranched, dtype=int)
    steps = motion.coordinates[after] - motion.coordinates[after - 1]
    return [b for b in EXPONENTIAL_BLOCKS if (np.linalg.norm(steps[:, b], axis=1) > np.pi).any()]


def _quaternions(vectors: Array) -> Array:
    """Return unit quaternions (F, 4) of rotation vectors (F, 3), continuous in time."""
    quaternions = Rotation.from_rotvec(vectors).as_quat()
    flips = np.einsum("fa,fa->f", quaternions[1:], quaternions[:-1]) < 0
    quaternions[1:] *= np.cumprod(np.where(flips, -1.0, 1.0))[:, None]
    return quaternions


def resample(motion: Motion, rate_hz: float) -> Motion:
    """Return the motion at another rate (Hz) on the same time span.

    Angles and positions go through cubic splines, and so do exponential maps that are continuous;
    one that was re-branched is interpolated along great arcs. Going down in rate the signal is
    low-passed first at 0.4 of the new rate. Contacts are taken from the nearest frame, contact
    forces are interpolated linearly.

    Raises
    ------
    MotionStyleError
        If the rate is not positive or the motion has fewer than four frames.
    """
    if not 0 < rate_hz < np.inf:
        raise MotionStyleError(f"motion {motion.id}: cannot resample to {rate_hz} Hz")
    if np.isclose(rate_hz, motion.rate_hz, rtol=1e-9):
        return motion
    if motion.frames < 4:
        raise MotionStyleError(
            f"motion {motion.id}: {motion.frames} frames are too few to resample, need 4"
        )
    old = motion.times
    count = int(np.floor(old[-1] * rate_hz + 1e-6)) + 1
    new = np.minimum(np.arange(count) / rate_hz, old[-1])
    cutoff = 0.4 * rate_hz if rate_hz < motion.rate_hz else np.inf
    source = lowpass(motion.coordinates, motion.rate_hz, cutoff)
    coordinates = make_interp_spline(old, source, k=3)(new)
    rebranched: set[int] = set()
    for block in _rebranched_blocks(motion):
        turned = lowpass(_quaternions(motion.coordinates[:, block]), motion.rate_hz, cutoff)
        matrices = slerp(Rotation.from_quat(turned).as_matrix(), old, new)
        coordinates[:, block], jumps = unroll(logarithm(matrices))
        rebranched.update(jumps)
    nearest = np.minimum(np.round(new * motion.rate_hz).astype(int), motion.frames - 1)
    forces = motion.contact_forces
    if forces is not None:
        forces = make_interp_spline(old, forces, k=1)(new)
    return replace(
        motion,
        rate_hz=float(rate_hz),
        coordinates=coordinates,
        contacts=motion.contacts[nearest],
        contact_normals=motion.contact_normals[nearest],
        contact_forces=forces,
        rebranched=tuple(sorted(rebranched)),
    )
