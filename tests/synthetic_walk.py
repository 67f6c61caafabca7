"""A walk made up from its numbers: steps, times, widths and angles are known by construction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from motionstyle.body.body import BodyGeometry, build_body
from motionstyle.body.layout import (
    CONTACT_POINTS,
    COORDINATE_INDEX,
    COORDINATES,
    NODE_INDEX,
    NODES,
)
from motionstyle.body.rotations import exponential, logarithm
from motionstyle.motion.motion import Motion
from motionstyle.motion.resample import resample

RATE, STRIDE, STANCE = 100.0, 100, 60  # Hz, frames, frames
STEP, WIDTH, THIGH, SHANK, ANKLE = 0.7, 0.10, 0.43, 0.42, 0.08  # m
SPEED = 2 * STEP * RATE / STRIDE


def make_body():
    offsets = np.zeros((len(NODES), 3))
    points = {}
    for side, right in (("r", 1.0), ("l", -1.0)):
        offsets[NODE_INDEX[f"thigh_{side}"]] = (0, 0, right * WIDTH / 2)
        offsets[NODE_INDEX[f"shank_{side}"]] = (0, -THIGH, 0)
        offsets[NODE_INDEX[f"foot_{side}"]] = (0, -SHANK, 0)
        offsets[NODE_INDEX[f"toes_{side}"]] = (0.12, -ANKLE + 0.02, 0)
        offsets[NODE_INDEX[f"upper_arm_{side}"]] = (0, 0.2, right * 0.17)
        offsets[NODE_INDEX[f"forearm_{side}"]] = (0, -0.29, 0)
        offsets[NODE_INDEX[f"hand_{side}"]] = (0, -0.26, 0)
        points[f"heel_{side}"] = (-0.06, -ANKLE, 0)
        points[f"ball_medial_{side}"] = (0.12, -ANKLE, -right * 0.04)
        points[f"ball_lateral_{side}"] = (0.12, -ANKLE, right * 0.04)
        points[f"toe_{side}"] = (0.07, -0.02, 0)
    for node, height in (("abdomen", 0.15), ("thorax", 0.15), ("head", 0.22)):
        offsets[NODE_INDEX[node]] = (0, height, 0)
    ends = np.array([(0, 0.24, 0), (0, -0.18, 0), (0, -0.18, 0)])
    contacts = np.array([points[name] for name in CONTACT_POINTS])
    return build_body(BodyGeometry(offsets, contacts, ends), 70.0)


def ankle_path(frames: np.ndarray, first_strike: int) -> np.ndarray:
    """Place of the ankle (F, 2), forward and up: still in stance, a smooth arc in swing."""
    cycle, phase = np.divmod(frames - first_strike, STRIDE)
    place = 2 * STEP * cycle + SPEED * first_strike / RATE + SPEED * 0.5 * STANCE / RATE
    swing = np.clip((phase - STANCE) / (STRIDE - STANCE), 0, 1)
    arc = swing - np.sin(2 * np.pi * swing) / (2 * np.pi)
    height = ANKLE + 0.06 * (1 - np.cos(2 * np.pi * swing)) / 2
    return np.column_stack([place + 2 * STEP * arc, height])


def make_walk(frames: int = 420, heading: float = 0.0, **provenance: object) -> Motion:
    """Walk with flat feet at 1.4 m/s: stance 60 %, step 0.7 m, 120 steps/min, step width 0.1 m.

    Right strikes at 30, 130, …, left strikes at 80, 180, …; the pelvis is level and steady.
    """
    t = np.arange(frames)
    q = np.zeros((frames, len(COORDINATES)))
    pelvis_height = 0.77
    pelvis = SPEED * t / RATE
    q[:, 0], q[:, 1] = pelvis, pelvis_height
    contacts = np.zeros((frames, len(CONTACT_POINTS)), dtype=bool)
    for side, strike in (("r", 30), ("l", 80)):
        forward, up = (ankle_path(t, strike) - np.column_stack([pelvis, q[:, 1]])).T
        reach = np.hypot(forward, up)
        knee = np.pi - np.arccos((THIGH**2 + SHANK**2 - reach**2) / (2 * THIGH * SHANK))
        lean = np.arctan2(forward, -up)
        hip = lean + np.arcsin(SHANK * np.sin(knee) / reach)
        q[:, COORDINATE_INDEX[f"hip_flexion_{side}"]] = hip
        q[:, COORDINATE_INDEX[f"knee_flexion_{side}"]] = knee
        q[:, COORDINATE_INDEX[f"ankle_dorsiflexion_{side}"]] = knee - hip
        own = [k for k, name in enumerate(CONTACT_POINTS) if name.endswith(side)]
        contacts[:, own] = ((t - strike) % STRIDE < STANCE)[:, None]
    if heading:
        turn = exponential(np.array([0.0, heading, 0.0]))
        q[:, :3] = q[:, :3] @ turn.T
        q[:, 3:6] = logarithm(turn)
    normals = np.broadcast_to([0.0, 1.0, 0.0], (*contacts.shape, 3)).copy()
    known = {"dataset": "synthetic", "action": "walk", "style": "normal", "surface": "level"}
    return Motion(
        id="walk",
        kind="captured",
        rate_hz=RATE,
        coordinates=q,
        body=make_body(),
        contacts=contacts,
        contact_normals=normals,
        observed=np.ones(len(COORDINATES), dtype=bool),
        provenance=known | provenance,
    )


def loaded_walk(first: int, last: int) -> Motion:
    """Return frames first to last (included) of the walk at 30 Hz, contacts bearing its weight."""
    motion = resample(make_walk(), 30.0).window(first, last)
    held = motion.contacts.sum(axis=1)
    forces = np.zeros((motion.frames, 8, 3))
    forces[..., 1] = motion.contacts * (motion.body.mass * 9.81 / np.maximum(held, 1))[:, None]
    return replace(motion, contact_forces=forces)
