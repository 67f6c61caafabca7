"""A person under markers, made up: a marker set, and TRC, C3D and force files to write."""

from __future__ import annotations

from pathlib import Path

import ezc3d
import numpy as np
import yaml

from motionstyle.body.body import Body
from motionstyle.body.kinematics import forward_kinematics, points_in_world
from motionstyle.body.layout import CONTACT_POINTS, NODE_INDEX
from motionstyle.mocap.formats.marker_clip import MarkerClip
from motionstyle.mocap.markers.markerset import LANDMARKS

RATIO = 10  # samples of a plate per frame of a C3D file
# Columns of two force plates.
NAMES = [p + k + a for p in ("", "1_") for k in ("ground_force_v", "ground_force_p") for a in "xyz"]
NAMES += [p + "ground_torque_" + a for p in ("", "1_") for a in "xyz"]
CLUSTERS = {
    "thigh": [(0.07, -0.12, 0.02), (0.05, -0.20, 0.06), (-0.02, -0.28, 0.07)],
    "shank": [(0.04, -0.10, 0.03), (0.05, -0.20, 0.04), (-0.03, -0.25, 0.05)],
}


def places(body: Body) -> dict[str, tuple[str, np.ndarray]]:
    """Where each landmark and cluster marker sits: node and place on it, m.

    The pelvis' markers lie so that the hip regression gives the body's own hips, the others so
    that joint centres lie midway, as on an ideal subject.
    """
    offsets = body.joint_offsets
    contact = dict(zip(CONTACT_POINTS, body.geometry.contact_points, strict=True))
    width = (offsets[NODE_INDEX["thigh_r"], 2] - 0.0073) / 0.33
    depth, neck = 0.16, offsets[NODE_INDEX["head"]]
    front = np.array([0.24 * depth + 0.0099, 0.30 * width + 0.0109, 0.0])
    found = {
        "c7": ("thorax", np.subtract(neck, [0.05, 0, 0])),
        "clavicle": ("thorax", np.add(neck, [0.06, -0.06, 0])),
        "sternum": ("thorax", np.add(neck, [0.10, -0.20, 0])),
        "t10": ("thorax", np.add(neck, [-0.09, -0.25, 0])),
        "head_top": ("head", np.array([0.0, 0.24, 0.0])),
    }
    for side, sign in (("r", 1.0), ("l", -1.0)):

        def at(node, x, y, z, centre=(0, 0, 0), side=side, sign=sign):
            return (f"{node}_{side}", np.add(centre, [x, y, sign * z]))

        def joint(node, side=side):
            return offsets[NODE_INDEX[f"{node}_{side}"]]

        shoulder = joint("upper_arm")
        span = 2 * abs(shoulder[2])
        ball = joint("toes")
        found |= {
            f"asis_{side}": ("pelvis", np.add(front, [0, 0, sign * width / 2])),
            f"psis_{side}": ("pelvis", np.add(front, [-depth, 0, sign * 0.05])),
            f"knee_lateral_{side}": at("thigh", 0, 0, 0.05, joint("shank")),
            f"knee_medial_{side}": at("thigh", 0, 0, -0.05, joint("shank")),
            f"ankle_lateral_{side}": at("shank", 0, 0, 0.036, joint("foot")),
            f"ankle_medial_{side}": at("shank", 0, 0, -0.036, joint("foot")),
            f"heel_{side}": at("foot", -0.01, 0.03, 0, contact[f"heel_{side}"]),
            f"mtp_lateral_{side}": at("foot", 0, 0, 0.045, ball),
            f"mtp_medial_{side}": at("foot", 0, 0, -0.045, ball),
            f"toe_tip_{side}": at("toes", contact[f"toe_{side}"][0], 0, 0),
            f"acromion_{side}": ("thorax", np.add(shoulder, [0, 0.17 * span, 0])),
            f"elbow_lateral_{side}": at("upper_arm", 0, 0, 0.04, joint("forearm")),
            f"elbow_medial_{side}": at("upper_arm", 0, 0, -0.04, joint("forearm")),
            f"wrist_radius_{side}": at("forearm", 0.025, 0, 0, joint("hand")),
            f"wrist_ulna_{side}": at("forearm", -0.025, 0, 0, joint("hand")),
            f"head_front_{side}": ("head", np.array([0.09, 0.15, sign * 0.07])),
            f"head_back_{side}": ("head", np.array([-0.09, 0.15, sign * 0.07])),
        }
        for node, spots in CLUSTERS.items():
            for k, (x, y, z) in enumerate(spots):
                found[f"{node}{k}_{side}"] = at(node, x, y, z)
    return found


def synthetic_markers(
    body: Body, coordinates: np.ndarray, rate_hz: float, *, without: tuple[str, ...] = ()
) -> MarkerClip:
    """The markers of `places` on a body in known poses, but those whose names begin so."""
    found = {k: v for k, v in places(body).items() if not k.startswith(without or ("?",))}
    nodes = np.array([NODE_INDEX[node] for node, _ in found.values()])
    local = np.array([place for _, place in found.values()])
    world = points_in_world(forward_kinematics(body, coordinates), nodes, local)
    return MarkerClip(tuple(f"M_{name}" for name in found), world, rate_hz, "made.trc")


