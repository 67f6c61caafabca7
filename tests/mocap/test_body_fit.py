"""Node frames, segment lengths and soles of clips made from a known body in known poses.

`known_gait` and `clip_of` serve the tests of retargeting and ingestion too.
"""

from __future__ import annotations

from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
import pytest

from motionstyle.body.body import Body, BodyGeometry, build_body
from motionstyle.body.kinematics import contact_points, forward_kinematics, points_in_world
from motionstyle.body.layout import (
    CONTACT_POINTS,
    COORDINATE_INDEX,
    COORDINATES,
    END_POINTS,
    JOINTS,
    NODE_INDEX,
    NODES,
    PARENTS,
)
from motionstyle.body.rotations import exponential, logarithm
from motionstyle.mocap.fitting import body_fit
from motionstyle.mocap.fitting.floor import StanceThresholds
from motionstyle.mocap.formats.clip import SkeletonClip
from motionstyle.mocap.planted.legs import Leg, solve_leg
from motionstyle.mocap.skeletons.skeleton_map import SkeletonMap, read_skeleton_map

SKELETONS = Path(__file__).parents[2] / "config" / "skeletons"
CMU = read_skeleton_map(SKELETONS, "cmu_asf")
THRESHOLDS = StanceThresholds(0.025, 0.03, 0.25, 0.8, 0.07, 0.05)


@dataclass(frozen=True)
class Gait:
    """A walk or run along +x on y = 0 with what is known of it.

    coordinates (F, 35); contacts (F, 8) of the contact points; strikes, lifts : frames (not
    whole numbers) at which each foot lands and leaves, by side.
    """

    body: Body
    rate_hz: float
    coordinates: np.ndarray
    contacts: np.ndarray
    strikes: dict[str, np.ndarray]
    lifts: dict[str, np.ndarray]
    step_m: float


def _foot(body, side, time, *, stride_s, stance, speed, lift, pitch_deg, toe_out):
    """One foot of a gait: it lands on the heel, lies flat, rolls over the ball and swings.

    Return ankle (F, 3), rotation (F, 3, 3), toe extension (F,) and contacts (F, 4).
    """
    columns = [CONTACT_POINTS.index(f"{p}_{side}") for p in ("heel", "ball_medial", "ball_lateral")]
    local = body.geometry.contact_points[columns]
    heel, ball = local[0], local[1:].mean(axis=0)
    land, push = np.radians(pitch_deg)
    shift = 0.0 if side == "r" else 0.5
    cycle, phase = np.divmod(time / stride_s + shift + 0.3, 1.0)
    flat_on, heel_off = 0.2 * stance, 0.6 * stance
    yaw = exponential(np.array([0.0, -toe_out if side == "r" else toe_out, 0.0]))

    def pitched(angle):
        vectors = np.zeros((len(np.atleast_1d(angle)), 3))
        vectors[:, 2] = angle
        return yaw @ exponential(vectors)

    def ankle_at(angle, anchor, point):
        return anchor - pitched(angle) @ point

    width = body.joint_offsets[NODE_INDEX[f"thigh_{side}"], 2]
    middle = 0.5 * stance  # of the stance, when the hip passes over the foot
    place = speed * stride_s * (cycle - shift - 0.3 + middle)
    anchor = np.column_stack([place - 0.06, np.zeros_like(place), np.full_like(place, width)])
    ball_anchor = anchor + yaw @ (ball - heel)
    down = np.clip(phase / flat_on, 0, 1)
    up = np.clip((phase - heel_off) / (stance - heel_off), 0, 1)
    pitch = land * (1 - down) ** 2 - push * up**2
    ankle = np.where(
        (phase < heel_off)[:, None],
        ankle_at(pitch, anchor, heel),
        ankle_at(pitch, ball_anchor, ball),
    )
    swing = phase >= stance
    s = ((phase - stance) / (1 - stance))[swing]
    span = (1 - stance) * stride_s
    h = 1e-5  # s, for the velocities at which the swing begins and ends
    begin = ankle_at(np.full(s.shape, -push), ball_anchor[swing], ball)
    leave = 2 / ((stance - heel_off) * stride_s) * -push
    before = ankle_at(np.full(s.shape, -push - leave * h), ball_anchor[swing], ball)
    after_anchor = anchor[swing] + [speed * stride_s, 0, 0]
    end = ankle_at(np.full(s.shape, land), after_anchor, heel)
    arrive = -2 * land / (flat_on * stride_s)
    after = ankle_at(np.full(s.shape, land + arrive * h), after_anchor, heel)
    basis = [2 * s**3 - 3 * s**2 + 1, s**3 - 2 * s**2 + s, -2 * s**3 + 3 * s**2, s**3 - s**2]
    ankle[swing] = (
        basis[0][:, None] * begin
        + basis[1][:, None] * (begin - before) / h * span
        + basis[2][:, None] * end
        + basis[3][:, None] * (after - end) / h * span
    )
    ankle[swing, 1] += lift * 16 * (s * (1 - s)) ** 2
    pitch[swing] = (
        basis[0] * -push + basis[1] * leave * span + basis[2] * land + basis[3] * arrive * span
    )
    # over the ball the toes lie flat, their tip on the ground, and in swing they clear it
    tip = body.geometry.contact_points[CONTACT_POINTS.index(f"toe_{side}")]
    joint = ankle[:, 1] + (pitched(pitch) @ body.joint_offsets[NODE_INDEX[f"toes_{side}"]])[:, 1]
    least = np.arcsin(np.minimum(joint / np.hypot(tip[0], tip[1]), 1.0))
    least = np.arctan2(-tip[1], tip[0]) - least - pitch
    extension = np.where(phase < flat_on, 0.0, least)
    relaxed = extension[phase < stance].max(initial=0.0) * (1 - s) ** 2 * (1 + 2 * s)
    extension[swing] = np.maximum(relaxed, least[swing])
    on_heel, on_ball = phase < heel_off, (phase >= flat_on) & ~swing
    strikes = stride_s * (np.arange(cycle.min(), cycle.max() + 1) - shift - 0.3)
    return (
        ankle,
        pitched(pitch),
        extension,
        np.column_stack([on_heel, on_ball, on_ball, on_ball]),
        strikes,
    )


