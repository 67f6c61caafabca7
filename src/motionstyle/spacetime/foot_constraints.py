"""What the feet must keep to, frame by frame: the constraints C(X) of Liu et al. 2005, eq. (14).

Footprints (`spacetime.footprints`) are made into these arrays once; the optimiser sees only them.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.layout import CONTACT_POINTS
from motionstyle.errors import MotionStyleError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FootConstraints:
    """Where foot points are held, where they may push, and what they must stay above.

    Every foot point of every frame knows one plane: the surface it stands on or swings over.

    Attributes
    ----------
    held : point is held at its target, (F, 8). It may push there, within the friction cone.
    sliding : of the held, those held to the surface only, free to move along it, (F, 8).
    targets : where held points are, m, (F, 8, 3); on the plane. Unheld: any finite value.
    ground : a point of the plane, m, (F, 8, 3). normals : its unit normal, (F, 8, 3).
    clearance : least height of an unheld point above its plane, m, (F, 8); 0 on clean ground,
        below it where a captured motion itself sinks.
    friction : coefficient of the cone, (F, 8).
    """

    held: NDArray[np.bool_]
    sliding: NDArray[np.bool_]
    targets: Array
    ground: Array
    normals: Array
    clearance: Array
    friction: Array

    def __post_init__(self) -> None:
        frames, points = len(self.held), len(CONTACT_POINTS)
        for field in fields(self):
            found = getattr(self, field.name)
            vector = field.name in {"targets", "ground", "normals"}
            shape = (frames, points, 3) if vector else (frames, points)
            if found.shape != shape:
                raise MotionStyleError(
                    f"foot constraints: {field.name} has shape {found.shape}, expected {shape}"
                )
            if not np.isfinite(found).all():
                raise MotionStyleError(f"foot constraints: {field.name} has values not finite")

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.held)

    def cone_excess(self, forces: Array) -> float:
        """Return by how much the worst of forces (F, 8, 3), N, leaves its friction cone.

        Pulling on the ground and pushing with a point that is not held count in full.
        """
        normal = (forces * self.normals).sum(axis=-1)
        along = np.linalg.norm(forces - normal[..., None] * self.normals, axis=-1)
        excess = np.maximum(along - self.friction * np.maximum(normal, 0.0), -normal)
        free = np.linalg.norm(forces, axis=-1)
        return float(np.maximum(np.where(self.held, excess, free), 0.0).max())
