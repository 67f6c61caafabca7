"""Joint centres from landmarks: hips by regression, knees and ankles midway, shoulders, elbows.

Where a laboratory has no marker at knee and ankle, their centres are found from how the clusters
of thigh, shank and foot turn about each other.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Points = Mapping[str, Array]

# Half widths of joints with a marker on the outer side only, as shares of leg length (ours, from
# usual widths of 10 cm and 7 cm, and marker radii, on a leg of 0.86 m).
HALF_KNEE, HALF_ANKLE, HALF_ELBOW = 0.062, 0.044, 0.045
# The glenohumeral joint lies this share of the distance between the acromia below the acromion
# (Rab et al. 2002, as recalled).
SHOULDER_DROP = 0.17
BEND = 0.15  # sine of the bend at which a limb's plane weighs as much as the reference axis


def unit(vectors: Array) -> Array:
    """Scale vectors (..., 3) to length 1."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)


def across(vectors: Array, along: Array) -> Array:
    """Return unit vectors: `vectors` less their part along the unit vectors `along`."""
    return unit(vectors - (vectors * along).sum(axis=-1, keepdims=True) * along)


def frame(x: Array, y: Array, z: Array) -> Array:
    """Return rotation matrices (F, 3, 3) with these columns."""
    return np.stack([x, y, z], axis=-1)


def pelvis_frame(points: Points) -> Array:
    """Return the pelvis' axes (F, 3, 3): z from left to right ASIS, x–z the plane of ASIS and PSIS.

    Its origin is mid-hip; see `hip_centres`.
    """
    right = unit(points["asis_r"] - points["asis_l"])
    forward = across(_front(points) - _back(points), right)
    return frame(forward, np.cross(right, forward), right)


def _front(points: Points) -> Array:
    return (points["asis_r"] + points["asis_l"]) / 2


def _back(points: Points) -> Array:
    if "psis_r" in points and "psis_l" in points:
        return (points["psis_r"] + points["psis_l"]) / 2
    return points["sacrum"]


def hip_centres(points: Points) -> dict[str, Array]:
    """Return hip joint centres by side, (F, 3), m.

    Harrington et al. 2007, J. Biomech. 40:595 (coefficients as recalled): from mid-ASIS, with
    pelvic width W and depth D in mm, 0.24·D + 9.9 behind, 0.30·W + 10.9 below and 0.33·W + 7.3
    to the side. Width and depth are medians over the frames.
    """
    axes, front = pelvis_frame(points), _front(points)
    width = np.nanmedian(np.linalg.norm(points["asis_r"] - points["asis_l"], axis=1))
    depth = np.nanmedian(np.linalg.norm(front - _back(points), axis=1))
    local = np.array([-0.24 * depth - 0.0099, -0.30 * width - 0.0109, 0.33 * width + 0.0073])
    return {side: front + axes @ (local * [1, 1, sign]) for side, sign in (("r", 1), ("l", -1))}


def leg_joints(
    points: Points, clusters: Mapping[str, Array], hip: Array, right: Array, side: str
) -> tuple[Array, Array, Array]:
    """Return knee centre, ankle centre and knee axis (to the right) of one side, (F, 3) each.

    Parameters
    ----------
    points : landmarks. clusters : all markers of a node, (F, K, 3), by node.
    hip : its centre. right : the pelvis' axis to the right.
    """
    sign = 1.0 if side == "r" else -1.0
    outer = points.get(f"knee_lateral_{side}")
    outer_ankle = points.get(f"ankle_lateral_{side}")
    if outer is None or outer_ankle is None:
        return _from_clusters(clusters, hip, right, side)
    leg = np.nanmedian(np.linalg.norm(hip - outer, axis=1))
    leg += np.nanmedian(np.linalg.norm(outer - outer_ankle, axis=1))
    inner, inner_ankle = points.get(f"knee_medial_{side}"), points.get(f"ankle_medial_{side}")
    if inner is not None:
        knee = (outer + inner) / 2
        axis = across(sign * (outer - inner), unit(hip - knee))
    else:
        knee = outer
        for _ in range(3):
            axis = _hinge_axis(hip, knee, outer_ankle, right)
            knee = outer - sign * HALF_KNEE * leg * axis
    if inner_ankle is not None:
        ankle = (outer_ankle + inner_ankle) / 2
    else:
        ankle = outer_ankle - sign * HALF_ANKLE * leg * across(axis, unit(knee - outer_ankle))
    if inner is None:
        axis = _hinge_axis(hip, knee, ankle, right)
    return knee, ankle, axis


