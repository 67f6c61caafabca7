"""Marker paths made ready for fitting: gaps, low-pass, the treadmill's belt, a common origin."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.mocap.fitting.floor import runs
from motionstyle.mocap.formats.marker_clip import ForceRecord, MarkerClip
from motionstyle.mocap.markers.markerset import Assigned
from motionstyle.motion.resample import lowpass

Array = NDArray[np.float64]
LONGEST_GAP_S = 0.2  # a marker is interpolated over gaps up to this, and weighs nothing in others
LOW_M = 0.02  # a foot marker this far above its lowest level is taken to be on the belt
LOW_SHARE = 0.05


@dataclass(frozen=True)
class Placement:
    """How the laboratory was moved to the motion's frame: p ↦ rotation·(p + t·belt) + translation.

    Attributes
    ----------
    rotation, translation : (3, 3), (3,) m.
    belt : velocity at which the belt's frame moves forward through the laboratory's, m/s, (3,);
        zero off the treadmill. On it the motion is told in the belt's frame, where a standing
        foot stands still: at constant speed mechanics is the same in both.
    start_s : the clock's time at the motion's first frame, from which t counts.
    """

    rotation: Array
    translation: Array
    belt: Array
    start_s: float

    def to_json(self) -> dict[str, Any]:
        """Return the placement as plain lists, for a motion's provenance."""
        return {
            "rotation": self.rotation.tolist(),
            "translation": self.translation.tolist(),
            "belt": self.belt.tolist(),
            "start_s": self.start_s,
        }

    @staticmethod
    def from_json(values: dict[str, Any]) -> Placement:
        """Return the placement that `to_json` wrote."""
        arrays = (np.array(values[k]) for k in ("rotation", "translation", "belt"))
        return Placement(*arrays, float(values["start_s"]))

    def points(self, points: Array, times: Array) -> Array:
        """Move points (T, ..., 3) of the laboratory at clock times (T,) to the motion's frame."""
        drift = (times - self.start_s)[:, None] * self.belt
        drift = drift.reshape(len(times), *(1,) * (points.ndim - 2), 3)
        return (points + drift) @ self.rotation.T + self.translation

    def clip(self, clip: MarkerClip) -> MarkerClip:
        """Move a marker clip."""
        times = clip.start_s + np.arange(clip.frames) / clip.rate_hz
        return replace(clip, positions=self.points(clip.positions, times))

    def forces(self, record: ForceRecord) -> ForceRecord:
        """Move a force record; its clock then starts at the motion's first frame."""
        turn = self.rotation.T
        corners = record.corners
        return replace(
            record,
            force=record.force @ turn,
            moment=record.moment @ turn,
            centre=np.stack([self.points(c, record.times) for c in record.centre]),
            corners=None if corners is None else corners @ turn + self.translation,
            start_s=record.start_s - self.start_s,
        )


def belt_velocity(clip: MarkerClip, assigned: Assigned) -> Array:
    """Return the velocity (3,), m/s, to add to a treadmill clip so that standing feet stand still.

    The median backward velocity of heel and forefoot markers while each is low.
    """
    found = []
    for name in ("heel", "toe", "mtp_lateral", "mtp_medial"):
        for side in "rl":
            label = assigned.landmarks.get(f"{name}_{side}")
            if label is None:
                continue
            path = clip.path(label)
            velocity = np.gradient(path, 1.0 / clip.rate_hz, axis=0)
            low = path[:, 1] < np.nanquantile(path[:, 1], LOW_SHARE) + LOW_M
            found.append(velocity[low & np.isfinite(velocity).all(axis=1)])
    return -np.median(np.concatenate(found), axis=0) * [1.0, 0.0, 1.0]


def fill_gaps(clip: MarkerClip, labels: tuple[str, ...]) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return paths (F, M, 3) without gaps, their weights (F, M), and where they were seen (F, M).

    Gaps are bridged by straight lines and ends held; the weight is 0 in gaps longer than 0.2 s and
    in those at the ends.
    """
    columns = [clip.labels.index(label) for label in labels]
    paths = np.array(clip.positions[:, columns])
    seen = np.isfinite(paths).all(axis=-1)
    weights = seen.astype(float)
    frames = np.arange(clip.frames)
    for m in range(len(labels)):
        if seen[:, m].all():
            continue
        known = frames[seen[:, m]]
        for axis in range(3):
            paths[:, m, axis] = np.interp(frames, known, paths[known, m, axis])
        for first, last in runs(~seen[:, m]):
            inside = first > 0 and last < clip.frames - 1
            if inside and (last - first + 1) / clip.rate_hz <= LONGEST_GAP_S:
                weights[first : last + 1, m] = 1.0
    return paths, weights, seen


def smooth_paths(paths: Array, seen: NDArray[np.bool_], rate_hz: float, cutoff_hz: float) -> Array:
    """Low-pass marker paths (F, M, 3), each stretch between long gaps for itself.

    A stretch too short to filter stays as it is.
    """
    result = lowpass(paths, rate_hz, cutoff_hz)
    longest = round(LONGEST_GAP_S * rate_hz)
    for m in np.flatnonzero(~seen.all(axis=0)):
        mask = np.array(seen[:, m])
        for first, last in runs(~mask):
            if first > 0 and last < len(mask) - 1 and last - first + 1 <= longest:
                mask[first : last + 1] = True
        for first, last in runs(mask):
            stretch = slice(first, last + 1)
            result[stretch, m] = lowpass(paths[stretch, m], rate_hz, cutoff_hz)
    return result
