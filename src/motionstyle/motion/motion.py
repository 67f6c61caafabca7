"""`Motion`: a movement of a `Body`, whatever made it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.body import Body
from motionstyle.body.kinematics import Pose, forward_kinematics
from motionstyle.body.layout import CONTACT_POINTS, COORDINATES
from motionstyle.errors import MotionStyleError

Array = NDArray[np.float64]
Kind = Literal["captured", "planted", "nio", "warp", "shmm", "adapted"]
KINDS: tuple[str, ...] = get_args(Kind)


@dataclass(frozen=True)
class Motion:
    """Frames of a body's 35 coordinates with contacts; SI units, radians, y up.

    The pelvis faces +x in the first frame, +z is to its right, and the floor is y = 0.

    Attributes
    ----------
    id, kind : name and what made it; the file is `motions/{kind}/{id}.npz`.
    rate_hz : frames per second.
    coordinates : (F, 35), m and rad, in the order of `body.layout.COORDINATES`. Exponential maps
        are continuous in time but at `rebranched` frames.
    body : whose motion it is.
    contacts : which foot points bear on a surface, (F, 8), in `layout.CONTACT_POINTS`.
    contact_normals : unit normal of that surface per frame and point, (F, 8, 3).
    contact_forces : N in the world, (F, 8, 3), or None when unknown.
    observed : which coordinates the source shows, (35,); the others are neither learnt nor scored.
    rebranched : frames at which an exponential map had to jump (the pelvis after a full turn).
    provenance : source file, subject, action, style, example, edit and so on; JSON values only.
    """

    id: str
    kind: Kind
    rate_hz: float
    coordinates: Array
    body: Body
    contacts: NDArray[np.bool_]
    contact_normals: Array
    observed: NDArray[np.bool_]
    contact_forces: Array | None = None
    rebranched: tuple[int, ...] = ()
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        frames = len(self.coordinates)
        expected = {
            "coordinates": (frames, len(COORDINATES)),
            "contacts": (frames, len(CONTACT_POINTS)),
            "contact_normals": (frames, len(CONTACT_POINTS), 3),
            "observed": (len(COORDINATES),),
        }
        if self.contact_forces is not None:
            expected["contact_forces"] = (frames, len(CONTACT_POINTS), 3)
        for name, shape in expected.items():
            found = getattr(self, name).shape
            if found != shape:
                raise MotionStyleError(
                    f"motion {self.id}: {name} has shape {found}, expected {shape}"
                )
        if self.kind not in KINDS:
            raise MotionStyleError(f"motion {self.id}: kind '{self.kind}' is not one of {KINDS}")
        if frames == 0:
            raise MotionStyleError(f"motion {self.id}: no frames")
        if not 0 < self.rate_hz < np.inf:
            raise MotionStyleError(f"motion {self.id}: rate is {self.rate_hz} Hz, must be positive")
        bad = np.argwhere(~np.isfinite(self.coordinates))
        if len(bad):
            frame, column = bad[0]
            raise MotionStyleError(
                f"motion {self.id}: {COORDINATES[column]} is not a number at frame {frame} "
                f"({len(bad)} such values)"
            )

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.coordinates)

    @property
    def times(self) -> Array:
        """Time of each frame in s, the first at 0."""
        return np.arange(self.frames) / self.rate_hz

    def pose(self) -> Pose:
        """Return the world poses of all nodes in all frames."""
        return forward_kinematics(self.body, self.coordinates)

    def window(self, first: int, last: int) -> Motion:
        """Return frames `first` to `last`, both included, in the same world frame."""
        keep = slice(first, last + 1)
        forces = self.contact_forces
        return replace(
            self,
            coordinates=self.coordinates[keep],
            contacts=self.contacts[keep],
            contact_normals=self.contact_normals[keep],
            contact_forces=None if forces is None else forces[keep],
            rebranched=tuple(f - first for f in self.rebranched if first < f <= last),
        )
