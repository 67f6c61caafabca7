"""From motions to features and back (style_machines.md A1 and §11).

Training sees joint angles alone: scaled by how much they move the body and projected on a few
principal components. Synthesis works on full poses: scaled joint angles and the root in the
heading frame (height, tilt, forward and lateral velocity, yaw rate), integrated afterwards.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.body import Body
from motionstyle.body.kinematics import (
    coordinate_axes,
    forward_kinematics,
    point_jacobian,
    points_in_world,
)
from motionstyle.body.layout import COORDINATES, JOINT_COORDINATES, NODES
from motionstyle.body.rotations import exponential, logarithm, unroll
from motionstyle.errors import MotionStyleError
from motionstyle.motion.motion import Motion

Array = NDArray[np.float64]
ROOT_CHANNELS = ("height_m", "tilt_x", "tilt_y", "tilt_z", "forward_mps", "right_mps", "yaw_radps")
CHANNELS = (*COORDINATES[JOINT_COORDINATES], *ROOT_CHANNELS)
JOINTS_COUNT = len(CHANNELS) - len(ROOT_CHANNELS)
LEAST_SCALE = 1e-3  # m/rad; a coordinate that moves nothing still counts a little
STILL_M = 1e-9
SCALE_FRAMES = 40  # per motion, enough for a mean over poses


def joint_scales(motions: Sequence[Motion]) -> Array:
    """Return rms ‖∂p/∂q_j‖ over frames and segments' centres, weighted by mass, (29,), m/rad.

    How far the body moves with an angle, in the spirit of Gleicher 1997; A1.3.
    """
    total, weight = np.zeros(JOINTS_COUNT), 0
    columns = np.arange(len(COORDINATES))[JOINT_COORDINATES]
    for motion in motions:
        every = max(1, motion.frames // SCALE_FRAMES)
        q = motion.coordinates[::every]
        pose = forward_kinematics(motion.body, q)
        nodes = np.arange(len(NODES))
        points = points_in_world(pose, nodes, motion.body.coms)
        jacobian = point_jacobian(pose, coordinate_axes(pose, q), nodes, points, columns)
        share = motion.body.masses / motion.body.mass
        total += np.einsum("p,fpac->c", share, jacobian**2)
        weight += len(q)
    return np.maximum(np.sqrt(total / weight), LEAST_SCALE)


@dataclass(frozen=True)
class FeatureSpace:
    """How joint angles become training features.

    Attributes
    ----------
    scales : (29,), m/rad. mean : of the scaled angles, (29,). basis : principal directions,
    (29, d), orthonormal. shares : variance explained by each of all components, (29,).
    own_mean : whether each sequence keeps its mean pose in its features (posture is then part of
    style) or loses it, as in the paper.
    """

    scales: Array
    mean: Array
    basis: Array
    shares: Array
    own_mean: bool

    def features(self, motion: Motion) -> Array:
        """Return the training features (F, d) of a motion."""
        scaled = motion.coordinates[:, JOINT_COORDINATES] * self.scales
        centre = self.mean if self.own_mean else scaled.mean(axis=0)
        return (scaled - centre) @ self.basis


def learn_features(motions: Sequence[Motion], dimensions: int, *, own_mean: bool) -> FeatureSpace:
    """Return the feature space of some motions.

    The principal components are those of the poses less each sequence's mean (paper §4.1); where
    `own_mean`, the sequences' means count as well, each as its sequence.

    Raises
    ------
    MotionStyleError
        If there is no motion, or more dimensions are asked for than the motions move in.
    """
    if not motions:
        raise MotionStyleError("no motion to learn features from")
    scales = joint_scales(motions)
    scaled = [m.coordinates[:, JOINT_COORDINATES] * scales for m in motions]
    mean = np.concatenate(scaled).mean(axis=0)
    rows = [s - s.mean(axis=0) for s in scaled]
    if own_mean:
        rows = [s - mean for s in scaled]
    centred = np.concatenate(rows)
    _, sizes, directions = np.linalg.svd(centred, full_matrices=False)
    live = int((sizes > max(1e-9 * sizes[0], STILL_M)).sum())
    if live < dimensions:
        raise MotionStyleError(
            f"{dimensions} feature dimensions are asked for, but the joints of "
            f"{', '.join(m.id for m in motions[:3])}{' …' if len(motions) > 3 else ''} move in "
            f"{live} only: lower 'dimensions' in config/style_machines.yaml"
        )
    basis = directions[:dimensions].T
    basis = basis * np.where(basis[np.abs(basis).argmax(axis=0), np.arange(dimensions)] < 0, -1, 1)
    return FeatureSpace(scales, mean, basis, sizes**2 / (sizes**2).sum(), own_mean)


def yaw_of(rotations: Array) -> Array:
    """Return the heading of the pelvis, continuous in time, (F,), rad about +y."""
    forward = rotations[:, :, 0]
    return np.unwrap(np.arctan2(-forward[:, 2], forward[:, 0]))


def pose_channels(motion: Motion) -> Array:
    """Return joint angles and the root in the heading frame, (F, 36), see `CHANNELS`.

    Velocities are backward differences, so that integration undoes them exactly; the first
    frame's are the second's.
    """
    rotations = exponential(motion.coordinates[:, 3:6])
    yaw = yaw_of(rotations)
    turn = exponential(np.outer(yaw, [0.0, 1.0, 0.0]))
    tilt = logarithm(np.swapaxes(turn, 1, 2) @ rotations)
    rate = motion.rate_hz
    if motion.frames > 1:
        step = np.diff(motion.coordinates[:, :3], axis=0) * rate
        local = np.einsum("fba,fb->fa", turn[1:], step)
        local = np.concatenate([local[:1], local])
        spin = np.diff(yaw) * rate
        spin = np.concatenate([spin[:1], spin])
    else:
        local, spin = np.zeros((1, 3)), np.zeros(1)
    root = np.column_stack([motion.coordinates[:, 1], tilt, local[:, 0], local[:, 2], spin])
    return np.concatenate([motion.coordinates[:, JOINT_COORDINATES], root], axis=1)


def coordinates_of(channels: Array, rate_hz: float) -> tuple[Array, tuple[int, ...]]:
    """Return the body's 35 coordinates of pose channels (F, 36), and re-branched frames.

    The pelvis starts at x = z = 0 and faces +x.
    """
    frames = len(channels)
    root = channels[:, JOINTS_COUNT:]
    yaw = np.concatenate([[0.0], np.cumsum(root[1:, 6]) / rate_hz])
    turn = exponential(np.outer(yaw, [0.0, 1.0, 0.0]))
    local = np.column_stack([root[:, 4], np.zeros(frames), root[:, 5]])
    steps = np.einsum("fab,fb->fa", turn, local) / rate_hz
    place = np.concatenate([np.zeros((1, 3)), np.cumsum(steps[1:], axis=0)])
    place[:, 1] = root[:, 0]
    rotation, jumps = unroll(logarithm(turn @ exponential(root[:, 1:4])))
    joints = channels[:, :JOINTS_COUNT]
    return np.concatenate([place, rotation, joints], axis=1), tuple(jumps)


def mean_body(motions: Sequence[Motion]) -> Body:
    """Return the body of the motion whose leg length is the median one."""
    order = np.argsort([m.body.leg_length for m in motions], kind="stable")
    return motions[int(order[len(order) // 2])].body
