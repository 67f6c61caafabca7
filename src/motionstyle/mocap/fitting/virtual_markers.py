"""Virtual markers: points on a source skeleton that the body is fitted to.

Joint centres, and three points around each node that turn with its source joint; and, once
contacts are known, markers that hold the feet to the ground.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.body import Body
from motionstyle.body.kinematics import forward_kinematics, points_in_world
from motionstyle.body.layout import CONTACT_POINT_NODES, CONTACT_POINTS, NODE_INDEX, NODES
from motionstyle.mocap.fitting.body_fit import NodeFrames
from motionstyle.mocap.fitting.floor import runs

Array = NDArray[np.float64]

MARKER_ARM = 0.10  # m, from the joint centre to each orientation marker
# How much an orientation marker weighs against a joint centre. Thigh and upper arm: joint centres
# fix their direction, only the twist is left to the markers. Shank and forearm have none: their
# direction is fixed too, and their own twist is no coordinate of the body.
ORIENTATION_WEIGHT = {
    "pelvis": 0.5,
    "abdomen": 0.3,
    "thorax": 0.5,
    "head": 0.5,
    "thigh": 0.2,
    "foot": 0.3,
    "toes": 0.3,
    "upper_arm": 0.2,
}
GROUND_WEIGHT, SLIP_WEIGHT = 2.0, 0.5  # of a bearing foot point, against a joint centre
RAMP_S = 0.08  # s over which the hold on a stance fades in and out


@dataclass(frozen=True)
class VirtualMarkers:
    """M markers: names, the node each is fixed to, where on it (m), its path and weights.

    world and weights are (F, M, 3): a marker may weigh differently in time and direction.
    """

    names: tuple[str, ...]
    nodes: NDArray[np.int64]
    local: Array
    world: Array
    weights: Array

    def chosen(self, keep: NDArray[np.bool_]) -> VirtualMarkers:
        """Return the markers where `keep` (M,) is true."""
        return VirtualMarkers(
            tuple(n for n, k in zip(self.names, keep, strict=True) if k),
            self.nodes[keep],
            self.local[keep],
            self.world[:, keep],
            self.weights[:, keep],
        )

    def joined(self, other: VirtualMarkers) -> VirtualMarkers:
        """Return the markers of both sets."""
        return VirtualMarkers(
            self.names + other.names,
            np.concatenate([self.nodes, other.nodes]),
            np.concatenate([self.local, other.local]),
            np.concatenate([self.world, other.world], axis=1),
            np.concatenate([self.weights, other.weights], axis=1),
        )


def place_markers(frames: NodeFrames, body: Body, observed_nodes: set[str]) -> VirtualMarkers:
    """Return the virtual markers of a clip: joint centres and orientation points."""
    names, nodes, local, world, weights = [], [], [], [], []

    def add(name: str, node: str, offset: Array, path: Array, weight: float) -> None:
        names.append(name)
        nodes.append(NODE_INDEX[node])
        local.append(offset)
        world.append(path)
        weights.append(weight)

    for node in NODES:
        if node not in observed_nodes:
            continue
        centre = frames.positions[node]
        add(f"{node} centre", node, np.zeros(3), centre, 1.0)
        weight = ORIENTATION_WEIGHT.get(node.removesuffix("_r").removesuffix("_l"), 0.0)
        if weight:
            for axis, letter in zip(np.eye(3), "xyz", strict=True):
                outward = -1.0 if letter == "z" and node.endswith("_l") else 1.0
                arm = outward * MARKER_ARM * axis
                path = centre + frames.rotations[node] @ arm
                add(f"{node} {letter}", node, arm, path, weight)
    for side in "rl":
        wrist = frames.ends.get(f"wrist_{side}")
        if f"hand_{side}" not in observed_nodes and wrist is not None:
            add(f"wrist_{side}", f"hand_{side}", np.zeros(3), wrist, 1.0)
    paths = np.stack(world, axis=1)
    return VirtualMarkers(
        tuple(names),
        np.array(nodes),
        np.array(local),
        paths,
        np.broadcast_to(np.array(weights)[:, None], paths.shape),
    )


def ground_markers(
    body: Body, points: Array, contacts: NDArray[np.bool_], ground: Array, rate_hz: float
) -> VirtualMarkers:
    """Return markers that hold bearing foot points in place and lift sunken ones to the ground.

    Parameters
    ----------
    points : world positions of the 8 contact points, (F, 8, 3).
    contacts, ground : which bear, and the height (m) of the ground under each, (F, 8).

    A stance's hold fades in and out over RAMP_S so that no joint jerks at its ends.
    """
    target, weights = np.array(points), np.zeros_like(points)
    ramp = max(1.0, RAMP_S * rate_hz)
    for p in range(points.shape[1]):
        for first, last in runs(contacts[:, p]):
            stance = slice(first, last + 1)
            frames = np.arange(first, last + 1)
            # a stance cut off by the clip's end does not fade there
            into = frames - first + 1 if first > 0 else np.full(len(frames), np.inf)
            out = last - frames + 1 if last < len(points) - 1 else np.full(len(frames), np.inf)
            hold = np.clip(np.minimum(into, out) / ramp, 0.0, 1.0)
            place = np.average(points[stance, p][:, [0, 2]], axis=0, weights=hold)
            target[stance, p, 0], target[stance, p, 2] = place
            target[stance, p, 1] = ground[stance, p]
            weights[stance, p] = hold[:, None] * [SLIP_WEIGHT, GROUND_WEIGHT, SLIP_WEIGHT]
    sunken = points[..., 1] < ground
    target[..., 1] = np.where(sunken, ground, target[..., 1])
    weights[..., 1] = np.where(sunken, GROUND_WEIGHT, weights[..., 1])
    return VirtualMarkers(
        tuple(f"ground {name}" for name in CONTACT_POINTS),
        np.array(CONTACT_POINT_NODES),
        body.geometry.contact_points,
        target,
        weights,
    )


def marker_distances(body: Body, markers: VirtualMarkers, coordinates: Array) -> Array:
    """Return each marker's distance from its place on the fitted body, (F, M), m."""
    pose = forward_kinematics(body, coordinates)
    points = points_in_world(pose, markers.nodes, markers.local)
    return np.linalg.norm(points - markers.world, axis=-1)
