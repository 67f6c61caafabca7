"""One person's body and the places of markers on it, from a static trial or the clip itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.anthropometry import (
    BALL_FRACTION,
    Sex,
)
from motionstyle.body.body import BodyGeometry
from motionstyle.body.layout import CONTACT_POINTS, NODE_INDEX, NODES, PARENTS
from motionstyle.errors import MotionStyleError
from motionstyle.mocap.fitting.body_fit import NodeFrames, foot_length, measure_body
from motionstyle.mocap.fitting.floor import StanceThresholds
from motionstyle.mocap.formats.marker_clip import MarkerClip
from motionstyle.mocap.markers.joints import (
    across,
    arm_joints,
    frame,
    hip_centres,
    leg_joints,
    pelvis_frame,
    unit,
)
from motionstyle.mocap.markers.markerset import NEEDED_TO_MEASURE, Assigned, MarkerSet
from motionstyle.mocap.markers.upper_body import add_arm, add_trunk, head_frames

Array = NDArray[np.float64]
UP = np.array([0.0, 1.0, 0.0])
FEWEST_FRAMES = 3
# Where a set lacks the inner marker, the ball's middle lies inward of and ahead of the fifth
# metatarsal's head (proportions of ours).
BALL_INWARD, BALL_AHEAD = 0.17, 0.04  # of foot length
MARKER_ABOVE_BALL = 0.015  # m, of a marker on top of or beside a metatarsal head
LONGEST_TOES = 1.2  # without a marker at their tip, against those of a foot that fits the legs
MARKER_BEHIND_HEEL, SHORTEST_HEEL = 0.01, 0.02  # m, of a marker's centre; and behind the ankle


@dataclass(frozen=True)
class MarkerBody:
    """A body and where markers sit on it.

    Attributes
    ----------
    geometry : lengths, see `BodyGeometry`.
    offsets : each marker's place in its node's frame, (3,), m, by label.
    nodes : the node of each of these markers.
    pelvis_pitch : mean forward tilt of the pelvis' frame while it was measured, rad; the trunk of
        a set without trunk markers stays upright against it.
    source, frames : the file and how many frames of it were used.
    """

    geometry: BodyGeometry
    offsets: Mapping[str, Array]
    nodes: Mapping[str, str]
    pelvis_pitch: float
    source: str
    frames: int


def measure_markers(
    clip: MarkerClip,
    assigned: Assigned,
    markers: MarkerSet,
    sex: Sex,
    thresholds: StanceThresholds,
    support: Array | None = None,
) -> MarkerBody:
    """Measure a body from markers (m, y up).

    Lengths and marker places are medians over the frames in which every landmark is seen. Soles
    are the floor y = 0 under flat feet.

    Parameters
    ----------
    support : height of the surface under the lower foot per frame, (F,), m; the floor if None.

    Raises
    ------
    MotionStyleError
        If landmarks that measuring needs are missing, or never seen together.
    """
    _check_measurable(clip, assigned, markers)
    paths = {name: clip.path(label) for name, label in assigned.landmarks.items()}
    whole = np.all([np.isfinite(p).all(axis=1) for p in paths.values()], axis=0)
    if whole.sum() < FEWEST_FRAMES:
        worst = sorted(paths, key=lambda name: np.isfinite(paths[name]).all(axis=1).sum())[:3]
        named = ", ".join(f"'{assigned.landmarks[name]}'" for name in worst)
        raise MotionStyleError(
            f"{clip.source}: all landmarks are seen together in {int(whole.sum())} of "
            f"{clip.frames} frames, expected at least {FEWEST_FRAMES}; most often missing: {named}"
        )
    drop = np.zeros((clip.frames, 1)) if support is None else support[:, None]
    shift = (drop * UP)[whole]
    points = {name: path[whole] - shift for name, path in paths.items()}
    positions = clip.positions[whole] - shift[:, None]
    frames = _node_frames(points, positions, clip, assigned, sex)
    geometry, frames = measure_body(frames, sex, clip.rate_hz, thresholds)
    geometry = _measured_feet(geometry, frames, points)
    offsets = {}
    for label, node in assigned.nodes.items():
        away = positions[:, clip.labels.index(label)] - frames.positions[node]
        place = _in_frame(frames.rotations[node], away)
        if np.isfinite(place).all():
            offsets[label] = place
    forward = frames.rotations["pelvis"][:, 1, 0]
    return MarkerBody(
        geometry=geometry,
        offsets=offsets,
        nodes={label: assigned.nodes[label] for label in offsets},
        pelvis_pitch=-float(np.arcsin(np.clip(forward, -1, 1)).mean()),
        source=clip.source,
        frames=int(whole.sum()),
    )


def with_trunk_of(
    person: MarkerBody, clip: MarkerClip, assigned: Assigned, leg: float, sex: Sex
) -> MarkerBody:
    """Return the body with the trunk that the clip itself shows, if it shows the acromia.

    Arms held up in a static trial lift the acromia by centimetres, and a trunk too long for the
    clip would buckle. Upright is then the clip's median line from mid-hip to neck.
    """
    paths = {name: clip.path(label) for name, label in assigned.landmarks.items()}
    if "acromion_r" not in paths or "acromion_l" not in paths:
        return person
    needed = [n for n in paths if n.startswith(("asis", "psis", "sacrum", "acromion", "c7"))]
    seen = np.all([np.isfinite(paths[n]).all(axis=1) for n in needed], axis=0)
    if seen.sum() < FEWEST_FRAMES:
        return person
    points = {name: path[seen] for name, path in paths.items()}
    position = {"pelvis": sum(hip_centres(points).values()) / 2}
    rotation = {"pelvis": pelvis_frame(points)}
    add_trunk(points, position, rotation, leg, sex)
    thorax = rotation["thorax"]
    for side in "rl":
        position[f"upper_arm_{side}"] = arm_joints(points, thorax, side, leg)[0]
    joints = np.array(person.geometry.joint_offsets)
    for node in ("abdomen", "thorax", "head", "upper_arm_r", "upper_arm_l"):
        parent = NODES[PARENTS[NODE_INDEX[node]]]
        away = position[node] - position[parent]
        joints[NODE_INDEX[node]] = _in_frame(rotation[parent], away)
    offsets = dict(person.offsets)
    for label, node in assigned.nodes.items():
        if node == "thorax":
            place = _in_frame(thorax, clip.path(label)[seen] - position["thorax"])
            if np.isfinite(place).all():
                offsets[label] = place
    geometry = replace(person.geometry, joint_offsets=joints)
    return replace(person, geometry=geometry, offsets=offsets)


def _in_frame(rotation: Array, away: Array) -> Array:
    """Return the median of vectors (F, 3) in moving frames (F, 3, 3), frames without one apart."""
    local = np.einsum("fba,fb->fa", rotation, away)
    local = local[np.isfinite(local).all(axis=1)]
    return np.median(local, axis=0) if len(local) else np.full(3, np.nan)


def _check_measurable(clip: MarkerClip, assigned: Assigned, markers: MarkerSet) -> None:
    missing = []
    for (landmark,) in NEEDED_TO_MEASURE:
        side = landmark[-1]
        enough = all(
            sum(node == f"{n}_{side}" for node in assigned.nodes.values()) >= count
            for n, count in (("thigh", 3), ("shank", 3), ("foot", 2))
        )
        if landmark not in assigned.landmarks and not enough:
            labels = " or ".join(f"'{x}'" for x in markers.landmarks.get(landmark, ())) or "?"
            missing.append(f"{labels} ({landmark})")
    if missing:
        raise MotionStyleError(
            f"{clip.source}: the body cannot be measured without the needed marker "
            f"{', '.join(missing)}; give a static trial that has them (column static of the "
            "sheet), or clusters of three markers on thigh and shank"
        )


def _node_frames(
    points: dict[str, Array],
    positions: Array,
    clip: MarkerClip,
    assigned: Assigned,
    sex: Sex,
) -> NodeFrames:
    """Return the frames of all 18 nodes; those without markers take usual proportions."""
    position: dict[str, Array] = {}
    rotation: dict[str, Array] = {"pelvis": pelvis_frame(points)}
    clusters = {
        node: positions[:, [clip.labels.index(x) for x, n in assigned.nodes.items() if n == node]]
        for node in set(assigned.nodes.values())
    }
    for side in "rl":  # the toes bend little against the foot: a third point for its cluster
        if f"toe_tip_{side}" in points:
            tip = points[f"toe_tip_{side}"][:, None]
            clusters[f"foot_{side}"] = np.concatenate([clusters[f"foot_{side}"], tip], axis=1)
    hips = hip_centres(points)
    position["pelvis"] = (hips["r"] + hips["l"]) / 2
    legs = []
    for side, hip in hips.items():
        knee, ankle, axis = leg_joints(points, clusters, hip, rotation["pelvis"][..., 2], side)
        thigh, shank = unit(hip - knee), unit(knee - ankle)
        position |= {f"thigh_{side}": hip, f"shank_{side}": knee, f"foot_{side}": ankle}
        rotation[f"thigh_{side}"] = frame(np.cross(thigh, axis), thigh, axis)
        hinge = across(axis, shank)
        rotation[f"shank_{side}"] = frame(np.cross(shank, hinge), shank, hinge)
        legs.append(
            np.median(np.linalg.norm(hip - knee, axis=1))
            + np.median(np.linalg.norm(knee - ankle, axis=1))
        )
    leg = float(np.mean(legs))
    for side in "rl":
        _foot(points, position, rotation, side, foot_length(leg, sex))
    add_trunk(points, position, rotation, leg, sex)
    for side in "rl":
        add_arm(points, position, rotation, leg, side)
    rotation["head"] = head_frames(points, rotation["thorax"])
    return NodeFrames(position, rotation, {})


def _foot(
    points: dict[str, Array],
    position: dict[str, Array],
    rotation: dict[str, Array],
    side: str,
    length: float,
) -> None:
    """Add the foot's rough frame (soles straighten it later) and the ball joint."""
    heel, ankle = points[f"heel_{side}"], position[f"foot_{side}"]
    outer, inner = points.get(f"mtp_lateral_{side}"), points.get(f"mtp_medial_{side}")
    top = points.get(f"toe_{side}")
    towards = next(p for p in (top, points.get(f"toe_tip_{side}"), inner, outer) if p is not None)
    if outer is not None and inner is not None:
        towards = (outer + inner) / 2
    forward = unit(towards - heel)
    up = across(ankle - heel, forward)
    right = np.cross(forward, up)
    sign = 1.0 if side == "r" else -1.0
    if outer is not None and inner is not None:
        ball = (outer + inner) / 2
    elif outer is not None:
        ball = outer + length * (BALL_AHEAD * forward - sign * BALL_INWARD * right)
    else:
        ball = (top if top is not None else inner) - MARKER_ABOVE_BALL * up
    position[f"toes_{side}"] = ball
    rotation[f"foot_{side}"] = rotation[f"toes_{side}"] = frame(forward, up, right)


