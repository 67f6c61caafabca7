"""One clip file to one kinematic `Motion`: read, check, level, fit, ground.

The order: units and axes → known defects → plausibility → floor → body → virtual markers →
low-pass → fit → contacts → legs to the ground. Everything that was found or corrected on the way
is in the report, which becomes a row of `tables/clips.csv`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.anthropometry import Sex
from motionstyle.body.body import build_body
from motionstyle.body.kinematics import contact_points, forward_kinematics
from motionstyle.body.layout import COORDINATE_NODE, NODES
from motionstyle.body.rotations import exponential, shortest_arc
from motionstyle.errors import MotionStyleError
from motionstyle.mocap.datasets.sheet import ClipRow
from motionstyle.mocap.fitting.body_fit import (
    LOWEST_BALL,
    NodeFrames,
    foot_length,
    measure_body,
    node_frames,
)
from motionstyle.mocap.fitting.contacts import detect_contacts, ground_height
from motionstyle.mocap.fitting.floor import FloorFit, StanceThresholds, fit_floor, move_clip
from motionstyle.mocap.fitting.retarget import (
    copied_angles,
    fit_coordinates,
    fit_legs_to_ground,
    make_continuous,
)
from motionstyle.mocap.fitting.virtual_markers import marker_distances, place_markers
from motionstyle.mocap.formats.clip import SkeletonClip
from motionstyle.mocap.formats.readers import read_clip
from motionstyle.mocap.settings import RetargetSettings, by_action
from motionstyle.mocap.skeletons.checks import check_clip
from motionstyle.mocap.skeletons.skeleton_map import (
    SkeletonMap,
    check_joints,
    read_skeleton_map,
    restore_offsets,
)
from motionstyle.motion.markers import MarkerPaths
from motionstyle.motion.motion import Motion
from motionstyle.motion.resample import lowpass

Array = NDArray[np.float64]
UP = np.array([0.0, 1.0, 0.0])
FEWEST_FRAMES = 8
LYING_ACTIONS = ("roll", "crawl", "getup", "cartwheel", "backflip")
# A ball joint's height above a level floor that can be taken as it is (m); elsewhere the floor
# is put below the ball by its usual height.
PLAUSIBLE_BALL_M = 0.06


@dataclass(frozen=True)
class Ingested:
    """A motion and what was found on the way to it.

    report : numbers and texts by column of `tables/clips.csv`; lengths in the unit of their
    suffix. marker_rms_cm : by marker name, for the figure of the fit. markers : measured ones
    of a marker clip, for the physics fit.
    """

    motion: Motion
    report: dict[str, Any]
    marker_rms_cm: dict[str, float]
    markers: MarkerPaths | None = None


def ingest_clip(
    row: ClipRow,
    path: str | Path,
    skeletons: str | Path,
    settings: RetargetSettings,
    *,
    skeleton_file: str | Path | None = None,
    default_mass_kg: float,
    default_sex: Sex,
) -> Ingested:
    """Turn one clip file into a kinematic motion (nio.md §3, A1, A2).

    Parameters
    ----------
    row : the clip's row in the sheet. path : its file, or a copy.
    skeletons : folder of skeleton maps. settings : from the configuration.
    skeleton_file : ASF or URDF of formats that keep the skeleton apart.
    default_mass_kg, default_sex : where the row gives none.

    Raises
    ------
    MotionStyleError
        If the file is malformed or implausible, or is not of the row's skeleton.
    """
    skeleton = read_skeleton_map(skeletons, row.skeleton)
    clip = read_clip(path, skeleton_file=skeleton_file, rate_hz=row.rate_hz, cycles=row.cycles)
    clip = _in_metres_and_upright(clip.window(*frame_window(row, clip.frames, clip.source)), row)
    check_joints(clip, skeleton)
    clip = restore_offsets(clip, skeleton.offsets_like)
    clip, warnings = check_clip(
        clip,
        unit_m=row.metres_per_unit or 1.0,
        lying=row.action.split("-")[0] in LYING_ACTIONS,
        repair=settings.repair,
    )
    thresholds = by_action(settings.thresholds, row.action)
    sex: Sex = row.sex or default_sex
    level = row.surface == "level"
    clip, floor = _onto_floor(clip, skeleton, settings, thresholds, sex, level=level)
    frames = node_frames(clip, skeleton)
    geometry, frames = measure_body(frames, sex, clip.rate_hz, thresholds)
    body = build_body(
        geometry,
        row.mass_kg or default_mass_kg,
        sex,
        mass_source="sheet" if row.mass_kg else "default",
    )
    seen = set(skeleton.joints)
    observed = np.array([NODES[node] in seen for node in COORDINATE_NODE])
    markers = place_markers(frames, body, seen)
    cutoff = by_action(settings.cutoff_hz, row.action)
    smooth = replace(markers, world=lowpass(markers.world, clip.rate_hz, cutoff))
    start, _ = make_continuous(copied_angles(frames, observed))
    coordinates = fit_coordinates(body, smooth, start, observed)
    points = contact_points(body, forward_kinematics(body, coordinates))
    ground = ground_height(points, clip.rate_hz, thresholds, level=level)
    contacts = detect_contacts(points, clip.rate_hz, thresholds, ground)
    coordinates = fit_legs_to_ground(
        body, smooth, coordinates, contacts, ground, clip.rate_hz, cutoff
    )
    coordinates, rebranched = make_continuous(coordinates)
    distances = marker_distances(body, markers, coordinates)
    rms = np.sqrt((distances**2).mean(axis=0))
    motion = Motion(
        id=row.id,
        kind="captured",
        rate_hz=clip.rate_hz,
        coordinates=coordinates,
        body=body,
        contacts=contacts,
        contact_normals=np.broadcast_to(UP, (*contacts.shape, 3)).copy(),
        observed=observed,
        rebranched=rebranched,
        provenance={**provenance(row), "source_frames": _source_frames(row, clip)},
    )
    report = {
        "marker_rms_cm": 100 * float(np.sqrt((distances**2).mean())),
        "floor_tilt_deg": floor.tilt_deg,
        "floor_stances": floor.contacts,
        "rebranched_frames": len(rebranched),
        "repaired_frames": sum(len(w.frames) for w in warnings if w.kind == "repaired"),
        "warnings": "; ".join(f"{w.kind}: {w.message}" for w in warnings),
    }
    by_name = {n: 100 * float(r) for n, r in zip(markers.names, rms, strict=True)}
    return Ingested(motion, report, by_name)


def frame_window(row: ClipRow, frames: int, source: str) -> tuple[int, int]:
    """Return the first and last frame that the sheet asks for, of a file with `frames` frames.

    Raises
    ------
    MotionStyleError
        If the file ends before the last one, or too few are left.
    """
    first = row.first_frame or 0
    last = frames - 1 if row.last_frame is None else row.last_frame
    if last >= frames:
        raise MotionStyleError(
            f"{row.id}: last_frame is {last}, but {source} has frames 0 to {frames - 1}"
        )
    if last - first + 1 < FEWEST_FRAMES:
        raise MotionStyleError(
            f"{row.id}: frames {first} to {last} of {source} are {max(0, last - first + 1)} "
            f"frames; a motion needs at least {FEWEST_FRAMES}"
        )
    return first, last


def _in_metres_and_upright(clip: SkeletonClip, row: ClipRow) -> SkeletonClip:
    """Return the clip in metres with y up."""
    scale = row.metres_per_unit or 1.0
    clip = replace(clip, positions=clip.positions * scale, rest_offsets=clip.rest_offsets * scale)
    if row.up_axis == "z":
        turn = exponential(np.array([-np.pi / 2, 0.0, 0.0]))
        moved = move_clip(clip, turn, np.zeros(3))
        # the zero pose turns too, so that joint frames stay the identity in it
        return replace(
            moved,
            rotations=moved.rotations @ turn.T,
            rest_offsets=clip.rest_offsets @ turn.T,
        )
    return clip


def _onto_floor(
    clip: SkeletonClip,
    skeleton: SkeletonMap,
    settings: RetargetSettings,
    thresholds: StanceThresholds,
    sex: Sex,
    *,
    level: bool,
) -> tuple[SkeletonClip, FloorFit]:
    """Return the clip on a level floor y = 0, facing +x and starting over the origin."""
    frames = node_frames(clip, skeleton)
    balls = np.stack([_front_of_foot(frames, side) for side in "rl"], axis=1)
    floor = fit_floor(
        balls, clip.rate_hz, thresholds, level=level, shortest_span_m=settings.shortest_span_m
    )
    tilted = settings.smallest_tilt_deg <= floor.tilt_deg
    if floor.tilt_deg > settings.largest_tilt_deg:
        raise MotionStyleError(
            f"{clip.source}: the feet stand on a slope of {floor.tilt_deg:.1f}°, more than the "
            f"{settings.largest_tilt_deg:g}° a level floor may seem tilted; set surface to ramp, "
            "stairs or uneven in the sheet, or check up_axis"
        )
    upright = shortest_arc(floor.normal, UP) if tilted else np.eye(3)
    right = upright @ (frames.positions["thigh_r"][0] - frames.positions["thigh_l"][0])
    right = right * [1, 0, 1] / np.linalg.norm(right * [1, 0, 1])
    facing = np.column_stack([np.cross(UP, right), UP, right])
    turn = facing.T @ upright
    height = float((turn @ (floor.offset * UP))[1])
    toes = "toes_r" in skeleton.joints
    leg = np.linalg.norm(
        np.diff([frames.positions[f"{n}_r"][0] for n in ("thigh", "shank", "foot")], axis=0), axis=1
    ).sum()
    length = foot_length(float(leg), sex)
    lowest = LOWEST_BALL * length if toes else 0.0
    usual = 0.1 * length if toes else 0.0
    above = height if lowest <= height <= PLAUSIBLE_BALL_M and not tilted else usual
    shift = -(turn @ frames.positions["pelvis"][0]) * [1, 0, 1] - [0, height - above, 0]
    return move_clip(clip, turn, shift), floor


def _front_of_foot(frames: NodeFrames, side: str) -> Array:
    """Return the path of the ball joint, or of the foot's front end where there are no toes."""
    front = frames.positions.get(f"toes_{side}")
    return frames.ends[f"foot_front_{side}"] if front is None else front


def provenance(row: ClipRow) -> dict[str, Any]:
    """Return what the sheet says about a clip, for the motion's sidecar."""
    return {
        "dataset": row.dataset or "own",
        "source": row.path,
        "subject": row.subject or "",
        "action": row.action,
        "style": row.style or "",
        "surface": row.surface,
        "experiments": list(row.experiments),
        "level": "kinematic",
        "planted": False,
    }


def _source_frames(row: ClipRow, clip: SkeletonClip) -> str:
    """Return the frames of the file that the motion shows, such as "1-277".

    A looping clip that is run through several times shows the frames of one cycle.
    """
    first = row.first_frame or 0
    frames = (clip.frames - 1) // row.cycles + 1 if row.cycles > 1 else clip.frames
    return f"{first}-{first + frames - 1}"
