"""What to draw of a body, and how to bring it onto paper.

Points are (F, P, 3) in m in the world; views give (F, P, 2): across the paper and up.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.body import Body
from motionstyle.body.kinematics import contact_points, end_points, forward_kinematics
from motionstyle.body.layout import CONTACT_POINTS, END_POINTS, NODES
from motionstyle.evaluation.gait import smooth_path, travel_directions
from motionstyle.motion.motion import Motion

Array = NDArray[np.float64]
View = Literal["side", "travel", "oblique"]
# Azimuth and elevation (deg) from which the oblique view looks: from the front right, above.
OBLIQUE_AZIMUTH, OBLIQUE_ELEVATION = 30.0, 15.0


@dataclass(frozen=True)
class Bone:
    """A polyline through named points on the right ("r"), the left ("l") or the trunk ("")."""

    side: str
    points: tuple[str, ...]


def _limbs(side: str) -> tuple[Bone, ...]:
    def own(*names: str) -> Bone:
        return Bone(side, tuple(f"{name}_{side}" for name in names))

    return (
        own("thigh", "shank", "foot"),
        own("foot", "heel", "ball", "toe"),
        own("foot", "ball"),
        own("upper_arm", "forearm", "hand", "fingertip"),
    )


# The far limbs come first, so that the right ones, nearer to the viewer, lie on top.
BONES: tuple[Bone, ...] = (
    *_limbs("l"),
    Bone("", ("pelvis", "abdomen", "thorax", "head")),
    # the head itself is drawn as a circle
    Bone("", ("thigh_r", "pelvis", "thigh_l")),
    Bone("", ("upper_arm_r", "head", "upper_arm_l")),
    *_limbs("r"),
)
STREAMER_POINTS: tuple[str, ...] = ("hand_l", "ball_l", "hand_r", "ball_r")


def named_points(body: Body, coordinates: Array) -> dict[str, Array]:
    """Return the world paths (F, 3) of joints, contact points, mid-balls and end points."""
    pose = forward_kinematics(body, coordinates)
    points = {name: pose.positions[:, i] for i, name in enumerate(NODES)}
    contacts = contact_points(body, pose)
    points |= {name: contacts[:, i] for i, name in enumerate(CONTACT_POINTS)}
    ends = end_points(body, pose)
    points |= {name: ends[:, i] for i, name in enumerate(END_POINTS)}
    for side in "rl":
        points[f"ball_{side}"] = (
            points[f"ball_medial_{side}"] + points[f"ball_lateral_{side}"]
        ) / 2
    return points


def overall_direction(motion: Motion) -> Array:
    """Return the horizontal unit vector from the smoothed path's start to its end.

    If the two lie within 0.2 m of each other it is the direction faced at first.
    """
    path = smooth_path(motion)
    way = path[-1] - path[0]
    if np.linalg.norm(way) < 0.2:
        way = travel_directions(motion)[0]
    return way / np.linalg.norm(way)


def project(motion: Motion, points: Mapping[str, Array], view: View) -> dict[str, Array]:
    """Return the points' places on paper, (F, 2) in m each.

    "side": seen from the right of the overall direction of travel, which points right on paper.
    "travel": the same, but unrolled along the path, for motions that turn: the length travelled
    plus what lies ahead of the pelvis. "oblique": parallel projection from the front right and
    above.
    """
    if view == "travel":
        path, directions = smooth_path(motion), travel_directions(motion)
        steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
        travelled = np.concatenate([[0.0], np.cumsum(steps)])
        return {
            name: np.column_stack(
                [travelled + ((p - path) * [1, 0, 1] * directions).sum(axis=1), p[:, 1]]
            )
            for name, p in points.items()
        }
    forward = overall_direction(motion)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    start = motion.coordinates[0, :3] * [1, 0, 1]
    if view == "side":
        return {n: np.column_stack([(p - start) @ forward, p[:, 1]]) for n, p in points.items()}
    azimuth, elevation = np.radians([OBLIQUE_AZIMUTH, OBLIQUE_ELEVATION])
    across = np.cos(azimuth) * forward - np.sin(azimuth) * right
    away = -np.sin(azimuth) * forward - np.cos(azimuth) * right
    up = np.cos(elevation) * np.array([0.0, 1.0, 0.0]) + np.sin(elevation) * away
    return {n: np.column_stack([(p - start) @ across, (p - start) @ up]) for n, p in points.items()}