def _measured_feet(
    geometry: BodyGeometry, frames: NodeFrames, points: dict[str, Array]
) -> BodyGeometry:
    """Return the geometry with heels and toes where their markers show them.

    Without a marker at its tip, a foot is as long as its ball lies at the usual fraction of it.
    """
    contact = np.array(geometry.contact_points)
    for side in "rl":
        foot, toes = f"foot_{side}", f"toes_{side}"
        heel, toe = (CONTACT_POINTS.index(f"{p}_{side}") for p in ("heel", "toe"))
        ball = geometry.joint_offsets[NODE_INDEX[toes], 0]
        marker = points[f"heel_{side}"] - frames.positions[foot]
        behind = np.median(np.einsum("fb,fb->f", frames.rotations[foot][..., 0], marker))
        contact[heel, 0] = min(behind + MARKER_BEHIND_HEEL, -SHORTEST_HEEL)
        behind_ball = ball - contact[heel, 0]
        usual = np.linalg.norm(contact[toe] * [1, 0, 0])  # of a foot that fits the legs
        contact[toe, 0] = min((1 / BALL_FRACTION - 1) * behind_ball, usual * LONGEST_TOES)
        if f"toe_tip_{side}" in points:
            marker = points[f"toe_tip_{side}"] - frames.positions[toes]
            ahead = np.median(np.einsum("fb,fb->f", frames.rotations[toes][..., 0], marker))
            contact[toe, 0] = max(ahead, 0.5 * contact[toe, 0])
    return replace(geometry, contact_points=contact)
