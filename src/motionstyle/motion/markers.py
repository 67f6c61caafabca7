"""Measured markers that go with a motion: where they sit on its body, and where they were seen."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from motionstyle.errors import MotionStyleError
from motionstyle.files import atomic_write
from motionstyle.motion.resample import lowpass

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MarkerPaths:
    """M markers on a body, in the motion's frame and from its first frame on.

    Attributes
    ----------
    names : labels, (M,). nodes : indices into `layout.NODES`, (M,).
    local : place on the node, (M, 3), m.
    measured : paths as read, gaps bridged, (F, M, 3), m. smooth : low-passed as for the fit.
    weights : 0 where a marker was not seen, else how much it tells of its bone, (F, M).
    rate_hz : frames per second.
    """

    names: tuple[str, ...]
    nodes: NDArray[np.int64]
    local: Array
    measured: Array
    smooth: Array
    weights: Array
    rate_hz: float

    def at(self, rate_hz: float, start_s: float, frames: int) -> MarkerPaths:
        """Return the paths at `frames` frames of another rate, from `start_s` on.

        Going down in rate, paths are low-passed first as motions are; a frame beside one in which
        a marker was not seen tells nothing of it.
        """
        old = np.arange(len(self.smooth)) / self.rate_hz
        new = np.minimum(start_s + np.arange(frames) / rate_hz, old[-1])
        cutoff = 0.4 * rate_hz if rate_hz < self.rate_hz else np.inf
        smooth = make_interp_spline(old, lowpass(self.smooth, self.rate_hz, cutoff), k=3)(new)
        measured = make_interp_spline(old, self.measured, k=1)(new)
        place = new * self.rate_hz
        below = np.floor(place + 1e-6).astype(int)
        above = np.minimum(np.ceil(place - 1e-6).astype(int), len(old) - 1)
        weights = np.minimum(self.weights[below], self.weights[above])
        return MarkerPaths(
            self.names, self.nodes, self.local, measured, smooth, weights, float(rate_hz)
        )


def save_markers(path: str | Path, markers: MarkerPaths | None) -> None:
    """Write markers, or that there are none, as .npz."""
    arrays: dict[str, Array] = {"present": np.array(markers is not None)}
    if markers is not None:
        for name in ("nodes", "local", "measured", "smooth", "weights"):
            arrays[name] = getattr(markers, name)
        arrays |= {"names": np.array(markers.names), "rate_hz": np.array(markers.rate_hz)}
    with atomic_write(path, "wb") as handle:
        np.savez_compressed(handle, **arrays)


def load_markers(path: str | Path) -> MarkerPaths | None:
    """Read markers; None where the clip has none.

    Raises
    ------
    MotionStyleError
        If the file is not what `save_markers` writes.
    """
    try:
        with np.load(path, allow_pickle=False) as data:
            if not data["present"]:
                return None
            arrays = (data[n] for n in ("nodes", "local", "measured", "smooth", "weights"))
            names = tuple(str(n) for n in data["names"])
            return MarkerPaths(names, *arrays, rate_hz=float(data["rate_hz"]))
    except (OSError, ValueError, KeyError, EOFError) as error:
        raise MotionStyleError(
            f"{path}: not a readable file of markers ({error}); delete it and run Snakemake again"
        ) from error
