"""Net joint moments of a motion by inverse dynamics: Liu et al. 2005, eqs. (10), (11).

Forces on the feet are the motion's own contact forces, or wrenches that force plates measured.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, make_lsq_spline

from motionstyle.body.kinematics import MOVES_WITH, coordinate_axes
from motionstyle.body.layout import (
    COORDINATE_INDEX,
    COORDINATE_NODE,
    JOINT_SLICES,
    NODE_INDEX,
)
from motionstyle.dynamics.codegen import FrameFunction
from motionstyle.dynamics.symbols import parameter_vector
from motionstyle.motion.motion import Motion
from motionstyle.motion.opensim_export import (
    BALL_JOINTS,
    HINGES,
    PELVIS,
    TRANSLATIONS,
    cardan_axes,
    need_forces,
)

Array = NDArray[np.float64]
FINEST_KNOT = 2  # frames; coarser splines whose knots are some of these are held as well
HELD_TO = 1e-5  # m or rad


@dataclass(frozen=True)
class Wrench:
    """A force (F, 3), N, on a node and its moment about the world's origin (F, 3), N·m."""

    node: str
    force: Array
    moment: Array


@dataclass(frozen=True)
class JointLoads:
    """What the joints have to supply.

    moments : N·m by OpenSim's coordinate, (F,) each: hip_flexion_r, knee_angle_r, ankle_angle_r
    and so on, positive in the direction in which the coordinate grows.
    root_force, root_moment : what is left at the pelvis, in the world, (F, 3), N and N·m about
    the pelvis' joint centre; near zero in a physical motion.
    """

    moments: Mapping[str, Array]
    root_force: Array
    root_moment: Array

    def columns(self) -> dict[str, Array]:
        """Return the moments and the root's share by the names OpenSim's tool gives them."""
        rest = dict(zip(TRANSLATIONS, self.root_force.T, strict=True))
        return {f"{n}_force": v for n, v in rest.items()} | {
            f"{n}_moment": v for n, v in self.moments.items()
        }


def spline_rates(motion: Motion) -> tuple[Array, Array, Array]:
    """Return q, q̇, q̈ of a motion, (F, 35) each.

    Physical motions are samples of cubic splines with a knot every few frames; where such a
    spline holds the frames, its derivatives are exact. Others are joined by the cubic spline
    through all frames.
    """
    q, places = motion.coordinates, np.arange(motion.frames)
    spline = CubicSpline(places, q, axis=0)
    if motion.frames > 4 * FINEST_KNOT:
        end = -(-places[-1] // FINEST_KNOT) * FINEST_KNOT
        inner = np.arange(FINEST_KNOT, end, FINEST_KNOT)
        knots = np.concatenate([np.zeros(4), inner, np.full(4, end)])
        fitted = make_lsq_spline(places, q, knots, k=3)
        if np.abs(fitted(places) - q).max() < HELD_TO:
            spline = fitted
    rate = motion.rate_hz
    return q, rate * spline(places, 1), rate**2 * spline(places, 2)


def joint_loads(
    motion: Motion,
    functions: Mapping[str, FrameFunction],
    wrenches: Sequence[Wrench] | None = None,
) -> JointLoads:
    """Return net joint moments.

    Parameters
    ----------
    functions : from `dynamics.codegen.load_functions`.
    wrenches : measured loads that take the place of the motion's contact forces.

    Raises
    ------
    MotionStyleError
        If there are neither contact forces nor wrenches.
    """
    if wrenches is None:
        need_forces(motion)
        contacts = motion.contact_forces.reshape(motion.frames, -1)
    else:
        contacts = np.zeros((motion.frames, 24))
    q, qd, qdd = spline_rates(motion)
    tau = functions["forces"](q, qd, qdd, contacts, parameter_vector(motion.body))[0]
    pose = motion.pose()
    axes = coordinate_axes(pose, motion.coordinates)
    origins = pose.positions[:, COORDINATE_NODE]
    for wrench in wrenches or ():
        about = wrench.moment[:, None] - np.cross(origins, wrench.force[:, None])
        power = np.einsum("fca,fca->fc", axes, about)
        power[:, :3] = wrench.force
        tau -= power * MOVES_WITH[NODE_INDEX[wrench.node]]

    def vector(node: str) -> Array:
        """Return the moment (F, 3) in the world whose shares along a ball joint's axes are τ."""
        block = slice(3, 6) if node == "pelvis" else JOINT_SLICES[NODE_INDEX[node]]
        return np.linalg.solve(axes[:, block], tau[:, block, None])[..., 0]

    moments: dict[str, Array] = {}
    for joint in (PELVIS, *BALL_JOINTS):
        shares = np.einsum("fka,fa->kf", cardan_axes(pose, joint), vector(joint.node))
        moments.update(zip(joint.names, shares, strict=True))
    moments |= {theirs: tau[:, COORDINATE_INDEX[ours]] for theirs, ours in HINGES.items()}
    return JointLoads(moments, tau[:, :3], vector("pelvis"))
