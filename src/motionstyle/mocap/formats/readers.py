"""`read_clip`: the reader that fits a file's suffix."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from motionstyle.errors import MotionStyleError
from motionstyle.mocap.formats.asf_amc import find_asf, read_asf_amc
from motionstyle.mocap.formats.bvh import read_bvh
from motionstyle.mocap.formats.clip import SkeletonClip
from motionstyle.mocap.formats.deepmimic import read_deepmimic

_SUPPORTED = ".bvh, .amc (with an .asf), .txt and .json (DeepMimic, with a .urdf)"


def read_clip(
    path: str | Path,
    *,
    skeleton_file: str | Path | None = None,
    rate_hz: float | None = None,
    cycles: int = 1,
) -> SkeletonClip:
    """Read a motion file by its suffix: .bvh, .amc, or DeepMimic's .txt and .json.

    Parameters
    ----------
    path : the file.
    skeleton_file : for .amc the ASF file, found beside the motion if not given (`find_asf`);
        for DeepMimic the URDF file, needed.
    rate_hz : frames per second. For .bvh it replaces the rate of the file, whose header may be
        wrong, without resampling; for .amc, which has none, the default is 120; a DeepMimic
        clip is resampled to it.
    cycles : how often a wrapping DeepMimic clip is run through; 1 for all others.

    Returns
    -------
    SkeletonClip
        In the units of the file: see the reader of each format.

    Raises
    ------
    MotionStyleError
        For an unknown suffix, an option that does not fit the format, and whatever the readers
        refuse.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in (".bvh", ".amc", ".txt", ".json"):
        kind = f"suffix '{path.suffix}'" if path.suffix else "no suffix"
        raise MotionStyleError(f"{path}: {kind}; supported are {_SUPPORTED}")
    if rate_hz is not None and not (np.isfinite(rate_hz) and rate_hz > 0):
        raise MotionStyleError(f"{path}: rate_hz is {rate_hz}, expected frames per second above 0")
    if suffix in (".txt", ".json"):
        if skeleton_file is None:
            raise MotionStyleError(f"{path}: a DeepMimic clip needs a skeleton_file, its .urdf")
        return read_deepmimic(path, skeleton_file, rate_hz=rate_hz, cycles=cycles)
    if cycles != 1:
        raise MotionStyleError(
            f"{path}: cycles is {cycles!r}; only DeepMimic clips can be repeated, expected 1"
        )
    if suffix == ".amc":
        asf = find_asf(path) if skeleton_file is None else skeleton_file
        return read_asf_amc(path, asf, 120.0 if rate_hz is None else float(rate_hz))
    if skeleton_file is not None:
        raise MotionStyleError(f"{path}: a BVH file holds its skeleton; skeleton_file is not used")
    clip = read_bvh(path)
    return clip if rate_hz is None else replace(clip, rate_hz=float(rate_hz))
