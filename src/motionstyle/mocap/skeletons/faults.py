"""Faults of single frames: flips, jumps and frozen stretches, and the repair of flips."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from motionstyle.mocap.fitting.floor import runs
from motionstyle.mocap.formats.clip import SkeletonClip, forward_kinematics

FLIP = np.radians(120.0)
RETURN = np.radians(60.0)
FROZEN_S = 0.25
_SAME = 1e-7


@dataclass(frozen=True)
class ClipWarning:
    """Something about a clip that a reader of the results should know.

    Attributes
    ----------
    kind : `flip`, `jump`, `frozen`, `lying` or `repaired`.
    message : in words.
    frames : the frames concerned, counted from 0; empty for the whole clip.
    """

    kind: str
    message: str
    frames: tuple[int, ...]


def find_flips(clip: SkeletonClip) -> list[tuple[int, int]]:
    """Return (frame, joint) of single-frame flips.

    A joint flips in a frame if its world rotation differs by more than 120 degrees from both
    neighbours, which differ by less than 60 degrees from each other. Of a chain that flips
    together only the first joint is returned.
    """
    if clip.frames < 3:
        return []
    step, across = _turns(clip, 1), _turns(clip, 2)
    flips = (step[:-1] > FLIP) & (step[1:] > FLIP) & (across < RETURN)
    return [(frame + 1, joint) for frame, joint in _tops(clip, flips)]


def find_jumps(clip: SkeletonClip, flips: Sequence[tuple[int, int]]) -> list[ClipWarning]:
    """Return, per joint, a warning of turns by more than 120 degrees in one step.

    Steps into and out of the single-frame `flips` are left out, as are joints that only
    follow their parent.
    """
    jumps = _turns(clip, 1) > FLIP
    for frame, joint in flips:
        jumps[frame - 1 : frame + 1, _branch(clip, joint)] = False
    found: dict[int, list[int]] = {}
    for step, joint in _tops(clip, jumps):
        found.setdefault(joint, []).append(step + 1)
    return [
        ClipWarning(
            "jump",
            f"joint '{clip.joints[joint]}' turns by more than 120 degrees in one step, "
            f"into frames {frame_list(np.array(frames))}",
            tuple(frames),
        )
        for joint, frames in sorted(found.items())
    ]


def find_frozen(clip: SkeletonClip) -> list[tuple[int, int]]:
    """Return (first, last) frames of stretches of 0.25 s or more with one and the same pose."""
    if clip.frames < 2:
        return []
    moved = np.abs(np.diff(clip.positions, axis=0)).max(axis=(1, 2))
    turned = np.abs(np.diff(clip.rotations, axis=0)).max(axis=(1, 2, 3))
    still = (moved < _SAME) & (turned < _SAME)
    long = FROZEN_S * clip.rate_hz - 1e-9
    return [(first, last + 1) for first, last in runs(still) if last - first + 1 >= long]


def repair_flips(clip: SkeletonClip, flips: Sequence[tuple[int, int]]) -> SkeletonClip:
    """Return the clip with flipped joints turned halfway between the frames around them.

    Rotations against the parent are interpolated along the shortest arc, of the joint and of
    all below it: some of these undo the flip in the file, others follow it. Two flips of one
    joint are never adjacent, as the frames around each agree.
    """
    parents, child = clip.parents, clip.parents >= 0
    above = clip.rotations[:, parents]
    above[:, ~child] = np.eye(3)
    local = np.swapaxes(above, -1, -2) @ clip.rotations
    offsets = clip.positions.copy()
    offsets[:, child] -= clip.positions[:, parents[child]]
    offsets = np.einsum("fjba,fjb->fja", above, offsets)
    for frame, joint in flips:
        for at in _branch(clip, joint):
            around = Rotation.from_matrix(local[[frame - 1, frame + 1], at])
            local[frame, at] = Slerp([0.0, 1.0], around)(0.5).as_matrix()
    positions, rotations = clip.positions.copy(), clip.rotations.copy()
    touched = sorted({frame for frame, _ in flips})
    positions[touched], rotations[touched] = forward_kinematics(
        parents, offsets[touched], local[touched]
    )
    return replace(clip, positions=positions, rotations=rotations)


def frame_list(frames: NDArray[np.int64]) -> str:
    """Write frame numbers for a message: the first six and how many more."""
    shown = ", ".join(str(frame) for frame in frames[:6])
    return shown if len(frames) <= 6 else f"{shown} and {len(frames) - 6} more"


def _turns(clip: SkeletonClip, step: int) -> NDArray[np.float64]:
    """Return the angle between rotations `step` frames apart, rad, (F - step, J)."""
    if clip.frames <= step:
        return np.zeros((0, len(clip.joints)))
    trace = np.einsum("fjab,fjab->fj", clip.rotations[step:], clip.rotations[:-step])
    return np.arccos(np.clip((trace - 1.0) / 2.0, -1.0, 1.0))


def _tops(clip: SkeletonClip, flagged: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return flagged (row, joint) whose parent is not flagged in that row."""
    above = flagged[:, clip.parents] & (clip.parents >= 0)
    return [(int(row), int(joint)) for row, joint in np.argwhere(flagged & ~above)]


def _branch(clip: SkeletonClip, joint: int) -> list[int]:
    """Return a joint and everything below it."""
    branch = {joint}
    for at, parent in enumerate(clip.parents):
        if int(parent) in branch:
            branch.add(at)
    return sorted(branch)
