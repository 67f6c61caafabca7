"""Checks of a marker clip against the human body: unit, front and back, right and left, plates."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError
from motionstyle.mocap.datasets.sheet import METRES
from motionstyle.mocap.formats.marker_clip import ForceRecord, MarkerClip
from motionstyle.mocap.markers.joints import pelvis_frame
from motionstyle.mocap.markers.markerset import LANDMARKS, Assigned

Array = NDArray[np.float64]
PELVIS_WIDTH_M = (0.15, 0.42)  # between the ASIS of anyone older than a small child
NEAR_PLATE_M = 1.5  # farther than a foot of a person ever stands from the pelvis
SWAPPED_M = 0.02  # a pair is swapped if its right marker lies this far to the left of the left one
HANGING = 0.5  # least cosine between the vertical and the line from feet to pelvis


def check_size(clip: MarkerClip, assigned: Assigned) -> None:
    """Refuse a clip whose pelvis is no human's size, and say which unit would make it one.

    Raises
    ------
    MotionStyleError
        If the ASIS markers are less than 15 or more than 42 cm apart.
    """
    apart = clip.path(assigned.landmarks["asis_r"]) - clip.path(assigned.landmarks["asis_l"])
    width = float(np.nanmedian(np.linalg.norm(apart, axis=1)))
    low, high = PELVIS_WIDTH_M
    if low <= width <= high:
        return
    now = METRES.get(clip.unit, 1.0)
    fitting = [
        unit
        for unit, metres in METRES.items()
        if unit != "cmu" and low <= width / now * metres <= high
    ]
    suggestion = f": is the unit {' or '.join(fitting)}?" if fitting else "."
    raise MotionStyleError(
        f"{clip.source}: the ASIS markers are {width:.4g} m apart (file read in "
        f"{clip.unit}), expected {low} to {high} m{suggestion} Set the column unit of the sheet"
    )


def check_upright(clip: MarkerClip, assigned: Assigned) -> None:
    """Refuse a clip in which the pelvis is not above the heels: its vertical axis is wrong.

    Raises
    ------
    MotionStyleError
        If the line from heels to pelvis is more than 60° off the vertical on the median.
    """
    found = assigned.landmarks
    pelvis = (clip.path(found["asis_r"]) + clip.path(found["asis_l"])) / 2
    legs = [pelvis - clip.path(found[f"heel_{side}"]) for side in "rl"]
    whole = np.concatenate(legs)
    whole = whole[np.isfinite(whole).all(axis=1)]
    if not len(whole):
        return  # never seen together: measuring the body says so
    line = np.median(whole, axis=0)
    line /= np.linalg.norm(line)
    if line[1] < HANGING:
        axis = "xyz"[int(np.argmax(np.abs(line)))]
        raise MotionStyleError(
            f"{clip.source}: the pelvis is not above the heels ({line[1]:.2f} of the line between "
            f"them is vertical, expected more than {HANGING}); the long axis is {axis} "
            "(after turning the file's up axis to y): check the column up_axis of the sheet"
        )


def check_front(clip: MarkerClip, assigned: Assigned) -> None:
    """Refuse a clip whose feet point to the back of its pelvis: front and back are swapped.

    Raises
    ------
    MotionStyleError
        If both feet do on the median.
    """
    points = {name: clip.path(label) for name, label in assigned.landmarks.items()}
    forward = _pelvis_forward(points)
    backward = []
    for side in "rl":
        found = [points.get(f"{name}_{side}") for name in ("toe", "mtp_lateral", "mtp_medial")]
        toe = next(path for path in found if path is not None)
        foot = (toe - points[f"heel_{side}"]) * [1, 0, 1]
        cosine = (foot * forward).sum(axis=1)
        cosine /= np.linalg.norm(foot, axis=1) * np.linalg.norm(forward, axis=1)
        backward.append(np.isfinite(cosine).any() and np.nanmedian(cosine) < -HANGING)
    if all(backward):
        front, back = (
            " and ".join(f"'{assigned.landmarks[n]}'" for n in names if n in assigned.landmarks)
            for names in (("asis_r", "asis_l"), ("psis_r", "psis_l", "sacrum"))
        )
        raise MotionStyleError(
            f"{clip.source}: both feet point to the back of the pelvis: its front markers {front} "
            f"and its back ones {back} are exchanged, or those of heels and toes; exchange the "
            "labels in the file, or in the marker set"
        )


def _pelvis_forward(points: Mapping[str, Array]) -> Array:
    """Return horizontal vectors from the back of the pelvis to its front, (F, 3)."""
    front = (points["asis_r"] + points["asis_l"]) / 2
    back = points.get("sacrum")
    if back is None:
        back = (points["psis_r"] + points["psis_l"]) / 2
    return (front - back) * [1, 0, 1]


def check_plates(clip: MarkerClip, assigned: Assigned, record: ForceRecord) -> None:
    """Refuse plates that are loaded far from the person: the unit of their centres is wrong.

    Raises
    ------
    MotionStyleError
        If the loaded plates' centres of pressure lie more than 1.5 m beside the pelvis on the
        median over the clip.
    """
    found = assigned.landmarks
    pelvis = (clip.path(found["asis_r"]) + clip.path(found["asis_l"])) / 2
    frames = np.round((record.times - clip.start_s) * clip.rate_hz).astype(int)
    during = (frames >= 0) & (frames < clip.frames)
    away = (record.centre[:, during] - pelvis[frames[during]])[..., [0, 2]]
    away = np.linalg.norm(away, axis=-1)
    away = away[np.isfinite(away)]
    if not len(away) or np.median(away) <= NEAR_PLATE_M:
        return
    raise MotionStyleError(
        f"{record.source}: the centre of pressure lies {np.median(away):.3g} m beside the pelvis "
        f"on the median while a plate is loaded, expected at most {NEAR_PLATE_M} m: check `unit` "
        "(m or mm) of this file's plates under `forces` of the marker set, and that plates and "
        "markers share one laboratory frame"
    )


def check_sides(clip: MarkerClip, assigned: Assigned) -> None:
    """Refuse a clip in which right markers lie to the left of their left partners.

    Anatomical forward is from the back of the pelvis to its front, and right follows from it.

    Raises
    ------
    MotionStyleError
        Naming every swapped pair.
    """
    points = {name: clip.path(label) for name, label in assigned.landmarks.items()}
    right = np.cross(_pelvis_forward(points), [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    swapped = []
    for landmark in LANDMARKS:
        other = landmark[:-1] + "l"
        if not landmark.endswith("_r") or landmark not in points or other not in points:
            continue
        offset = ((points[landmark] - points[other]) * right).sum(axis=1)
        if np.isfinite(offset).any() and np.nanmedian(offset) < -SWAPPED_M:
            one, two = assigned.landmarks[landmark], assigned.landmarks[other]
            swapped.append(f"'{one}' lies {-100 * np.nanmedian(offset):.0f} cm left of '{two}'")
    if swapped:
        raise MotionStyleError(
            f"{clip.source}: right and left are swapped: {'; '.join(swapped)} "
            "(right of the direction from the back of the pelvis to its front); exchange the "
            "labels in the file, or in the marker set"
        )


def check_clip_of_person(clip: MarkerClip, assigned: Assigned) -> None:
    """Run all checks of a clip in metres with y up."""
    check_upright(clip, assigned)
    check_front(clip, assigned)
    check_size(clip, assigned)
    check_sides(clip, assigned)


def heading(clip: MarkerClip, assigned: Assigned) -> Array:
    """Return the horizontal unit vector the pelvis faces in its first complete frame, (3,)."""
    points = {name: clip.path(label) for name, label in assigned.landmarks.items()}
    axes = pelvis_frame(points)
    seen = np.flatnonzero(np.isfinite(axes).all(axis=(1, 2)))
    if not len(seen):
        raise MotionStyleError(
            f"{clip.source}: the pelvis' markers are never seen together; expected at least a frame"
        )
    right = axes[seen[0], :, 2] * [1, 0, 1]
    return np.cross([0.0, 1.0, 0.0], right / np.linalg.norm(right))
