"""One person's body from a clip: node frames on the source joints, segment lengths, soles.

Every node gets a frame that is rigid with a source joint. In a "standing" zero pose it follows
from the bones' directions; otherwise from the axes the skeleton map names. The soles come from
the clip itself: while a foot stands flat, the floor is its sole.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.anthropometry import BALL_FRACTION, REFERENCE_LENGTHS, Sex
from motionstyle.body.body import BodyGeometry
from motionstyle.body.layout import CONTACT_POINTS, END_POINTS, NODE_INDEX, NODES
from motionstyle.body.rotations import shortest_arc
from motionstyle.mocap.fitting.floor import StanceThresholds, hysteresis, speed
from motionstyle.mocap.formats.clip import SkeletonClip
from motionstyle.mocap.skeletons.skeleton_map import SkeletonMap

Array = NDArray[np.float64]
DOWN = np.array([0.0, -1.0, 0.0])
HEEL_BEHIND_ANKLE = (0.15, 0.30)  # shortest and longest, as shares of foot length
FOOT_HALF_WIDTH = 0.17  # of foot length
HEIGHT_OF_ANKLE, HEIGHT_OF_BALL = 0.30, 0.10  # above the sole, of foot length, when unseen
LOWEST_BALL = 0.05  # a ball joint lies at least this far above the sole, of foot length
_NEXT = {"thigh": "shank", "shank": "foot", "upper_arm": "forearm", "forearm": "hand"}


@dataclass(frozen=True)
class NodeFrames:
    """World frames of the nodes the source shows: positions (F, 3) and rotations (F, 3, 3)."""

    positions: Mapping[str, Array]
    rotations: Mapping[str, Array]
    ends: Mapping[str, Array]


def _point(clip: SkeletonClip, skeleton: SkeletonMap, name: str, rest: Array) -> Array | None:
    """Return the zero-pose position of a mapped node or end, or None if it is not mapped."""
    joint = skeleton.joints.get(name) or skeleton.ends.get(name)
    return None if joint is None else rest[clip.joints.index(joint)]


def _standing_frames(clip: SkeletonClip, skeleton: SkeletonMap) -> dict[str, Array]:
    """Return each node's frame in the zero pose, a rotation matrix in the clip's world."""
    rest = clip.rest_positions()

    def at(name: str) -> Array | None:
        return _point(clip, skeleton, name, rest)

    right = at("thigh_r") - at("thigh_l")
    right = right * [1, 0, 1] / np.linalg.norm(right * [1, 0, 1])
    up = np.array([0.0, 1.0, 0.0])
    whole = np.column_stack([np.cross(up, right), up, right])
    frames = dict.fromkeys(NODES, whole)
    for side in "rl":
        for node in ("thigh", "shank", "upper_arm", "forearm"):
            before = {"shank": "thigh", "forearm": "upper_arm"}.get(node)
            base = frames[f"{before}_{side}"] if before else whole
            far = at(f"{_NEXT[node]}_{side}")
            if far is None and node == "forearm":
                far = at(f"wrist_{side}")
            bone = None if far is None else far - at(f"{node}_{side}")
            if bone is not None and np.linalg.norm(bone) > 1e-6:
                base = shortest_arc(base @ DOWN, bone) @ base
            frames[f"{node}_{side}"] = base
        frames[f"hand_{side}"] = frames[f"forearm_{side}"]
        front = next(
            (p for n in ("toes", "foot_front", "toe") if (p := at(f"{n}_{side}")) is not None), None
        )
        if front is not None:
            forward = (front - at(f"foot_{side}")) * [1, 0, 1]
            if np.linalg.norm(forward) > 1e-6:
                forward /= np.linalg.norm(forward)
                foot = np.column_stack([forward, up, np.cross(forward, up)])
                frames[f"foot_{side}"] = frames[f"toes_{side}"] = foot
    return frames


def node_frames(clip: SkeletonClip, skeleton: SkeletonMap) -> NodeFrames:
    """Return the nodes' frames over the clip (m, y up); the pelvis' origin is mid-hip."""
    index = {name: i for i, name in enumerate(clip.joints)}
    standing = _standing_frames(clip, skeleton) if skeleton.zero_pose == "standing" else {}
    positions, rotations = {}, {}
    for node, joint in skeleton.joints.items():
        local = skeleton.axes.get(node, standing.get(node))
        positions[node] = clip.positions[:, index[joint]]
        rotations[node] = clip.rotations[:, index[skeleton.frame_joint(node)]] @ local
    positions["pelvis"] = (positions["thigh_r"] + positions["thigh_l"]) / 2
    ends = {name: clip.positions[:, index[joint]] for name, joint in skeleton.ends.items()}
    frames = NodeFrames(positions, rotations, ends)
    for side in "rl":
        for upper, lower, towards in (("thigh", "shank", -1.0), ("upper_arm", "forearm", 1.0)):
            node = f"{upper}_{side}"
            rotations[node] = rotations[node] @ _hinge_twist(frames, upper, lower, side, towards)
    return frames


def _hinge_twist(frames: NodeFrames, upper: str, lower: str, side: str, towards: float) -> Array:
    """Return the fixed turn about a limb's long axis that makes its hinge bend about z.

    Functional calibration: a source's zero pose fixes the direction of a thigh or an upper arm
    but not its twist, so the twist is taken from the direction in which the clip bends the knee
    (backward) or the elbow (forward), weighted by how far it bends. A limb that hardly bends
    (below 10° on average) keeps its twist.
    """
    node = f"{upper}_{side}"
    start = frames.positions[f"{lower}_{side}"]
    stop = frames.positions.get(f"{_NEXT[lower]}_{side}", frames.ends.get(f"wrist_{side}"))
    if stop is None:
        return np.eye(3)
    bone = np.einsum("fba,fb->fa", frames.rotations[node], stop - start)
    bone /= np.linalg.norm(bone, axis=1, keepdims=True)
    sideways = (bone * [1, 0, 1]).mean(axis=0)
    if np.linalg.norm(sideways) < np.sin(np.radians(10)):
        return np.eye(3)
    forward = towards * sideways / np.linalg.norm(sideways)
    return np.column_stack([forward, -DOWN, np.cross(forward, -DOWN)])


def _in_frame(rotation: Array, origin: Array, point: Array) -> Array:
    """Return the mean position (3,) of a world point in a moving frame."""
    return np.einsum("fba,fb->fa", rotation, point - origin).mean(axis=0)


def foot_length(leg: float, sex: Sex) -> float:
    """Return heel-to-toe length (m) for a hip-to-ankle length, by de Leva's mean lengths."""
    reference = REFERENCE_LENGTHS[sex]
    return reference["foot"] / (reference["thigh"] + reference["shank"]) * leg


