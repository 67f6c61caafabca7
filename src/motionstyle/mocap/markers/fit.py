"""Fitting a body to measured markers: targets, start, marker offsets once more, spine and arms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.body import Body
from motionstyle.body.kinematics import forward_kinematics
from motionstyle.body.layout import (
    COORDINATE_INDEX,
    COORDINATE_NODE,
    COORDINATES,
    NODE_INDEX,
    NODES,
)
from motionstyle.body.ranges import joint_ranges
from motionstyle.body.rotations import exponential, logarithm
from motionstyle.mocap.fitting.retarget import fit_coordinates, make_continuous
from motionstyle.mocap.fitting.virtual_markers import MARKER_ARM, ORIENTATION_WEIGHT, VirtualMarkers
from motionstyle.mocap.formats.marker_clip import MarkerClip
from motionstyle.mocap.markers.body import MarkerBody
from motionstyle.mocap.markers.joints import hip_centres, pelvis_frame
from motionstyle.mocap.markers.markerset import Assigned
from motionstyle.mocap.markers.paths import fill_gaps, smooth_paths

Array = NDArray[np.float64]
# What a marker weighs: on bone 1, on muscle or a limb the body cannot turn with, less.
CLUSTER_WEIGHT = 0.5
LANDMARK_WEIGHT = {"acromion": 0.5, "wrist_radius": 0.5, "wrist_ulna": 0.5, "finger": 0.2}
# How many markers show a node, at least; arms and legs need fewer as their joints add the rest.
ENOUGH = {"thorax": 3, "abdomen": 3, "head": 3}
BENT_ELBOW = np.radians(40)  # where a fit starts, so that it finds the side to which elbows bend
IMPOSSIBLE = np.radians(20)  # so far beyond a joint's range a frame is fitted anew


def observed_coordinates(assigned: Assigned) -> NDArray[np.bool_]:
    """Return which of the 35 coordinates the markers show.

    Trunk and head need three markers of their own, other nodes one (legs and arms are chains);
    an upper arm needs a marker beyond its shoulder, and the abdomen is seen through the thorax.
    """
    count = {node: list(assigned.nodes.values()).count(node) for node in NODES}
    count["abdomen"] = count["thorax"]
    for side in "rl":
        count[f"upper_arm_{side}"] += count[f"forearm_{side}"]
        if count["thorax"] < ENOUGH["thorax"]:
            count[f"upper_arm_{side}"] = count[f"forearm_{side}"] = 0
    shown = {node for node in NODES if count[node] >= ENOUGH.get(node, 1)}
    return np.array([NODES[node] in shown for node in COORDINATE_NODE])


def marker_targets(
    clip: MarkerClip, assigned: Assigned, person: MarkerBody, cutoff_hz: float
) -> tuple[Array, VirtualMarkers, NDArray[np.bool_]]:
    """Return raw paths (F, M, 3), markers with smooth paths, and where they were seen (F, M).

    A marker that the measured body does not place weighs nothing yet.
    """
    labels = tuple(assigned.nodes)
    paths, weights, seen = fill_gaps(clip, labels)
    role = {label: landmark.rsplit("_", 1)[0] for landmark, label in assigned.landmarks.items()}
    weigh = [LANDMARK_WEIGHT.get(role[x], 1.0) if x in role else CLUSTER_WEIGHT for x in labels]
    placed = np.array([label in person.offsets for label in labels])
    weights = weights * np.array(weigh) * placed
    markers = VirtualMarkers(
        names=labels,
        nodes=np.array([NODE_INDEX[assigned.nodes[label]] for label in labels]),
        local=np.array([person.offsets.get(label, np.zeros(3)) for label in labels]),
        world=smooth_paths(paths, seen, clip.rate_hz, cutoff_hz),
        weights=np.repeat(weights[..., None], 3, axis=2),
    )
    return paths, markers, seen


def fit_markers(
    body: Body,
    markers: VirtualMarkers,
    seen: NDArray[np.bool_],
    start: Array,
    observed: NDArray[np.bool_],
) -> tuple[Array, VirtualMarkers]:
    """Fit coordinates (F, 35); return them, and the markers with offsets of the clip's own.

    First with the offsets of the calibration, then with each marker's mean place on its node in
    this fit. The spine's two joints share the bend between pelvis and thorax, and frames whose
    arms bend the wrong way are fitted again from their neighbours.
    """
    q = fit_coordinates(body, markers, start, observed, iterations=60)
    spine = observed[COORDINATE_INDEX["thorax_flexion"]]
    for iterations in (40, 30):
        q = fit_coordinates(body, markers, reseeded(q, observed), observed, iterations=iterations)
        markers = with_own_offsets(body, markers, q, seen)
        held = markers.joined(_spine_markers(body, q)) if spine else markers
        q = fit_coordinates(body, held, q, observed, iterations=iterations)
    return q, markers


def start_coordinates(
    clip: MarkerClip, assigned: Assigned, person: MarkerBody, observed: NDArray[np.bool_]
) -> Array:
    """Return coordinates (F, 35) that follow the pelvis, with joints straight but for elbows.

    A trunk that no marker shows stays upright against the mean tilt of the pelvis.
    """
    labels = tuple(assigned.nodes)
    paths, _, _ = fill_gaps(clip, labels)
    points = {n: paths[:, labels.index(label)] for n, label in assigned.landmarks.items()}
    start = np.zeros((clip.frames, len(COORDINATES)))
    start[:, :3] = sum(hip_centres(points).values()) / 2
    start[:, 3:6] = logarithm(pelvis_frame(points))
    flexion = COORDINATE_INDEX["abdomen_flexion"]
    if not observed[flexion]:
        start[:, flexion] = -person.pelvis_pitch
    for side in "rl":
        elbow = COORDINATE_INDEX[f"elbow_flexion_{side}"]
        start[:, elbow] = BENT_ELBOW * observed[elbow]
    return make_continuous(start)[0]


def reseeded(coordinates: Array, observed: NDArray[np.bool_]) -> Array:
    """Return coordinates in which limbs of impossible frames follow the nearest possible ones.

    An arm is impossible where its elbow bends the wrong way or its shoulder turns by half a turn;
    a foot where it turns on the ankle beyond what ankles do, as few markers on it let it.
    """
    result, bounds = np.array(coordinates), joint_ranges()

    def within(column: int) -> NDArray[np.bool_]:
        low, high = bounds[column]
        angle = result[:, column]
        return (angle > low - IMPOSSIBLE) & (angle < high + IMPOSSIBLE)

    for side in "rl":
        elbow = COORDINATE_INDEX[f"elbow_flexion_{side}"]
        if observed[elbow]:
            arm = [
                i for i, n in enumerate(COORDINATES) if n.endswith(f"_{side}") and "shoulder" in n
            ]
            turns = np.linalg.norm(result[:, arm], axis=1)
            straight = np.zeros(len(arm) + 1)
            straight[-1] = BENT_ELBOW
            _follow(result, [*arm, elbow], within(elbow) & (turns < np.pi), straight)
        foot = [COORDINATE_INDEX[f"{n}_{side}"] for n in ("ankle_dorsiflexion", "foot_inversion")]
        if observed[foot].all():
            _follow(result, foot, within(foot[0]) & within(foot[1]), np.zeros(2))
    return result


def _follow(
    coordinates: Array, columns: list[int], good: NDArray[np.bool_], otherwise: Array
) -> None:
    """Set columns of frames that are not good as in the nearest good one, in place."""
    if good.all():
        return
    if not good.any():
        coordinates[:, columns] = otherwise
        return
    known = np.flatnonzero(good)
    wrong = np.flatnonzero(~good)
    nearest = known[np.abs(wrong[:, None] - known).argmin(axis=1)]
    coordinates[np.ix_(wrong, columns)] = coordinates[np.ix_(nearest, columns)]


def _spine_markers(body: Body, coordinates: Array) -> VirtualMarkers:
    """Return orientation markers that turn the abdomen half-way from the pelvis to the thorax.

    Markers on pelvis and thorax alone leave it open which of two joints bends.
    """
    pose = forward_kinematics(body, coordinates)
    pelvis, thorax, abdomen = (NODE_INDEX[n] for n in ("pelvis", "thorax", "abdomen"))
    turn = np.swapaxes(pose.rotations[:, pelvis], 1, 2) @ pose.rotations[:, thorax]
    half = pose.rotations[:, pelvis] @ exponential(logarithm(turn) / 2)
    arms = MARKER_ARM * np.eye(3)
    paths = pose.positions[:, abdomen, None] + np.einsum("fab,kb->fka", half, arms)
    return VirtualMarkers(
        names=tuple(f"abdomen {axis}" for axis in "xyz"),
        nodes=np.full(3, abdomen),
        local=arms,
        world=paths,
        weights=np.full(paths.shape, ORIENTATION_WEIGHT["abdomen"]),
    )


def with_own_offsets(
    body: Body, markers: VirtualMarkers, coordinates: Array, seen: NDArray[np.bool_]
) -> VirtualMarkers:
    """Return the markers moved on their nodes to where the fitted clip shows them on average.

    A marker that the calibration did not place gets its place and its weight here.
    """
    pose = forward_kinematics(body, coordinates)
    away = markers.world - pose.positions[:, markers.nodes]
    local = np.einsum("fmba,fmb->fma", pose.rotations[:, markers.nodes], away)
    local[~seen] = np.nan
    new = markers.weights.sum(axis=(0, 2)) == 0
    weights = np.where(new[:, None], CLUSTER_WEIGHT * seen[..., None], markers.weights)
    return replace(markers, local=np.nanmedian(local, axis=0), weights=weights)
