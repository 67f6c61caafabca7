"""Driving a synthetic dancer by another signal (E7, appendix E): silhouettes and 2-D points.

The cue is made from captured motion: low-order moments of a rendered silhouette, or noisy 2-D
projections of a few body points, as one fixed camera that follows the pelvis would see them. The
last part of every dance is held out; the baseline looks up the nearest cue frame.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from motionstyle.body.kinematics import contact_points, end_points
from motionstyle.body.layout import NODE_INDEX, PARENTS
from motionstyle.motion.motion import Motion
from motionstyle.shmm.features import pose_channels
from motionstyle.shmm.machine import (
    MachineSettings,
    MotionMachine,
    learn_machine,
    motion_from,
    prepared,
)
from motionstyle.shmm.path_map import cue_model, drive
from motionstyle.shmm.poses import styled_poses, synthesise

Array = NDArray[np.float64]
PATH_MAP_COLUMNS = (
    *("config", "data", "cue", "method", "dance", "style", "frames", "joint_rms_deg", "restyled"),
)
PIXELS, HALF_WIDTH_M = 64, 1.3
SAMPLES_A_BONE = 12
CAMERA_AZIMUTH_DEG = 30.0


def camera_points(motion: Motion, points: Array) -> Array:
    """Return points (F, P, 3) as a fixed camera sees them about the pelvis, (F, P, 2), m."""
    angle = np.radians(CAMERA_AZIMUTH_DEG)
    across = np.array([np.cos(angle), 0.0, np.sin(angle)])
    centre = motion.coordinates[:, :3] * [1, 0, 1]
    relative = points - centre[:, None]
    return np.stack([relative @ across, relative[..., 1]], axis=-1)


def body_points(motion: Motion) -> Array:
    """Return points along all segments, with their ends, (F, P, 3)."""
    pose = motion.pose()
    joints = pose.positions
    parts = []
    for node, parent in enumerate(PARENTS):
        if parent >= 0:
            share = np.linspace(0, 1, SAMPLES_A_BONE)[None, :, None]
            parts.append(joints[:, [parent]] * (1 - share) + joints[:, [node]] * share)
    return np.concatenate(
        [*parts, contact_points(motion.body, pose), end_points(motion.body, pose)], axis=1
    )


def silhouettes(motion: Motion) -> NDArray[np.bool_]:
    """Return coarse silhouettes (F, 64, 64): pixels within a limb's thickness of a segment."""
    flat = camera_points(motion, body_points(motion))
    flat = flat - [0.0, 0.95]
    cell = 2 * HALF_WIDTH_M / PIXELS
    index = np.floor((flat + HALF_WIDTH_M) / cell).astype(int)
    inside = ((index >= 0) & (index < PIXELS)).all(axis=-1)
    image = np.zeros((motion.frames, PIXELS, PIXELS), dtype=bool)
    frame = np.broadcast_to(np.arange(motion.frames)[:, None], inside.shape)
    image[frame[inside], index[..., 1][inside], index[..., 0][inside]] = True
    for axis in (1, 2):  # a limb is some 10 cm thick
        image |= np.roll(image, 1, axis=axis) | np.roll(image, -1, axis=axis)
    return image


def silhouette_moments(images: NDArray[np.bool_]) -> Array:
    """Return area, centre and central moments to the third order of silhouettes, (F, 10)."""
    grid = (np.arange(PIXELS) + 0.5) / PIXELS * 2 - 1
    area = np.maximum(images.sum(axis=(1, 2)), 1).astype(float)
    x = (images.sum(axis=1) * grid).sum(axis=1) / area
    y = (images.sum(axis=2) * grid).sum(axis=1) / area
    found = [area / PIXELS**2, x, y]
    for p, q in ((2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3)):
        columns = (grid[None] - x[:, None]) ** p
        rows = (grid[None] - y[:, None]) ** q
        moment = np.einsum("fij,fi,fj->f", images.astype(float), rows, columns) / area
        found.append(np.cbrt(moment) if p + q == 3 else moment)
    return np.stack(found, axis=1)


