"""Fitting the body's 35 coordinates to virtual markers on the source skeleton.

Markers, not angles: joint centres, tips, and three points around each node that turn with the
source joint. Each frame is a damped Gauss–Newton problem in 35 unknowns; all frames of a chunk
are solved at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from motionstyle.body.body import Body
from motionstyle.body.kinematics import (
    MOVES_WITH,
    Pose,
    contact_points,
    coordinate_axes,
    forward_kinematics,
    point_jacobian,
    points_in_world,
)
from motionstyle.body.layout import (
    CONTACT_POINTS,
    COORDINATE_INDEX,
    COORDINATES,
    EXPONENTIAL_BLOCKS,
    HINGE_COLUMNS,
    JOINT_SLICES,
    JOINTS,
    NODE_INDEX,
    NODES,
    PARENTS,
)
from motionstyle.body.rotations import logarithm, unroll
from motionstyle.mocap.fitting.body_fit import NodeFrames
from motionstyle.mocap.fitting.virtual_markers import VirtualMarkers, ground_markers
from motionstyle.motion.resample import lowpass

Array = NDArray[np.float64]

LEG_COORDINATES = (
    "hip_flexion",
    "hip_adduction",
    "hip_rotation",
    "knee_flexion",
    "ankle_dorsiflexion",
    "foot_inversion",
)
PRIOR_WEIGHT = 0.01  # m per rad, towards the angles copied from the source
CHUNK = 256  # frames solved at once; bounds memory


def copied_angles(frames: NodeFrames, observed: NDArray[np.bool_]) -> Array:
    """Return coordinates (F, 35) read off the node frames' relative rotations, as a start.

    Rotations a joint cannot make are dropped; unobserved coordinates are zero.
    """
    count = len(frames.positions["pelvis"])
    coordinates = np.zeros((count, len(COORDINATES)))
    coordinates[:, :3] = frames.positions["pelvis"]
    rotation = dict(frames.rotations)
    for i, (joint, block) in enumerate(zip(JOINTS, JOINT_SLICES, strict=True)):
        parent = NODES[PARENTS[i]] if PARENTS[i] >= 0 else None
        if joint.node not in rotation:
            rotation[joint.node] = rotation[parent]
        if not joint.names:
            continue
        turned = rotation[joint.node]
        if parent is None:
            coordinates[:, 3:6] = logarithm(turned)
            continue
        relative = np.einsum("fba,fbc->fac", rotation[parent], turned)
        axes = np.array(joint.axes)
        if joint.kind == "exponential":
            coordinates[:, block] = logarithm(relative) @ axes.T
        else:
            coordinates[:, block] = _hinge_angles(relative, axes)
    coordinates[:, ~observed] = 0.0
    return coordinates


def _hinge_angles(relative: Array, axes: Array) -> Array:
    """Return the angles (F, 1 or 2) about hinge axes that come first in an Euler sequence."""
    letters = [int(np.argmax(np.abs(a))) for a in axes]
    signs = [float(a[k]) for a, k in zip(axes, letters, strict=True)]
    rest = [k for k in (2, 0, 1) if k not in letters]
    sequence = "".join("XYZ"[k] for k in [*letters, *rest])
    angles = Rotation.from_matrix(relative).as_euler(sequence)
    return np.unwrap(angles[:, : len(axes)], axis=0) * signs


def fit_coordinates(
    body: Body,
    markers: VirtualMarkers,
    start: Array,
    free: NDArray[np.bool_],
    *,
    iterations: int = 12,
    tolerance: float = 1e-5,
) -> Array:
    """Fit coordinates (F, 35) to marker paths by damped Gauss–Newton, starting at `start`.

    Minimises Σ w‖marker − path‖² + prior towards `start`, frame by frame; coordinates that are
    not `free` stay as they are. A frame is done when no coordinate moves by more than
    `tolerance` (rad, m).
    """
    columns = np.flatnonzero(free)
    touched = MOVES_WITH[markers.nodes][:, columns].any(axis=1)
    markers = markers.chosen(touched)
    chunks = [
        _fit_chunk(
            body, markers, start, columns, slice(first, first + CHUNK), iterations, tolerance
        )
        for first in range(0, len(start), CHUNK)
    ]
    return np.concatenate(chunks)


def _fit_chunk(
    body: Body,
    markers: VirtualMarkers,
    start: Array,
    columns: NDArray[np.int64],
    frames: slice,
    iterations: int,
    tolerance: float,
) -> Array:
    target, prior = markers.world[frames], start[frames]
    root_weights = np.sqrt(markers.weights[frames])
    prior_weights = np.where(columns >= 3, PRIOR_WEIGHT**2, 0.0)
    diagonal = np.arange(len(columns))
    q = np.array(prior)

    def evaluate(coordinates: Array, rows: NDArray[np.int64]) -> tuple[Pose, Array, Array, Array]:
        pose = forward_kinematics(body, coordinates)
        points = points_in_world(pose, markers.nodes, markers.local)
        residuals = (points - target[rows]) * root_weights[rows]
        away = (coordinates - prior[rows])[:, columns]
        cost = (residuals**2).sum(axis=(1, 2)) + (prior_weights * away**2).sum(axis=1)
        return pose, points, residuals, cost

    active = np.arange(len(q))
    best = evaluate(q, active)[3]
    damping = np.full(len(q), 1e-6)
    for _ in range(iterations):
        pose, points, residuals, _cost = evaluate(q[active], active)
        axes = coordinate_axes(pose, q[active])
        jacobian = point_jacobian(pose, axes, markers.nodes, points, columns)
        jacobian *= root_weights[active][:, :, :, None]
        jacobian = jacobian.reshape(len(active), -1, len(columns))
        transposed = np.swapaxes(jacobian, 1, 2)
        away = (q[active] - prior[active])[:, columns]
        gradient = (transposed @ residuals.reshape(len(active), -1, 1))[..., 0]
        gradient += prior_weights * away
        hessian = transposed @ jacobian
        hessian[:, diagonal, diagonal] += prior_weights + damping[active][:, None]
        step = np.linalg.solve(hessian, -gradient[..., None])[..., 0]
        trial = np.array(q[active])
        trial[:, columns] += step
        trial_cost = evaluate(trial, active)[3]
        better = trial_cost <= best[active]
        taken, refused = active[better], active[~better]
        q[taken], best[taken] = trial[better], trial_cost[better]
        damping[taken] = np.maximum(damping[taken] * 0.3, 1e-8)
        damping[refused] = np.maximum(damping[refused] * 30, 1e-4)
        active = active[(np.abs(step).max(axis=1) > tolerance) & (damping[active] < 1e3)]
        if not len(active):
            break
    return _within_half_a_turn(q, columns)


def _within_half_a_turn(coordinates: Array, columns: NDArray[np.int64]) -> Array:
    """Return coordinates of whose columns the hinges turn by at most half a turn.

    Frames are fitted one by one, and a few of them a whole turn away from their neighbours.
    """
    result, hinges = np.array(coordinates), np.intersect1d(columns, HINGE_COLUMNS)
    result[:, hinges] -= 2 * np.pi * np.round(result[:, hinges] / (2 * np.pi))
    return result


def fit_legs_to_ground(
    body: Body,
    markers: VirtualMarkers,
    coordinates: Array,
    contacts: NDArray[np.bool_],
    ground: Array,
    rate_hz: float,
    cutoff_hz: float,
) -> Array:
    """Refit the legs so that bearing points stay where they bear and none sinks into the ground.

    The pelvis and all above it keep their coordinates. The hold on a stance comes and goes, so
    the legs are filtered once more at 1.5 times the cut-off; toes are lifted clear throughout.
    """
    free = np.array([name.rsplit("_", 1)[0] in LEG_COORDINATES for name in COORDINATES])
    toes = np.array([name.startswith("toes_") for name in COORDINATES])

    def clear(legs: Array) -> Array:
        """Lift the toes from where the markers put them: a straight tip would push the foot up."""
        return lift_toes(body, np.where(toes, coordinates, legs), ground)

    result = coordinates
    for _ in range(2):
        result = clear(result)
        points = contact_points(body, forward_kinematics(body, result))
        held = markers.joined(ground_markers(body, points, contacts, ground, rate_hz))
        result = fit_coordinates(body, held, result, free, iterations=5)
    free |= toes
    result = clear(result)
    continuous, _jumps = make_continuous(result)
    result[:, free] = lowpass(continuous[:, free], rate_hz, 1.5 * cutoff_hz)
    return result


def lift_toes(body: Body, coordinates: Array, ground: Array) -> Array:
    """Extend the toes as far as keeps their tips above the ground (F, 8), at most 75°.

    Sources show the toes badly or not at all; at push-off the ball bears and the toes lie flat.
    """
    result = np.array(coordinates)
    pose = forward_kinematics(body, result)
    for side in "rl":
        column = COORDINATE_INDEX[f"toes_extension_{side}"]
        node = NODE_INDEX[f"toes_{side}"]
        tip = CONTACT_POINTS.index(f"toe_{side}")
        length, drop = body.geometry.contact_points[tip][0], -body.geometry.contact_points[tip][1]
        clearance = pose.positions[:, node, 1] - ground[:, tip]
        pitch = np.arcsin(np.clip(pose.rotations[:, node, 1, 0], -1.0, 1.0))
        # the tip's height is clearance + length·sin(pitch) − drop·cos(pitch)
        reach = np.hypot(length, drop)
        least = np.arctan2(drop, length) - np.arcsin(np.clip(clearance / reach, -1.0, 1.0))
        lift = np.maximum(least - pitch, 0.0)
        result[:, column] = np.minimum(
            result[:, column] + lift, np.maximum(np.radians(75), result[:, column])
        )
    return result


def make_continuous(coordinates: Array) -> tuple[Array, tuple[int, ...]]:
    """Return coordinates whose angles are continuous in time, and frames of re-branched maps.

    A joint would spin between two branches once its angles are filtered.
    """
    result, hinges = np.array(coordinates), list(HINGE_COLUMNS)
    result[:, hinges] = np.unwrap(coordinates[:, hinges], axis=0)
    jumps: set[int] = set()
    for block in EXPONENTIAL_BLOCKS:
        result[:, block], found = unroll(coordinates[:, block])
        jumps.update(found)
    return result, tuple(sorted(jumps))