def _hinge_axis(top: Array, middle: Array, bottom: Array, right: Array) -> Array:
    """Return a hinge's axis, to the right, across the upper bone.

    The pelvis' own axis to the right, turned about the bone by one constant angle so that the
    limb bends about it (weighted by how far it bends).
    """
    bone = unit(top - middle)
    sideways = across(right, bone)
    ahead = np.cross(bone, sideways)
    lower = unit(bottom - middle)
    # a knee bends backward: the part of the lower bone across the upper one points behind
    x, z = (lower * ahead).sum(axis=1), (lower * sideways).sum(axis=1)
    bends = np.hypot(x, z)
    if not np.nanmean(bends) > np.sin(np.radians(10)):
        return sideways
    size = np.hypot(np.nansum(x), np.nansum(z))
    cos, sin = -np.nansum(x) / size, -np.nansum(z) / size  # of the bending direction
    return cos * sideways - sin * ahead if cos > 0.8 else sideways


def _rigid(cluster: Array) -> tuple[Array, Array]:
    """Return a cluster's rotations (F, 3, 3) and centroids (F, 3) against its first whole frame."""
    centre = cluster.mean(axis=1)
    first = int(np.argmax(np.isfinite(cluster).all(axis=(1, 2))))
    shape = cluster[first] - centre[first]
    good = np.isfinite(cluster).all(axis=(1, 2))
    rotation = np.full((len(cluster), 3, 3), np.nan)
    covariance = np.einsum("fka,kb->fab", cluster[good] - centre[good][:, None], shape)
    u, _, v = np.linalg.svd(covariance)
    flip = np.ones((len(u), 3))
    flip[:, 2] = np.linalg.det(u @ v)
    rotation[good] = (u * flip[:, None]) @ v
    return rotation, centre


def common_centre(upper: Array, lower: Array, *, hinge: bool) -> tuple[Array, Array]:
    """Return the point two clusters (F, K, 3) turn about, and their mean axis, (F, 3) each.

    Symmetrical centre of rotation (Ehrig et al. 2006): the point fixed in both that moves least
    between them. Along the axis of a hinge the point is free: it is then the one nearest to the
    clusters. The axis is the direction in the upper cluster that is least determined.
    """
    r1, t1 = _rigid(upper)
    r2, t2 = _rigid(lower)
    good = np.isfinite(r1).all(axis=(1, 2)) & np.isfinite(r2).all(axis=(1, 2))
    design = np.concatenate([r1[good], -r2[good]], axis=2).reshape(-1, 6)
    offset = (t2 - t1)[good].reshape(-1)
    u, size, v = np.linalg.svd(design, full_matrices=False)
    keep = slice(0, 5 if hinge else 6)
    local = v[keep].T @ ((u[:, keep].T @ offset) / size[keep])
    axis = r1 @ unit(v[-1, :3])
    return (r1 @ local[:3] + t1 + r2 @ local[3:] + t2) / 2, axis


def _from_clusters(
    clusters: Mapping[str, Array], hip: Array, right: Array, side: str
) -> tuple[Array, Array, Array]:
    """Return knee, ankle and knee axis from the motion of thigh, shank and foot clusters."""
    thigh, shank, foot = (clusters[f"{n}_{side}"] for n in ("thigh", "shank", "foot"))
    ankle, _ = common_centre(shank, foot, hinge=False)
    knee, axis = common_centre(thigh, shank, hinge=True)
    axis = axis * np.sign(np.nanmedian((axis * right).sum(axis=1)))
    # along its axis the knee lies where hip and ankle lie on average
    slide = np.nanmedian((((hip + ankle) / 2 - knee) * axis).sum(axis=1))
    knee = knee + slide * axis
    return knee, ankle, across(axis, unit(hip - knee))


def arm_joints(
    points: Points, thorax: Array, side: str, leg: float
) -> tuple[Array, Array | None, Array | None, Array | None]:
    """Return shoulder, elbow, wrist and elbow axis (to the right) of one side, (F, 3) or None."""
    sign = 1.0 if side == "r" else -1.0
    span = np.nanmedian(np.linalg.norm(points["acromion_r"] - points["acromion_l"], axis=1))
    shoulder = points[f"acromion_{side}"] - SHOULDER_DROP * span * thorax[..., 1]
    outer = points.get(f"elbow_lateral_{side}")
    wrists = [
        points[f"{name}_{side}"]
        for name in ("wrist_radius", "wrist_ulna")
        if f"{name}_{side}" in points
    ]
    if outer is None or not wrists:
        return shoulder, None, None, None
    wrist = sum(wrists) / len(wrists)
    inner = points.get(f"elbow_medial_{side}")
    if inner is not None:
        elbow = (outer + inner) / 2
        axis = sign * (outer - inner)
    else:
        elbow = outer
        for _ in range(2):
            bone = unit(shoulder - elbow)
            plane = np.cross(-bone, unit(wrist - elbow))
            axis = across(plane + BEND * thorax[..., 2], bone)
            elbow = outer - sign * HALF_ELBOW * leg * axis
    axis = across(axis, unit(shoulder - elbow))
    return shoulder, elbow, wrist, axis
