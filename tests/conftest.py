"""What many tests share: a realistic person and a walk-like movement, both made up."""

from __future__ import annotations

import numpy as np
import pytest

from motionstyle.body.anthropometry import BALL_FRACTION
from motionstyle.body.body import Body, BodyGeometry, build_body
from motionstyle.body.kinematics import contact_points, forward_kinematics
from motionstyle.body.layout import (
    CONTACT_POINTS,
    COORDINATE_INDEX,
    COORDINATES,
    END_POINTS,
    NODE_INDEX,
    NODES,
)
from motionstyle.dynamics.codegen import FrameFunction, load_functions
from motionstyle.dynamics.functions import dynamics_functions
from motionstyle.dynamics.second_order import second_order_functions
from motionstyle.motion.motion import Motion

STATURE_M = 1.74


@pytest.fixture(scope="session")
def plain_geometry() -> BodyGeometry:
    """A man of 1.74 m with de Leva's mean proportions, symmetric."""
    ankle, foot, behind = 0.075, 0.2581, 0.06
    ball = BALL_FRACTION * foot - behind
    offsets = {
        "abdomen": (0.0, 0.1457, 0.0),
        "thorax": (0.0, 0.2155, 0.0),
        "head": (0.0, 0.2421, 0.0),
    }
    points = {}
    ends = {"head_top": (0.0, 0.2429, 0.0)}
    for side, right in (("r", 1.0), ("l", -1.0)):
        offsets[f"thigh_{side}"] = (0.0, 0.0, 0.085 * right)
        offsets[f"shank_{side}"] = (0.0, -0.4222, 0.0)
        offsets[f"foot_{side}"] = (0.0, -0.4403, 0.0)
        offsets[f"toes_{side}"] = (ball, 0.025 - ankle, 0.0)
        offsets[f"upper_arm_{side}"] = (0.0, 0.19, 0.18 * right)
        offsets[f"forearm_{side}"] = (0.0, -0.2817, 0.0)
        offsets[f"hand_{side}"] = (0.0, -0.2689, 0.0)
        points[f"heel_{side}"] = (-behind, -ankle, 0.0)
        points[f"ball_medial_{side}"] = (ball, -ankle, -0.044 * right)
        points[f"ball_lateral_{side}"] = (ball, -ankle, 0.044 * right)
        points[f"toe_{side}"] = ((1 - BALL_FRACTION) * foot, -0.025, 0.0)
        ends[f"fingertip_{side}"] = (0.0, -0.1879, 0.0)
    joints = np.zeros((len(NODES), 3))
    for node, offset in offsets.items():
        joints[NODE_INDEX[node]] = offset
    scale = STATURE_M / (ankle + 0.4403 + 0.4222 + 0.1457 + 0.2155 + 0.2421 + 0.2429)
    return BodyGeometry(
        joint_offsets=scale * joints,
        contact_points=scale * np.array([points[name] for name in CONTACT_POINTS]),
        end_points=scale * np.array([ends[name] for name in END_POINTS]),
    )


@pytest.fixture(scope="session")
def plain_body(plain_geometry: BodyGeometry) -> Body:
    """The man of `plain_geometry`, 73 kg."""
    return build_body(plain_geometry, 73.0, "male")


@pytest.fixture(scope="session")
def standing(plain_body: Body) -> np.ndarray:
    """Coordinates (1, 35) of the zero pose with the soles on the floor."""
    pose = np.zeros((1, len(COORDINATES)))
    pose[0, 1] = -contact_points(plain_body, forward_kinematics(plain_body, pose))[..., 1].min()
    return pose


@pytest.fixture(scope="session")
def plain_motion(plain_body: Body, standing: np.ndarray) -> Motion:
    """Two seconds of sinusoids like a walk along +x, 120 Hz, with made-up contacts and forces."""
    rate, frames = 120.0, 241
    t = np.arange(frames) / rate
    phase = 2 * np.pi * 0.95 * t
    q = np.tile(standing, (frames, 1))

    def put(name: str, degrees: np.ndarray) -> None:
        q[:, COORDINATE_INDEX[name]] = np.radians(degrees)

    q[:, 0] = 1.3 * t
    q[:, 1] += 0.02 * np.cos(2 * phase) - 0.02
    q[:, 2] = 0.02 * np.sin(phase)
    put("pelvis_rx", 3 * np.sin(phase))
    put("pelvis_ry", 5 * np.sin(phase + 0.4))
    put("pelvis_rz", -2 + np.cos(2 * phase))
    put("abdomen_flexion", 4 + np.cos(2 * phase))
    put("abdomen_bending", 3 * np.sin(phase + 0.2))
    put("abdomen_rotation", -4 * np.sin(phase))
    put("thorax_flexion", 2 + np.sin(2 * phase))
    put("thorax_rotation", -6 * np.sin(phase))
    put("head_flexion", -3 + np.cos(2 * phase))
    put("head_rotation", 4 * np.sin(phase))
    contacts = np.zeros((frames, len(CONTACT_POINTS)), dtype=bool)
    for side, shift in (("r", 0.0), ("l", np.pi)):
        swing = phase + shift
        put(f"hip_flexion_{side}", 10 + 20 * np.cos(swing))
        put(f"hip_adduction_{side}", 3 * np.sin(swing))
        put(f"hip_rotation_{side}", 4 * np.sin(swing + 1))
        put(f"knee_flexion_{side}", 30 - 25 * np.cos(swing + 0.9))
        put(f"ankle_dorsiflexion_{side}", 10 * np.sin(swing - 0.5))
        put(f"foot_inversion_{side}", 4 * np.sin(swing))
        put(f"toes_extension_{side}", 12 - 12 * np.cos(swing))
        put(f"shoulder_flexion_{side}", -20 * np.cos(swing))
        put(f"shoulder_abduction_{side}", 8 + 2 * np.cos(swing))
        put(f"shoulder_rotation_{side}", 5 * np.sin(swing))
        put(f"elbow_flexion_{side}", 25 - 10 * np.cos(swing))
        for k, point in enumerate(("heel", "ball_medial", "ball_lateral", "toe")):
            column = CONTACT_POINTS.index(f"{point}_{side}")
            contacts[:, column] = np.sin(swing - 0.15 * k) > -0.2
    normals = np.zeros((*contacts.shape, 3))
    normals[..., 1] = 1.0
    normals[contacts] = [0.06, np.sqrt(1 - 0.06**2 - 0.08**2), 0.08]
    share = plain_body.mass * 9.81 / np.maximum(contacts.sum(axis=1), 1)
    forces = contacts[..., None] * share[:, None, None] * np.array([0.1, 1.0, 0.04])
    observed = np.ones(len(COORDINATES), dtype=bool)
    observed[COORDINATE_INDEX["toes_extension_l"]] = False
    return Motion(
        id="plain",
        kind="captured",
        rate_hz=rate,
        coordinates=q,
        body=plain_body,
        contacts=contacts,
        contact_normals=normals,
        contact_forces=forces,
        observed=observed,
        provenance={"subject": "nobody", "action": "walk", "style": "neutral"},
    )


@pytest.fixture(scope="session")
def all_functions() -> dict[str, FrameFunction]:
    """The dynamics' functions, first and second order, on CasADi's virtual machine."""
    return load_functions(dynamics_functions, None) | load_functions(second_order_functions, None)