@dataclass(frozen=True)
class Sole:
    """A foot in the frame whose y axis is the sole's normal; metres.

    correction : turns the old foot frame into the new one. ankle_height, ball_height : above the
    sole. ball : the ball joint relative to the ankle. flat_frames : on how many frames it rests.
    """

    correction: Array
    ankle_height: float
    ball_height: float
    ball: Array
    flat_frames: int


def find_sole(
    frames: NodeFrames, side: str, length: float, rate_hz: float, thresholds: StanceThresholds
) -> Sole:
    """Find a foot's sole from the frames in which it stands flat on the floor y = 0.

    Where there are fewer than three such frames, ankle and ball are put at their usual heights.
    """
    ankle, rotation = frames.positions[f"foot_{side}"], frames.rotations[f"foot_{side}"]
    front = frames.positions.get(f"toes_{side}", frames.ends.get(f"foot_front_{side}"))
    flat = np.zeros(len(ankle), dtype=bool)
    if front is not None:
        flat = hysteresis(
            np.maximum(ankle[:, 1] - 0.6 * length, front[:, 1] - 0.3 * length),
            np.maximum(speed(ankle, rate_hz), speed(front, rate_hz)),
            thresholds,
            rate_hz,
        )
        if flat.any():  # of those, the frames with the lowest heel
            flat &= ankle[:, 1] <= np.quantile(ankle[flat, 1], 0.5) + 1e-9
    forward = np.array([1.0, 0.0, 0.0])
    if front is not None:
        forward = _in_frame(rotation, ankle, front)
    if flat.sum() >= 3:
        up = np.median(np.einsum("fba,b->fa", rotation[flat], -DOWN), axis=0)
        ankle_height = float(np.median(ankle[flat, 1]))
        ball_height = float(np.median(front[flat, 1]))
    else:
        drop = (HEIGHT_OF_ANKLE - HEIGHT_OF_BALL) * length
        reach = np.linalg.norm(forward)
        pitch = np.arcsin(np.clip(drop / reach, -0.9, 0.9))
        along = forward / reach
        side_axis = np.cross(along, -DOWN)
        side_axis /= np.linalg.norm(side_axis)
        up = np.cos(pitch) * np.cross(side_axis, along) - np.sin(pitch) * along
        ankle_height, ball_height = HEIGHT_OF_ANKLE * length, HEIGHT_OF_BALL * length
    up /= np.linalg.norm(up)
    forward = forward - forward @ up * up
    forward /= np.linalg.norm(forward)
    correction = np.column_stack([forward, up, np.cross(forward, up)])
    ankle_height = float(np.clip(ankle_height, 0.12 * length, 0.55 * length))
    ball_height = float(np.clip(ball_height, LOWEST_BALL * length, 0.25 * length))
    ball = np.zeros(3)
    if f"toes_{side}" in frames.positions:
        ball = correction.T @ _in_frame(rotation, ankle, frames.positions[f"toes_{side}"])
    return Sole(correction, ankle_height, ball_height, ball, int(flat.sum()))


