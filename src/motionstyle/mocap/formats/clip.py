"""`SkeletonClip`: what every skeleton-file reader returns, in metres and radians."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class SkeletonClip:
    """A captured motion on its own source skeleton (J joints, F frames).

    World axes are right-handed and as in the file until ingestion turns them to y up;
    end sites are joints too, named `<parent>_end`, with identity local rotation.

    Attributes
    ----------
    joints : names of the J joints, parents before children.
    parents : index of each joint's parent, -1 for a root; shape (J,).
    rest_offsets : joint positions in the parent's frame at zero rotation, (J, 3), in `unit`s
        of the file as read, in metres after ingestion.
    positions : joint centres in the world, (F, J, 3).
    rotations : world rotation matrices of the joint frames (columns are the joint's axes), the
        identity for every joint in the file's zero pose, (F, J, 3, 3).
    rate_hz : frames per second.
    source : the file the clip was read from, for messages.
    """

    joints: tuple[str, ...]
    parents: NDArray[np.int64]
    rest_offsets: NDArray[np.float64]
    positions: NDArray[np.float64]
    rotations: NDArray[np.float64]
    rate_hz: float
    source: str

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.positions)

    def window(self, first: int, last: int) -> SkeletonClip:
        """Return frames `first` to `last`, both included."""
        keep = slice(first, last + 1)
        return replace(self, positions=self.positions[keep], rotations=self.rotations[keep])

    def rest_positions(self) -> NDArray[np.float64]:
        """Return joint centres of the zero pose with the root at the origin, (J, 3)."""
        rest = np.zeros((len(self.joints), 3))
        for joint, parent in enumerate(self.parents):
            if parent >= 0:
                rest[joint] = rest[parent] + self.rest_offsets[joint]
        return rest


def forward_kinematics(
    parents: NDArray[np.int64],
    local_positions: NDArray[np.float64],
    local_rotations: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Chain local joint transforms (F, J, 3) and (F, J, 3, 3) into world ones, same shapes."""
    positions = np.empty_like(local_positions)
    rotations = np.empty_like(local_rotations)
    for joint, parent in enumerate(parents):
        if parent < 0:
            positions[:, joint] = local_positions[:, joint]
            rotations[:, joint] = local_rotations[:, joint]
            continue
        rotations[:, joint] = rotations[:, parent] @ local_rotations[:, joint]
        positions[:, joint] = positions[:, parent] + np.einsum(
            "fab,fb->fa", rotations[:, parent], local_positions[:, joint]
        )
    return positions, rotations