def known_gait(
    body: Body,
    *,
    rate_hz: float = 100.0,
    seconds: float = 2.8,
    speed: float = 1.2,
    stride_s: float = 1.1,
    stance: float = 0.62,
    pelvis_m: float = 0.81,
    lift: float = 0.06,
    pitch_deg: tuple[float, float] = (18.0, 42.0),
    toe_out: float = 0.1,
    toes: bool = True,
    thorax: bool = True,
) -> Gait:
    """Walk along +x: the pelvis faces +x over the origin in the first frame."""
    frames = round(seconds * rate_hz) + 1
    t = np.arange(frames) / rate_hz
    phase = 2 * np.pi * t / stride_s
    q = np.zeros((frames, len(COORDINATES)))

    def put(name, degrees):
        q[:, COORDINATE_INDEX[name]] = np.radians(degrees)

    q[:, 0] = speed * t + 0.01 * np.sin(2 * phase)
    q[:, 1] = pelvis_m + 0.012 * np.sin(2 * phase)
    q[:, 2] = 0.02 * np.sin(phase)
    put("pelvis_rx", 3 * np.sin(phase))
    put("pelvis_ry", 6 * np.sin(phase))
    put("pelvis_rz", -4 + np.cos(2 * phase))
    put("abdomen_flexion", 6 + 2 * np.cos(2 * phase))
    put("abdomen_bending", 4 * np.sin(phase + 0.2))
    put("abdomen_rotation", -5 * np.sin(phase))
    if thorax:
        put("thorax_flexion", 3 + 2 * np.sin(2 * phase))
        put("thorax_rotation", -7 * np.sin(phase))
    put("head_flexion", -5 + 2 * np.cos(2 * phase))
    put("head_rotation", 6 * np.sin(phase))
    pelvis, turns = q[:, :3], exponential(q[:, 3:6])
    contacts = np.zeros((frames, len(CONTACT_POINTS)), dtype=bool)
    strikes, lifts = {}, {}
    for side, shift in (("r", 0.0), ("l", np.pi)):
        swing = phase + shift
        put(f"shoulder_flexion_{side}", -22 * np.cos(swing))
        put(f"shoulder_abduction_{side}", 10 + 3 * np.cos(swing))
        put(f"shoulder_rotation_{side}", 8 * np.sin(swing))
        put(f"elbow_flexion_{side}", 30 - 12 * np.cos(swing))
        ankle, foot, extension, bearing, landings = _foot(
            body, side, t, stride_s=stride_s, stance=stance, speed=speed, lift=lift,
            pitch_deg=pitch_deg, toe_out=toe_out,
        )  # fmt: skip
        leg = Leg.of(body, side)
        q[:, leg.columns] = solve_leg(leg, pelvis, turns, ankle, foot)
        if toes:
            q[:, COORDINATE_INDEX[f"toes_extension_{side}"]] = extension
        contacts[:, [i for i, n in enumerate(CONTACT_POINTS) if n.endswith(side)]] = bearing
        strikes[side] = landings * rate_hz
        lifts[side] = (landings + stance * stride_s) * rate_hz
        reached = forward_kinematics(body, q).positions[:, NODE_INDEX[f"foot_{side}"]]
        np.testing.assert_allclose(reached, ankle, atol=1e-9)  # else the leg is too short
    return Gait(body, rate_hz, q, contacts, strikes, lifts, speed * stride_s / 2)


