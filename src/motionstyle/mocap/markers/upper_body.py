"""Trunk, arms and head from landmarks, or from usual proportions where a set has none."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.anthropometry import REFERENCE_LENGTHS, TRUNK_LENGTHS, Sex
from motionstyle.body.rotations import exponential
from motionstyle.mocap.markers.joints import across, arm_joints, frame, unit

Array = NDArray[np.float64]
UP = np.array([0.0, 1.0, 0.0])
# Proportions of ours: the neck's joint lies ahead of the C7 marker and above mid-acromion.
NECK_AHEAD_OF_C7, NECK_ABOVE_ACROMIA = 0.05, 0.03
SHOULDER_HALF_WIDTH = 0.18  # m on a leg of 0.86 m
ARM_OF_LEG = {"upper_arm": 0.2817 / 0.8625, "forearm": 0.2689 / 0.8625}  # de Leva, male


def upright_frames(pelvis: Array) -> Array:
    """Return frames that share the pelvis' heading but stand upright, (F, 3, 3)."""
    right = unit(pelvis[..., 2] * [1, 0, 1])
    up = np.broadcast_to(UP, right.shape)
    return frame(np.cross(up, right), up, right)


def add_trunk(
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
    upright = upright_frames(rotation["pelvis"])
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


def add_arm(
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


def head_frames(points: dict[str, Array], thorax: Array) -> Array:
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
