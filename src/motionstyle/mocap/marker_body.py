"""One person's body and the places of markers on it, from a static trial or the clip itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.anthropometry import (
    BALL_FRACTION,
    REFERENCE_LENGTHS,
    TRUNK_LENGTHS,
    Sex,
)
from motionstyle.body.body import BodyGeometry
from motionstyle.body.layout import CONTACT_POINTS, NODE_INDEX
from motionstyle.body.rotations import exponential
from motionstyle.errors import MotionStyleError
from motionstyle.mocap.body_fit import NodeFrames, foot_length, measure_body
from motionstyle.mocap.floor import StanceThresholds
from motionstyle.mocap.marker_clip import MarkerClip
from motionstyle.mocap.marker_joints import (
    across,
    arm_joints,
    frame,
    hip_centres,
    leg_joints,
    pelvis_frame,
    unit,
)
from motionstyle.mocap.markerset import NEEDED_TO_MEASURE, Assigned, MarkerSet

Array = NDArray[np.float64]
UP = np.array([0.0, 1.0, 0.0])
FEWEST_FRAMES = 3
# Proportions of ours where a set lacks the landmark: the neck's joint lies ahead of the C7 marker
# and above mid-acromion; the ball's middle lies inward of and ahead of the fifth metatarsal.
NECK_AHEAD_OF_C7, NECK_ABOVE_ACROMIA = 0.05, 0.03
BALL_INWARD, BALL_AHEAD = 0.17, 0.04  # of foot length
MARKER_ABOVE_BALL = 0.015  # m, of a marker on top of or beside a metatarsal head
LONGEST_TOES = 1.2  # without a marker at their tip, against those of a foot that fits the legs
MARKER_BEHIND_HEEL, SHORTEST_HEEL = 0.01, 0.02  # m, of a marker's centre; and behind the ankle
SHOULDER_HALF_WIDTH = 0.18  # m on a leg of 0.86 m
ARM_OF_LEG = {"upper_arm": 0.2817 / 0.8625, "forearm": 0.2689 / 0.8625}  # de Leva, male


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
        offset = np.einsum("fba,fb->fa", frames.rotations[node], away)
        if np.isfinite(offset).all(axis=1).any():
            offsets[label] = np.nanmedian(offset, axis=0)
    forward = frames.rotations["pelvis"][:, 1, 0]
    return MarkerBody(
        geometry=geometry,
        offsets=offsets,
        nodes={label: assigned.nodes[label] for label in offsets},
        pelvis_pitch=-float(np.arcsin(np.clip(forward, -1, 1)).mean()),
        source=clip.source,
        frames=int(whole.sum()),
    )


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
    _trunk(points, position, rotation, leg, sex)
    for side in "rl":
        _arm(points, position, rotation, leg, side)
    rotation["head"] = _head(points, rotation["thorax"])
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


def _upright(pelvis: Array) -> Array:
    """Return frames that share the pelvis' heading but stand upright, (F, 3, 3)."""
    right = unit(pelvis[..., 2] * [1, 0, 1])
    up = np.broadcast_to(UP, right.shape)
    return frame(np.cross(up, right), up, right)


def _trunk(
    points: dict[str, Array],
    position: dict[str, Array],
    rotation: dict[str, Array],
    leg: float,
    sex: Sex,
) -> None:
    """Add abdomen and thorax, cut at de Leva's proportions between mid-hip and neck."""
    lower, middle, upper = TRUNK_LENGTHS[sex]
    whole = lower + middle + upper
    mid_hip = position["pelvis"]
    upright = _upright(rotation["pelvis"])
    if "acromion_r" in points and "acromion_l" in points:
        acromia = (points["acromion_r"] + points["acromion_l"]) / 2
        right = points["acromion_r"] - points["acromion_l"]
        top = points.get("c7", acromia)
        up = unit(top - mid_hip)
        ahead = np.cross(up, across(right, up))
        neck = top + (NECK_AHEAD_OF_C7 * ahead if "c7" in points else NECK_ABOVE_ACROMIA * up)
        up = unit(neck - mid_hip)
        right = across(right, up)
        rotation["thorax"] = frame(np.cross(up, right), up, right)
    else:
        reference = REFERENCE_LENGTHS[sex]
        neck = mid_hip + whole * leg / (reference["thigh"] + reference["shank"]) * UP
        rotation["thorax"] = upright
    rotation["abdomen"] = rotation["thorax"]
    position["abdomen"] = mid_hip + lower / whole * (neck - mid_hip)
    position["thorax"] = mid_hip + (lower + middle) / whole * (neck - mid_hip)
    position["head"] = neck


def _arm(
    points: dict[str, Array],
    position: dict[str, Array],
    rotation: dict[str, Array],
    leg: float,
    side: str,
) -> None:
    """Add one arm; a limb without markers hangs from the shoulder with de Leva's lengths."""
    thorax, sign = rotation["thorax"], 1.0 if side == "r" else -1.0
    scale = leg / 0.8625
    elbow = wrist = axis = None
    if "acromion_r" in points and "acromion_l" in points:
        shoulder, elbow, wrist, axis = arm_joints(points, thorax, side, leg)
    else:
        down = np.array([0.0, -0.05 * scale, sign * SHOULDER_HALF_WIDTH * scale])
        shoulder = position["head"] + thorax @ down
    if elbow is None or wrist is None or axis is None:
        hanging = thorax[..., 1]
        axis = thorax[..., 2]
        elbow = shoulder - ARM_OF_LEG["upper_arm"] * leg * hanging
        wrist = elbow - ARM_OF_LEG["forearm"] * leg * hanging
    upper, lower = unit(shoulder - elbow), unit(elbow - wrist)
    hinge = across(axis, lower)
    position |= {f"upper_arm_{side}": shoulder, f"forearm_{side}": elbow, f"hand_{side}": wrist}
    rotation[f"upper_arm_{side}"] = frame(np.cross(upper, axis), upper, axis)
    rotation[f"forearm_{side}"] = frame(np.cross(lower, hinge), lower, hinge)
    rotation[f"hand_{side}"] = rotation[f"forearm_{side}"]


def _head(points: dict[str, Array], thorax: Array) -> Array:
    """Return the head's frame: rigid with its markers, upright and ahead on average."""
    if "head_front_r" not in points or "head_front_l" not in points:
        return thorax
    right = unit(points["head_front_r"] - points["head_front_l"])
    front = (points["head_front_r"] + points["head_front_l"]) / 2
    if "head_back_r" in points and "head_back_l" in points:
        back = (points["head_back_r"] + points["head_back_l"]) / 2
        ahead = across(front - back, right)
    elif "head_top" in points:
        ahead = np.cross(across(points["head_top"] - front, right), right)
    else:
        return thorax
    rough = frame(ahead, np.cross(right, ahead), right)
    nod = np.median(np.arcsin(np.clip(ahead[:, 1], -1, 1)))
    return rough @ exponential(np.array([0.0, 0.0, -nod]))
