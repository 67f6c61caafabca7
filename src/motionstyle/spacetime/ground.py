"""The ground under the feet: one plane per stance, and where bearing points are held.

A level floor is the plane y = 0. On stairs, blocks and ramps each stance tells its own plane by
where its point stands and by its contact normal; a foot point in swing is kept above the planes
of its stances before and after, of which it may be below one but not below both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionstyle.motion.motion import Motion

Array = NDArray[np.float64]
UP = np.array([0.0, 1.0, 0.0])
NOWHERE = -1e3  # m, the height of ground that nothing tells


@dataclass(frozen=True)
class Ground:
    """Planes n·p = d before and after each frame, and where stances are held.

    Attributes
    ----------
    normals, offsets : (2, F, P, 3) and (2, F, P), m.
    targets : where bearing points are held, on their plane, (F, P, 3), m.
    hold : 1 where a point is held, less at both ends of a stance, 0 in swing, (F, P).
    """

    normals: Array
    offsets: Array
    targets: Array
    hold: Array

    def clearance(self, points: Array) -> tuple[Array, Array]:
        """Return heights of points (F, P, 3) above the ground (F, P), m, and the normals there."""
        heights = np.einsum("kfpa,fpa->kfp", self.normals, points) - self.offsets
        after = heights[1] > heights[0]
        normals = np.where(after[..., None], self.normals[1], self.normals[0])
        return np.maximum(heights[0], heights[1]), normals


def stances(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return (first, stop) of each stretch of true values in a one-dimensional mask."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def find_ground(points: Array, motion: Motion, fade: int) -> Ground:
    """Return the ground under a kinematic motion's foot points.

    Parameters
    ----------
    points : (F, P, 3), m. motion : contacts, normals, and `provenance["surface"]`, by default
        level. fade : frames over which the hold on a stance comes and goes.
    """
    level = motion.provenance.get("surface", "level") == "level"
    frames, count = points.shape[:2]
    targets, hold = np.array(points), np.zeros((frames, count))
    normals = np.broadcast_to(UP, (2, frames, count, 3)).copy()
    offsets = np.zeros((2, frames, count))
    if level:
        for p in range(count):
            for first, stop in stances(motion.contacts[:, p]):
                targets[first:stop, p] = points[first:stop, p].mean(axis=0) * [1, 0, 1]
                hold[first:stop, p] = _faded(first, stop, frames, fade)
        return Ground(normals, offsets, targets, hold)
    offsets[:] = NOWHERE
    for p in range(count):
        found = stances(motion.contacts[:, p])
        for k, (first, stop) in enumerate(found):
            centre = points[first:stop, p].mean(axis=0)
            normal = motion.contact_normals[first:stop, p].mean(axis=0)
            normal /= np.linalg.norm(normal)
            targets[first:stop, p] = centre
            hold[first:stop, p] = _faded(first, stop, frames, fade)
            from_frame = 0 if k == 0 else found[k - 1][1]
            to_frame = frames if k + 1 == len(found) else found[k + 1][0]
            # Plane 0 holds from a stance's start, plane 1 up to its end.
            for side, span in ((0, slice(first, to_frame)), (1, slice(from_frame, stop))):
                normals[side, span, p], offsets[side, span, p] = normal, centre @ normal
        if found:
            first, stop = found[0][0], found[-1][1]
            normals[0, :first, p], offsets[0, :first, p] = normals[1, 0, p], offsets[1, 0, p]
            normals[1, stop:, p], offsets[1, stop:, p] = normals[0, -1, p], offsets[0, -1, p]
    return Ground(normals, offsets, targets, hold)


def _faded(first: int, stop: int, frames: int, fade: int) -> Array:
    """Return how firmly a stance is held, (stop − first,); stances cut by the clip do not fade."""
    place = np.arange(first, stop)
    come = (place - first + 1) / (fade + 1) if first > 0 else np.ones(len(place))
    go = (stop - place) / (fade + 1) if stop < frames else np.ones(len(place))
    return np.minimum(1.0, np.minimum(come, go))