SET = {
    "landmarks": {name: f"M_{name}" for name in LANDMARKS if name not in {"sacrum"}},
    "tracking": {
        f"{node}_{side}": [f"M_{node}{k}_{side}" for k in range(3)]
        for node in CLUSTERS
        for side in "rl"
    },
    "treadmill": ["belt*"],
    "forces": [
        {
            "files": "*",
            "plates": {
                name: {
                    "foot": name,
                    "force": f"{prefix}ground_force_v",
                    "point": f"{prefix}ground_force_p",
                    "moment": f"{prefix}ground_torque_",
                }
                for name, prefix in (("left", ""), ("right", "1_"))
            },
        }
    ],
}
for _name in ("toe_r", "toe_l", "finger_r", "finger_l"):
    del SET["landmarks"][_name]


def write_set(folder: Path, **changes: object) -> Path:
    """Write `SET` with changed sections as lab.yaml."""
    text = yaml.safe_dump({**SET, **changes})
    (folder / "lab.yaml").write_text(text, encoding="utf-8")
    return folder


def write_trc(path, clip):
    """Write a marker clip in mm; unseen samples are empty cells."""
    header = [
        "PathFileType\t4\t(X/Y/Z)\tmade.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits",
        f"{clip.rate_hz}\t{clip.rate_hz}\t{clip.frames}\t{len(clip.labels)}\tmm",
        "Frame#\tTime\t" + "\t\t\t".join(clip.labels) + "\t\t",
        "\t\t" + "\t".join(f"{a}{k + 1}" for k in range(len(clip.labels)) for a in "XYZ"),
        "",
    ]
    lines = [
        f"{f + 1}\t{f / clip.rate_hz + clip.start_s:.6f}\t"
        + "\t".join("" if np.isnan(v) else f"{1000 * v:.6f}" for v in frame.ravel())
        for f, frame in enumerate(clip.positions)
    ]
    path.write_text("\n".join(header + lines) + "\n", encoding="utf-8")
    return path


def write_c3d(
    path, points, labels, *, rate=100.0, unit="mm", descriptions=None, residuals=None, plate=None
):
    """Write points (F, M, 3) in the unit; `plate` (F·RATIO, 6) are a plate's channels in N, N·mm.

    The plate lies on the floor, 0.6 m along x and 0.4 m along y from the origin.
    """
    file = ezc3d.c3d()
    frames = len(points)
    file["parameters"]["POINT"]["RATE"]["value"] = [rate]
    file["parameters"]["POINT"]["UNITS"]["value"] = [unit]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(labels)
    if descriptions:
        file["parameters"]["POINT"]["DESCRIPTIONS"]["value"] = list(descriptions)
    data = np.ones((4, len(labels), frames))
    data[:3] = np.transpose(points, (2, 1, 0))
    file["data"]["points"] = data
    if residuals is not None:
        file["data"]["meta_points"]["residuals"] = residuals.T[None].astype(float)
    if plate is not None:
        names = ["Fx", "Fy", "Fz", "Mx", "My", "Mz"]
        file["parameters"]["ANALOG"]["RATE"]["value"] = [rate * RATIO]
        file["parameters"]["ANALOG"]["LABELS"]["value"] = names
        file["parameters"]["ANALOG"]["UNITS"]["value"] = ["N"] * 3 + ["Nmm"] * 3
        file["data"]["analogs"] = plate.T[None]
        corners = np.array([[600, 400, 0], [600, 0, 0], [0, 0, 0], [0, 400, 0]], dtype=float)
        file.add_parameter("FORCE_PLATFORM", "USED", 1)
        file.add_parameter("FORCE_PLATFORM", "TYPE", 2)
        file.add_parameter("FORCE_PLATFORM", "CHANNEL", 0)
        file["parameters"]["FORCE_PLATFORM"]["CHANNEL"]["value"] = np.arange(1, 7)[:, None]
        file.add_parameter("FORCE_PLATFORM", "CORNERS", corners.T[:, :, None])
        file.add_parameter("FORCE_PLATFORM", "ORIGIN", np.zeros((3, 1)))
        file.add_parameter("FORCE_PLATFORM", "ZERO", 0)
    file.write(str(path))
    return path


def forces_file(folder, *, rows=6, sign=1.0, names=NAMES, header=None, name="grf.mot"):
    """Write plates: 700 N at (0.1, 0, 0.2) m on the left, 10 N (unloaded) on the right."""
    header = f"trial\nversion=1\nnRows={rows}\nnColumns={len(names) + 1}\ninDegrees=yes\n" if (
        header is None
    ) else header  # fmt: skip
    lines = [header + "endheader", "time\t\t" + "\t".join(names)]
    known = {"ground_force_vy": 700.0 * sign, "ground_force_px": 0.1, "ground_force_pz": 0.2}
    known |= {"1_ground_force_vy": 10.0, "ground_torque_y": 3.0}
    for k in range(rows):
        values = [0.5 + 0.001 * k, *(known.get(n, 0.0) for n in names)]
        lines.append("\t ".join(f"{v:.6e}" for v in values) + "\t")
    path = folder / name
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path