def point_cue(motion: Motion, noise_m: float, seed: int) -> Array:
    """Return noisy 2-D places of hands, feet, head and knees, (F, 14), m."""
    pose = motion.pose()
    names = ("hand_r", "hand_l", "foot_r", "foot_l", "head", "shank_r", "shank_l")
    nodes = [NODE_INDEX[n] for n in names]
    flat = camera_points(motion, pose.positions[:, nodes]).reshape(motion.frames, -1)
    return flat + np.random.default_rng(seed).normal(0, noise_m, flat.shape)


def with_speed(cue: Array) -> Array:
    """Return a cue with its first difference, which tells the way from its reverse, (F, 2C)."""
    return np.concatenate([cue, np.gradient(cue, axis=0) * 5.0], axis=1)


def cue_of(motion: Motion, kind: str, noise_m: float, seed: int) -> Array:
    """Return the cue of a motion: "silhouette" or "points"."""
    if kind == "silhouette":
        cue = silhouette_moments(silhouettes(motion))
        cue = median_filter(cue, size=(5, 1), mode="nearest")  # pixels flicker
    else:
        cue = point_cue(motion, noise_m, seed)
    return with_speed(cue)


def driving_rows(
    dances: Sequence[Motion],
    settings: MachineSettings,
    options: Mapping[str, float],
    facts: Mapping[str, object],
) -> tuple[list[dict[str, object]], list[tuple[str, Motion]], MotionMachine]:
    """Return the rows of `path_map.csv`, and what was driven: truth, driven, restyled.

    Each dance's last part is unseen; one machine is learnt from the first parts of all.
    """
    ready = [prepared(m, settings) for m in dances]
    cut = [max(2, int(m.frames * (1 - options["hold_out_share"]))) for m in ready]
    seen = [m.window(0, c - 1) for m, c in zip(ready, cut, strict=True)]
    unseen = [m.window(c, m.frames - 1) for m, c in zip(ready, cut, strict=True)]
    longest = max(m.frames for m in seen)
    settings = replace(settings, states=min(settings.states, longest // 2))
    machine = learn_machine(seen, [m.id for m in seen], settings)
    rows: list[dict[str, object]] = []
    shown: list[tuple[str, Motion]] = []
    for kind in ("silhouette", "points"):
        cues = [cue_of(m, kind, options["points_noise_m"], k) for k, m in enumerate(seen)]
        centre = np.concatenate(cues).mean(axis=0)
        spread = np.maximum(np.concatenate(cues).std(axis=0), 1e-9)
        scaled = [(c - centre) / spread for c in cues]
        model = cue_model(machine.machine.generic, scaled, machine.machine.occupancy)
        library = np.concatenate([pose_channels(m) for m in seen])
        everything = np.concatenate(scaled)
        for k, motion in enumerate(unseen):
            cue = (cue_of(motion, kind, options["points_noise_m"], 100 + k) - centre) / spread
            occupancy = drive(model, cue)
            answers = {"path_map": k, "path_map_restyled": (k + 1) % len(seen)}
            for method, style in answers.items():
                poses = styled_poses(machine.poses, np.eye(len(machine.names))[style])
                channels = synthesise(machine.poses, occupancy, poses)
                driven = motion_from(f"{motion.id}-{kind}-{method}", channels, machine)
                rows.append(
                    _row(motion, driven.coordinates, kind, method, facts, machine.names[style])
                )
                if kind == "silhouette" and k == 0:
                    shown.append((method, driven))
            nearest = np.array([((everything - one) ** 2).sum(axis=1).argmin() for one in cue])
            found = np.concatenate([np.zeros((len(cue), 6)), library[nearest][:, :29]], axis=1)
            rows.append(_row(motion, found, kind, "nearest_neighbour", facts, ""))
    return rows, [("truth", unseen[0]), *shown], machine


def _row(
    truth: Motion,
    coordinates: Array,
    cue: str,
    method: str,
    facts: Mapping[str, object],
    style: str,
) -> dict[str, object]:
    difference = coordinates[:, 6:] - truth.coordinates[:, 6:]
    difference = difference[:, truth.observed[6:]]
    return {
        **facts,
        "cue": cue,
        "method": method,
        "dance": truth.id,
        "style": style,
        "frames": truth.frames,
        "joint_rms_deg": float(np.degrees(np.sqrt((difference**2).mean()))),
        "restyled": method.endswith("restyled"),
    }
