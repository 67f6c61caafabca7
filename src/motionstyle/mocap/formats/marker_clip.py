"""`MarkerClip` and `ForceRecord`: what marker and force-plate files hold, in metres and newtons.

Readers return these with the axes of the file; `upright` turns a z-up laboratory to y up.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError

Array = NDArray[np.float64]

# Turns z-up axes to y-up ones: x stays, the old z is the new y, the old y points to the new −z.
Z_UP_TO_Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


@dataclass(frozen=True)
class MarkerClip:
    """Paths of labelled markers.

    Attributes
    ----------
    labels : one name per marker, each once.
    positions : (F, M, 3), m; NaN where a marker was not seen.
    rate_hz : frames per second.
    source : the file.
    start_s : time of the first frame on the clock that the force plates share, s.
    unit : the file's own unit of length, such as "mm".
    """

    labels: tuple[str, ...]
    positions: Array
    rate_hz: float
    source: str
    start_s: float = 0.0
    unit: str = "m"

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.positions)

    def window(self, first: int, last: int) -> MarkerClip:
        """Return frames `first` to `last`, both included."""
        return replace(
            self,
            positions=self.positions[first : last + 1],
            start_s=self.start_s + first / self.rate_hz,
        )

    def path(self, label: str) -> Array:
        """Return one marker's path, (F, 3), m."""
        return self.positions[:, self.labels.index(label)]


@dataclass(frozen=True)
class ForceRecord:
    """What force plates measured: forces on the person, in the axes of the laboratory.

    Attributes
    ----------
    names : one per plate (or foot).
    force : (P, T, 3), N. centre : of pressure, (P, T, 3), m; NaN where a plate is unloaded.
    moment : free moment about the centre of pressure, (P, T, 3), N·m.
    rate_hz : samples per second. start_s : time of the first sample, s.
    source : the file. corners : of the plates, (P, 4, 3), m, or None where the file has none.
    """

    names: tuple[str, ...]
    force: Array
    centre: Array
    moment: Array
    rate_hz: float
    source: str
    start_s: float = 0.0
    corners: Array | None = None

    @property
    def times(self) -> Array:
        """Time of each sample, s."""
        return self.start_s + np.arange(self.force.shape[1]) / self.rate_hz


def scaled(clip: MarkerClip, factor: float) -> MarkerClip:
    """Return the clip with its positions multiplied by `factor`."""
    return replace(clip, positions=clip.positions * factor)


def upright(clip: MarkerClip, up_axis: str) -> MarkerClip:
    """Return the clip with y up; `up_axis` ("y" or "z") is the axis that is up now.

    Raises
    ------
    MotionStyleError
        If the axis is neither.
    """
    if _turned(clip.source, up_axis):
        return replace(clip, positions=clip.positions @ Z_UP_TO_Y_UP.T)
    return clip


def upright_forces(record: ForceRecord, up_axis: str) -> ForceRecord:
    """Return the record with y up, like `upright`."""
    if not _turned(record.source, up_axis):
        return record
    turn = Z_UP_TO_Y_UP.T
    return replace(
        record,
        force=record.force @ turn,
        centre=record.centre @ turn,
        moment=record.moment @ turn,
        corners=None if record.corners is None else record.corners @ turn,
    )


def _turned(source: str, up_axis: str) -> bool:
    if up_axis not in {"y", "z"}:
        raise MotionStyleError(f"{source}: up_axis is {up_axis!r}, expected y or z")
    return up_axis == "z"