def zero_pose(twist_deg: float) -> np.ndarray:
    """Coordinates (1, 35) of a T-pose, thighs and arms twisted outward about their long axes."""
    zero = np.zeros((1, len(COORDINATES)))
    for side, sign in (("r", 1.0), ("l", -1.0)):
        zero[0, COORDINATE_INDEX[f"hip_rotation_{side}"]] = np.radians(twist_deg)
        out = exponential(np.array([-sign * np.pi / 2, 0.0, 0.0]))
        spin = exponential(np.array([0.0, sign * np.radians(twist_deg), 0.0]))
        shoulder = JOINTS[NODE_INDEX[f"upper_arm_{side}"]]
        columns = [COORDINATE_INDEX[name] for name in shoulder.names]
        zero[0, columns] = np.array(shoulder.axes) @ logarithm(out @ spin)
    return zero


def end_place(end: str, body: Body) -> tuple[str, np.ndarray]:
    """Return the node an end of a skeleton map is fixed to, and where on it."""
    kind, _, side = end.rpartition("_")
    points = dict(zip(END_POINTS, body.geometry.end_points, strict=True))
    points |= dict(zip(CONTACT_POINTS, body.geometry.contact_points, strict=True))
    middle = (points["ball_medial_r"] + points["ball_lateral_r"]) / 2
    if side == "l":
        middle = (points["ball_medial_l"] + points["ball_lateral_l"]) / 2
    return {
        "head": ("head", points["head_top"]),
        "foot_front": (f"foot_{side}", middle),
        "wrist": (f"forearm_{side}", body.joint_offsets[NODE_INDEX.get(f"hand_{side}", 0)]),
        "toe": (f"toes_{side}", points.get(f"toe_{side}")),
        "fingertip": (f"hand_{side}", points.get(f"fingertip_{side}")),
    }[kind]