def measure_body(
    frames: NodeFrames, sex: Sex, rate_hz: float, thresholds: StanceThresholds
) -> tuple[BodyGeometry, NodeFrames]:
    """Return the clip's body and the node frames with feet turned flat on their soles.

    Lengths are means over the clip; head, hands and toes that the source lacks take de Leva's
    proportions, scaled by leg length. Floor at y = 0, all in metres.
    """
    reference = REFERENCE_LENGTHS[sex]
    offsets = np.zeros((len(NODES), 3))
    points: dict[str, Array] = {}
    position, rotation = dict(frames.positions), dict(frames.rotations)

    def put(node: str, parent: str) -> None:
        offsets[NODE_INDEX[node]] = _in_frame(rotation[parent], position[parent], position[node])

    put("abdomen", "pelvis")
    if "thorax" not in position:
        rotation["thorax"] = rotation["abdomen"]
        position["thorax"] = position["abdomen"] + 0.45 * (position["head"] - position["abdomen"])
    put("thorax", "abdomen")
    put("head", "thorax")
    legs = []
    for side in "rl":
        put(f"thigh_{side}", "pelvis")
        put(f"upper_arm_{side}", "thorax")
        for node in ("thigh", "shank", "upper_arm", "forearm"):
            start = position[f"{node}_{side}"]
            stop = position.get(f"{_NEXT[node]}_{side}", frames.ends.get(f"wrist_{side}"))
            if stop is None:
                length = 0.95 * abs(offsets[NODE_INDEX[f"forearm_{side}"], 1])
            else:
                length = float(np.linalg.norm(stop - start, axis=1).mean())
            offsets[NODE_INDEX[f"{_NEXT[node]}_{side}"]] = length * DOWN
        legs.append(sum(-offsets[NODE_INDEX[f"{n}_{side}"], 1] for n in ("shank", "foot")))
    leg = float(np.mean(legs))
    scale = leg / (reference["thigh"] + reference["shank"])
    for side in "rl":
        length = foot_length(leg, sex)
        sole = find_sole(frames, side, length, rate_hz, thresholds)
        rotation[f"foot_{side}"] = rotation[f"foot_{side}"] @ sole.correction
        seen = f"toes_{side}" in frames.positions
        if seen:
            ball = sole.ball
            toes = rotation[f"toes_{side}"]
            rotation[f"toes_{side}"] = toes @ _align_toes(toes, rotation[f"foot_{side}"])
            behind = np.clip(
                BALL_FRACTION * length - ball[0], *np.multiply(HEEL_BEHIND_ANKLE, length)
            )
        else:
            behind = 0.5 * sum(HEEL_BEHIND_ANKLE) * length
            ball = np.array([BALL_FRACTION * length - behind, 0.0, 0.0])
        ball_height = sole.ball_height if seen else HEIGHT_OF_BALL * length
        ball = np.array([ball[0], ball_height - sole.ankle_height, ball[2]])
        offsets[NODE_INDEX[f"toes_{side}"]] = ball
        half = FOOT_HALF_WIDTH * length
        lateral = half if side == "r" else -half
        points[f"heel_{side}"] = np.array([-behind, -sole.ankle_height, 0.0])
        points[f"ball_medial_{side}"] = np.array([ball[0], -sole.ankle_height, ball[2] - lateral])
        points[f"ball_lateral_{side}"] = np.array([ball[0], -sole.ankle_height, ball[2] + lateral])
        points[f"toe_{side}"] = np.array([(1 - BALL_FRACTION) * length, -ball_height, 0.0])
        points[f"fingertip_{side}"] = reference["hand"] * scale * DOWN
    points["head_top"] = -reference["head"] * scale * DOWN
    geometry = BodyGeometry(
        joint_offsets=offsets,
        contact_points=np.array([points[name] for name in CONTACT_POINTS]),
        end_points=np.array([points[name] for name in END_POINTS]),
    )
    return geometry, NodeFrames(position, rotation, frames.ends)


def _align_toes(toes: Array, foot: Array) -> Array:
    """Return the fixed turn that makes the toes' frame agree with the foot's in its median pose.

    Toes lie in line with the sole for most of a stance and of a swing.
    """
    relative = np.einsum("fba,fbc->fac", toes, foot)
    mean = np.median(relative, axis=0)
    u, _, v = np.linalg.svd(mean)
    return u @ np.diag([1.0, 1.0, np.linalg.det(u @ v)]) @ v
