"""Features of a segment and of a pair of segments (specification §4, §5).

Shapes: 7 degrees of freedom of a leg, 25 samples of a leg segment, 175 = 25·7 its vector;
K = 6 postures of a whole-body segment, 9 numbers each: three centres of mass times x, y, z.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from motionstyle.body.kinematics import forward_kinematics, points_in_world
from motionstyle.body.layout import COORDINATE_INDEX, NODES
from motionstyle.errors import MotionStyleError
from motionstyle.motion.motion import Motion
from motionstyle.similarity.alignment import SIDE_OF_SET, Segment

Array = NDArray[np.float64]
SAMPLES, LEG_DOF = 25, 7
LEG_DIMENSION = SAMPLES * LEG_DOF
POSTURES, PARTS = 6, ("upper_body", "left_leg", "right_leg")
WHOLE_BODY_DIMENSION = 18 * POSTURES
_LEG_NAMES = (
    *("hip_flexion", "hip_adduction", "hip_rotation", "knee_flexion"),
    *("ankle_dorsiflexion", "foot_inversion", "toes_extension"),
)
LEG_COORDINATES = {
    side: np.array([COORDINATE_INDEX[f"{name}_{side}"] for name in _LEG_NAMES]) for side in "lr"
}
_LEG_NODES = ("thigh", "shank", "foot", "toes")


def _part_weights() -> NDArray[np.bool_]:
    """Return which nodes (18) belong to each of the three parts, (3, 18)."""
    legs = {s: np.array([n in {f"{p}_{s}" for p in _LEG_NODES} for n in NODES]) for s in "lr"}
    return np.stack([~(legs["l"] | legs["r"]), legs["l"], legs["r"]])


PART_NODES = _part_weights()


def interpolation(frames: int, at: Array) -> Array:
    """Return the matrix W (len(at), frames) of cubic interpolation: values(at) = W values.

    `at` are places in frames, 0 to frames − 1. Segments of fewer than four frames are
    interpolated by the polynomial through all of them.
    """
    return np.asarray(CubicSpline(np.arange(frames), np.eye(frames), bc_type="not-a-knot")(at))


def to_samples(frames: int) -> Array:
    """Return the matrix (25, frames) that resamples a leg segment."""
    return interpolation(frames, np.linspace(0, frames - 1, SAMPLES))


def from_samples(frames: int) -> Array:
    """Return the matrix (frames, 25) that brings 25 samples back to a segment's own frames."""
    return interpolation(SAMPLES, np.linspace(0, SAMPLES - 1, frames))


def leg_vector(motion: Motion, segment: Segment) -> Array:
    """Return the 175 angles (rad) of a leg segment: 25 samples of each of 7 joints, joint by joint.

    Raises
    ------
    MotionStyleError
        If the segment is not one of a leg or lies outside the motion.
    """
    if segment.set not in SIDE_OF_SET:
        raise MotionStyleError(f"motion {motion.id}: a {segment.set} segment has no leg vector")
    _check_inside(motion, segment)
    columns = LEG_COORDINATES[SIDE_OF_SET[segment.set]]
    angles = motion.coordinates[segment.first : segment.last + 1, columns]
    return (to_samples(len(angles)) @ angles).T.ravel()


def _check_inside(motion: Motion, segment: Segment) -> None:
    if not 0 <= segment.first < segment.last < motion.frames:
        raise MotionStyleError(
            f"motion {motion.id}: segment {segment.first}–{segment.last} lies outside its "
            f"{motion.frames} frames"
        )


def posture_frames(first: int, last: int) -> NDArray[np.int64]:
    """Return K frames equally spaced over a segment, both ends included."""
    return np.round(np.linspace(first, last, POSTURES)).astype(int)


def part_centres(motion: Motion, frames: NDArray[np.int64]) -> tuple[Array, Array, Array]:
    """Return part centres of mass (F, 3, 3), body centre (F, 3) and pelvis forward axis (F, 3)."""
    pose = forward_kinematics(motion.body, motion.coordinates[frames])
    coms = points_in_world(pose, np.arange(len(NODES)), motion.body.coms)
    weights = PART_NODES * motion.body.masses
    parts = np.einsum("pn,fna->fpa", weights / weights.sum(axis=1, keepdims=True), coms)
    centre = np.einsum("n,fna->fa", motion.body.masses / motion.body.mass, coms)
    return parts, centre, pose.rotations[:, 0, :, 0]


def whole_body_vector(motion: Motion, segment: Segment) -> Array:
    """Return the 54 numbers of one motion's whole-body segment: K postures × 3 centres × 3.

    The character faces −x (left on paper) as judged from the pelvis in the middle of the segment;
    the origin lies below the body's centre of mass at the segment's first posture, on the ground
    of each posture. Lengths are divided by the leg's.

    Raises
    ------
    MotionStyleError
        If the segment lies outside the motion or its middle posture faces straight up or down.
    """
    _check_inside(motion, segment)
    frames = posture_frames(segment.first, segment.last)
    middle = (segment.first + segment.last) // 2
    parts, centre, forward = part_centres(motion, np.append(frames, middle))
    heading = forward[-1] * [1, 0, 1]
    size = np.linalg.norm(heading)
    if size < 1e-3:
        raise MotionStyleError(
            f"motion {motion.id}: at frame {middle} the pelvis faces straight up or down, so its "
            "heading is unknown; leave this clip out of `similarity`"
        )
    c, s = -heading[0] / size, -heading[2] / size
    # turns `heading` into −x about the vertical
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    origin = np.tile(centre[0], (len(frames), 1))
    origin[:, 1] = support_heights(motion, frames)
    local = (parts[:-1] - origin[:, None]) @ turn.T / motion.body.leg_length
    return local.ravel()


def support_heights(motion: Motion, frames: NDArray[np.int64]) -> Array:
    """Return the height (m) of the ground under the body at frames (F,), 0 on a level floor.

    On steps the adapted motion says it itself, smoothly from foothold to foothold, so that a walk
    up or down is described as above its own ground.
    """
    heights = motion.provenance.get("support_height_m")
    return np.zeros(len(frames)) if heights is None else np.asarray(heights, float)[frames]


def pair_vector(first: Array, second: Array) -> Array:
    """Return the features of a pair: both halves one after the other.

    Whole body: posture by posture, as in the paper's 18K-vector (9 numbers of each motion).
    Legs: 15 components of the first, then 15 of the second.
    """
    if first.shape != second.shape:
        raise MotionStyleError("the two halves of a pair must have as many numbers")
    if len(first) == WHOLE_BODY_DIMENSION // 2:
        halves = np.stack([first.reshape(POSTURES, 9), second.reshape(POSTURES, 9)], axis=1)
        return halves.reshape(-1)
    return np.concatenate([first, second])