def clip_of(
    skeleton: SkeletonMap,
    body: Body,
    coordinates: np.ndarray,
    rate_hz: float,
    *,
    twist_deg: float = 0.0,
    extra: tuple[str, ...] = (),
) -> SkeletonClip:
    """Return the clip that a source skeleton of this body shows in these poses, m and y up.

    The zero pose is a twisted T-pose or, where the map gives axes, one no person could take.
    `extra` joints hang on the first one.
    """
    joints: list[tuple[str, str, np.ndarray, int]] = []  # name, node, place on it, parent
    carrier: dict[str, int] = {}  # the last joint of each node, on which the next ones hang
    for node in (n for n in NODES if n in skeleton.joints):
        above = PARENTS[NODE_INDEX[node]]
        while above >= 0 and NODES[above] not in carrier:
            above = PARENTS[above]
        parent = -1 if above < 0 else carrier[NODES[above]]
        collar = {j[0].lower(): j for j in skeleton.offsets_like}.get(node[-1])
        if node.startswith("upper_arm") and collar:
            joints.append((collar, "thorax", np.array([0.0, 0.12, 0.0]), parent))
            parent = len(joints) - 1
        joints.append((skeleton.joints[node], node, np.zeros(3), parent))
        if skeleton.frame_joint(node) != skeleton.joints[node]:
            place = np.array([0.0, 0.07, 0.0])
            joints.append((skeleton.frame_joint(node), node, place, len(joints) - 1))
        carrier[node] = len(joints) - 1
    for end, joint in skeleton.ends.items():
        node, place = end_place(end, body)
        parent, stem = carrier[node], joint.removesuffix("_end")
        ignored = any(fnmatchcase(stem, pattern) for pattern in skeleton.ignored)
        if joint != stem and ignored:  # a bone in between, such as fingers
            joints.append((stem, node, place / 2, parent))
            parent = len(joints) - 1
        joints.append((joint, node, place, parent))
    joints += [(name, "pelvis", np.array([0.0, 0.1, 0.0]), 0) for name in extra]
    names, nodes, places, parents = zip(*joints, strict=True)
    at, parents = np.array([NODE_INDEX[node] for node in nodes]), np.array(parents)
    pose, rest = (forward_kinematics(body, q) for q in (coordinates, zero_pose(twist_deg)))
    positions, zero = (points_in_world(p, at, np.array(places)) for p in (pose, rest))
    if skeleton.zero_pose == "axes":
        turns = np.array([skeleton.axes.get(node, np.eye(3)) for node in nodes])
        rotations = pose.rotations[:, at] @ np.swapaxes(turns, 1, 2)
        bones = positions[0] - positions[0, parents]
        offsets = np.einsum("jba,jb->ja", rotations[0, parents], bones)
    else:
        rotations = pose.rotations[:, at] @ np.swapaxes(rest.rotations[0, at], 1, 2)
        offsets = zero[0] - zero[0, parents]
    offsets[0] = 0.0
    return SkeletonClip(names, parents, offsets, positions, rotations, rate_hz, "known.bvh")


@pytest.fixture(scope="module")
def walk(plain_body):
    return known_gait(plain_body)


def frames_of(walk, skeleton=CMU, **options):
    return body_fit.node_frames(
        clip_of(skeleton, walk.body, walk.coordinates, walk.rate_hz, **options), skeleton
    )


def turn_between_deg(one, two):
    """Largest angle between rotation matrices (F, 3, 3)."""
    return np.degrees(np.linalg.norm(logarithm(np.swapaxes(one, 1, 2) @ two), axis=-1).max())


def test_the_known_walk_stands_still_where_it_says_and_never_sinks(walk):
    points = contact_points(walk.body, forward_kinematics(walk.body, walk.coordinates))
    assert np.abs(points[..., 1][walk.contacts]).max() < 1e-9
    assert points[..., 1].min() > -1e-9
    both = walk.contacts[1:] & walk.contacts[:-1]
    both[:, 3::4] = False  # toe tips roll
    assert np.abs(np.diff(points, axis=0))[both].max() < 1e-9
    assert walk.contacts[:, 0].any()
    assert not walk.contacts[:, 0].all()


@pytest.mark.parametrize("name", ["cmu_asf", "bandai", "aalto", "pymo", "deepmimic"])
def test_node_frames_are_those_of_the_body_whatever_the_zero_pose(plain_body, name):
    skeleton = read_skeleton_map(SKELETONS, name)
    walk = known_gait(plain_body, thorax="thorax" in skeleton.joints)
    pose = forward_kinematics(plain_body, walk.coordinates)
    frames = frames_of(walk, skeleton)
    for node in skeleton.joints:
        at = NODE_INDEX[node]
        np.testing.assert_allclose(frames.positions[node], pose.positions[:, at], atol=1e-9)
        if not node.startswith(("foot", "toes")):  # these are turned onto their soles later
            assert turn_between_deg(frames.rotations[node], pose.rotations[:, at]) < 1e-6, node


@pytest.mark.parametrize("twist", [-70.0, 25.0, 120.0])
def test_the_twist_of_a_zero_pose_is_taken_from_how_knees_and_elbows_bend(walk, twist):
    pose = forward_kinematics(walk.body, walk.coordinates)
    frames = frames_of(walk, twist_deg=twist)
    for node in ("thigh_r", "thigh_l", "upper_arm_r", "upper_arm_l"):
        assert turn_between_deg(frames.rotations[node], pose.rotations[:, NODE_INDEX[node]]) < 1e-6


