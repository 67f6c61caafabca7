"""The terms of an adaptation that know nothing of style: C, Q, smoothness and weak pulls (§7).

Unknowns of one frame are y (20): six pelvis coordinates and seven angles of each leg.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from motionstyle.body.layout import COORDINATES, NODES
from motionstyle.dynamics.inverse import GRAVITY
from motionstyle.similarity.blocks import Block, block_function
from motionstyle.similarity.features import LEG_COORDINATES
from motionstyle.similarity.footholds import Example, Footholds
from motionstyle.similarity.symbolic_body import symbolic_pose

Array = NDArray[np.float64]
MOVED = np.concatenate([np.arange(6), LEG_COORDINATES["l"], LEG_COORDINATES["r"]])
FIXED = np.setdiff1d(np.arange(len(COORDINATES)), MOVED)
WIDTH = len(MOVED)
CLEARANCE_M = 0.002


def full_coordinates(y: ca.SX, fixed: ca.SX) -> ca.SX:
    """Return all 35 coordinates from the moved (20) and the fixed ones (15)."""
    q = ca.SX.zeros(len(COORDINATES))
    q[MOVED.tolist()] = y
    q[FIXED.tolist()] = fixed
    return q


def roots_of_weights(settings: Mapping[str, Any]) -> tuple[float, float, float]:
    """Return √w_p, √w_c and √w_q: what residuals are multiplied by."""
    return tuple(
        float(np.sqrt(settings[f"{name}_weight"])) for name in ("style", "contact", "physics")
    )


def frame_block(
    example: Example, holds: Footholds, settings: Mapping[str, Any], marked: NDArray[np.bool_]
) -> Block:
    """Return C, the pull of the pelvis to its start, balance at marked frames, and clearance."""
    motion, frames = example.motion, example.motion.frames
    _, contact, physics = roots_of_weights(settings)
    y, p = ca.SX.sym("y", WIDTH), ca.SX.sym("p", len(FIXED) + 24 + 8 + 6 + 3)
    fixed, targets, on, pelvis, balance = ca.vertsplit(
        p, np.cumsum([0, len(FIXED), 24, 8, 6, 3]).tolist()
    )
    pose = symbolic_pose(motion.body, full_coordinates(y, fixed))
    misses = (ca.vec(pose.points) - targets) / settings["contact_m"]
    misses *= ca.vec(ca.repmat(on.T, 3, 1)) * contact
    pull = y[:6] - pelvis
    weights = ca.DM(motion.body.masses / motion.body.mass)
    centre = pose.coms @ weights
    lean = balance[2] * (centre[[0, 2]] - balance[:2]) / settings["balance_m"] * physics
    residuals = ca.vertcat(
        misses, pull[:3] / settings["pelvis_m"], pull[3:] / settings["pelvis_rad"], lean
    )
    clearance = (pose.points[1, :] - holds.surface.symbolic(pose.points)).T
    parameters = np.hstack(
        [
            motion.coordinates[:, FIXED],
            holds.targets.reshape(frames, 24),
            holds.bearing.astype(float),
            holds.pelvis,
            holds.centres[:, [0, 2]],
            marked[:, None].astype(float),
        ]
    )
    function = block_function("frame", y, p, residuals, clearance)
    index = np.arange(frames * WIDTH).reshape(frames, WIDTH)
    lower = np.full((frames, 8), -CLEARANCE_M)
    upper = np.full((frames, 8), np.inf)
    return Block("contact", function, index, parameters, lower, upper)


def smooth_block(example: Example, holds: Footholds, settings: Mapping[str, Any]) -> Block:
    """Return how the second difference of each moved coordinate departs from the start's.

    It keeps what no other term sees smooth, and equal velocities at segment borders (C1).
    """
    frames = example.motion.frames
    z, p = ca.SX.sym("z", 3 * WIDTH), ca.SX.sym("p", WIDTH)
    bend = z[:WIDTH] - 2 * z[WIDTH : 2 * WIDTH] + z[2 * WIDTH :] - p
    unit = np.concatenate([np.full(3, settings["smooth_m"]), np.full(17, settings["smooth_rad"])])
    function = block_function("smooth", z, p, bend / unit, ca.SX(0, 1))
    begin = initial_frames(example, holds)
    parameters = begin[:-2] - 2 * begin[1:-1] + begin[2:]
    index = np.arange(frames * WIDTH).reshape(frames, WIDTH)
    index = np.hstack([index[:-2], index[1:-1], index[2:]])
    empty = np.zeros((frames - 2, 0))
    return Block("smoothness", function, index, parameters, empty, empty)


def torque_block(example: Example, holds: Footholds, settings: Mapping[str, Any]) -> Block:
    """Return Q₁: the horizontal moment about the centre of support beyond m g · half a foot.

    Segments count as point masses at their centres; in flight the moment is about the body's
    centre of mass and without gravity.
    """
    body, frames = example.motion.body, example.motion.frames
    physics = roots_of_weights(settings)[2]
    z = ca.SX.sym("z", 3 * WIDTH)
    p = ca.SX.sym("p", 3 * len(FIXED) + 4)
    parts = ca.vertsplit(p, [0, *(len(FIXED) * k for k in (1, 2, 3)), 3 * len(FIXED) + 4])
    poses = [
        symbolic_pose(body, full_coordinates(z[k * WIDTH : (k + 1) * WIDTH], parts[k])).coms
        for k in range(3)
    ]
    rate = example.motion.rate_hz
    acceleration = (poses[0] - 2 * poses[1] + poses[2]) * rate**2
    support, flight = parts[3][:3], parts[3][3]
    centre = poses[1] @ ca.DM(body.masses / body.mass)
    about = flight * centre + (1 - flight) * support
    total = ca.SX.zeros(3)
    for i in range(len(NODES)):
        load = acceleration[:, i] + (1 - flight) * ca.DM([0, GRAVITY, 0])
        total += body.masses[i] * ca.cross(poses[1][:, i] - about, load)
    points = body.geometry.contact_points
    foot = abs(points[0, 0] - (body.joint_offsets[NODES.index("toes_r"), 0] + points[3, 0]))
    largest = body.mass * GRAVITY * foot / 2
    # the hinge max(0, ‖τ‖ − τ_max) as a vector along τ, rounded over a quarter of τ_max, so that
    # Gauss and Newton's Hessian holds on both sides of the kink
    level = total[[0, 2]] / largest
    size = ca.sqrt(ca.sumsqr(level) + 1e-4)
    excess = (size - 1 + ca.sqrt((size - 1) ** 2 + 0.06)) / 2
    residual = excess / size * level / settings["torque_share"] * physics
    function = block_function("torque", z, p, residual, ca.SX(0, 1))
    fixed = example.motion.coordinates[:, FIXED]
    parameters = np.hstack(
        [fixed[:-2], fixed[1:-1], fixed[2:], holds.centres[1:-1], holds.flight[1:-1, None]]
    )
    index = np.arange(frames * WIDTH).reshape(frames, WIDTH)
    index = np.hstack([index[:-2], index[1:-1], index[2:]])
    empty = np.zeros((frames - 2, 0))
    return Block("torque", function, index, parameters, empty, empty)


def initial_frames(example: Example, holds: Footholds) -> Array:
    """Return the start of the moved coordinates: the example's legs below the carried pelvis."""
    return np.hstack([holds.pelvis, example.motion.coordinates[:, MOVED[6:]]])


def component_block(
    starts: NDArray[np.int64], begin: Sequence[Array], settings: Mapping[str, Any]
) -> Block:
    """Return a weak pull of each component to the example's."""
    z, p = ca.SX.sym("z", 1), ca.SX.sym("p", 1)
    function = block_function("pull", z, p, (z - p) / settings["component"], ca.SX(0, 1))
    index = np.arange(starts[0], starts[-1])[:, None]
    empty = np.zeros((len(index), 0))
    return Block("components", function, index, np.concatenate(begin)[:, None], empty, empty)