@pytest.mark.parametrize(("bend", "kept"), [(5.0, True), (20.0, False)])
def test_a_limb_that_hardly_bends_keeps_its_twist(plain_body, walk, bend, kept):
    q = np.array(walk.coordinates)
    for side in "rl":
        q[:, COORDINATE_INDEX[f"elbow_flexion_{side}"]] = np.radians(bend)
    clip = clip_of(CMU, plain_body, q, 100.0, twist_deg=30.0)
    turned = body_fit.node_frames(clip, CMU).rotations["upper_arm_r"]
    truth = forward_kinematics(plain_body, q).rotations[:, NODE_INDEX["upper_arm_r"]]
    assert turn_between_deg(turned, truth) == pytest.approx(30.0 if kept else 0.0, abs=1e-6)


@pytest.mark.parametrize("name", ["cmu_asf", "bandai", "aalto"])
def test_lengths_and_soles_are_measured(walk, name):
    skeleton = read_skeleton_map(SKELETONS, name)
    geometry, frames = body_fit.measure_body(
        frames_of(walk, skeleton), "male", walk.rate_hz, THRESHOLDS
    )
    truth = walk.body.geometry
    seen = [NODE_INDEX[node] for node in skeleton.joints]
    pose = forward_kinematics(walk.body, walk.coordinates)
    if "toes_r" in skeleton.joints:
        np.testing.assert_allclose(
            geometry.joint_offsets[seen], truth.joint_offsets[seen], atol=1e-4
        )
        np.testing.assert_allclose(geometry.contact_points, truth.contact_points, atol=3e-4)
        for node in ("foot_r", "toes_l"):
            off = turn_between_deg(frames.rotations[node], pose.rotations[:, NODE_INDEX[node]])
            assert off < 1.5  # the foot counts as flat until its heel is 3 cm up
    else:
        legs = [NODE_INDEX[f"{n}_{s}"] for n in ("thigh", "shank", "foot") for s in "rl"]
        np.testing.assert_allclose(
            geometry.joint_offsets[legs], truth.joint_offsets[legs], atol=1e-6
        )
        soles = [i for i, n in enumerate(CONTACT_POINTS) if n.startswith(("heel", "ball"))]
        np.testing.assert_allclose(
            geometry.contact_points[soles, 1], truth.contact_points[soles, 1], atol=1e-3
        )


def test_without_flat_feet_the_sole_is_put_at_its_usual_height(plain_body, walk):
    q = np.array(walk.coordinates)
    q[:, 1] += 0.5  # in the air all the time
    clip = clip_of(CMU, plain_body, q, walk.rate_hz)
    frames = body_fit.node_frames(clip, CMU)
    length = body_fit.foot_length(plain_body.leg_length, "male")
    sole = body_fit.find_sole(frames, "r", length, walk.rate_hz, THRESHOLDS)
    assert sole.flat_frames == 0
    assert sole.ankle_height == pytest.approx(body_fit.HEIGHT_OF_ANKLE * length)
    assert sole.ball_height == pytest.approx(body_fit.HEIGHT_OF_BALL * length)
    # and the ball lies as much lower than the ankle as these heights say
    assert sole.ball[1] == pytest.approx(sole.ball_height - sole.ankle_height, abs=1e-9)


def test_foot_length_is_de_levas_at_his_mean_leg():
    assert body_fit.foot_length(0.4222 + 0.4403, "male") == pytest.approx(0.2581)
    assert body_fit.foot_length(0.3685 + 0.4386, "female") == pytest.approx(0.2283)
    assert body_fit.foot_length(0.5 * (0.4222 + 0.4403), "male") == pytest.approx(0.5 * 0.2581)


def test_a_limb_of_other_length_on_one_side_is_measured_on_that_side(plain_geometry):
    offsets = np.array(plain_geometry.joint_offsets)
    offsets[NODE_INDEX["hand_l"], 1] *= 0.9
    offsets[NODE_INDEX["foot_l"], 1] *= 0.98
    body = build_body(
        BodyGeometry(offsets, plain_geometry.contact_points, plain_geometry.end_points), 70.0
    )
    walk = known_gait(body, pelvis_m=0.80)
    geometry, _ = body_fit.measure_body(frames_of(walk), "male", walk.rate_hz, THRESHOLDS)
    for node in ("hand_r", "hand_l", "foot_r", "foot_l"):
        np.testing.assert_allclose(
            geometry.joint_offsets[NODE_INDEX[node]], offsets[NODE_INDEX[node]], atol=1e-6
        )
