"""One marker clip to one kinematic `Motion`: read, check, measure, place, fit, ground.

The order: labels → unit, axes, sides → belt of a treadmill → body from the static trial or the
clip → origin → gaps and low-pass → fit → marker offsets once more → fit → contacts → legs to the
ground. What was found is in the report, as `skeletons.ingest.Ingested` has it.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.anthropometry import Sex
from motionstyle.body.body import build_body
from motionstyle.body.kinematics import contact_points, forward_kinematics
from motionstyle.errors import MotionStyleError
from motionstyle.mocap.datasets.sheet import ClipRow
from motionstyle.mocap.fitting.contacts import detect_contacts, ground_height
from motionstyle.mocap.fitting.retarget import fit_legs_to_ground, make_continuous
from motionstyle.mocap.fitting.virtual_markers import VirtualMarkers, marker_distances
from motionstyle.mocap.formats.c3d import read_c3d, read_c3d_forces
from motionstyle.mocap.formats.marker_clip import (
    ForceRecord,
    MarkerClip,
    scaled,
    upright,
    upright_forces,
)
from motionstyle.mocap.formats.mot import check_signs, forces_from_mot, read_mot
from motionstyle.mocap.formats.trc import UNITS, read_trc
from motionstyle.mocap.markers.body import measure_markers, with_trunk_of
from motionstyle.mocap.markers.checks import check_clip_of_person, check_plates, heading
from motionstyle.mocap.markers.fit import (
    fit_markers,
    marker_targets,
    observed_coordinates,
    start_coordinates,
)
from motionstyle.mocap.markers.joints import hip_centres
from motionstyle.mocap.markers.markerset import Assigned, MarkerSet, assign_labels, read_marker_set
from motionstyle.mocap.markers.paths import Placement, belt_velocity
from motionstyle.mocap.settings import RetargetSettings, by_action
from motionstyle.mocap.skeletons.ingest import Ingested, frame_window, provenance
from motionstyle.motion.markers import MarkerPaths
from motionstyle.motion.motion import Motion

Array = NDArray[np.float64]
UP = np.array([0.0, 1.0, 0.0])
# A point this far beside a plate still stands on it, and so does one this far below its surface.
BESIDE_PLATE_M, BELOW_PLATE_M = 0.02, 0.06


def read_markers(row: ClipRow, path: str | Path, markers: MarkerSet) -> MarkerClip:
    """Read a TRC or C3D file in metres with y up, by its suffix and the sheet.

    Raises
    ------
    MotionStyleError
        For another suffix, and whatever the readers refuse.
    """
    path = Path(path)
    reader = {".trc": read_trc, ".c3d": read_c3d}.get(path.suffix.lower())
    if reader is None:
        raise MotionStyleError(f"{path}: suffix '{path.suffix}'; supported are .trc and .c3d")
    clip = reader(path)
    if row.rate_hz:
        clip = replace(clip, rate_hz=row.rate_hz)
    if row.metres_per_unit:
        clip = scaled(clip, row.metres_per_unit / UNITS[clip.unit])
        clip = replace(clip, unit=row.unit or clip.unit)
    return upright(clip, row.up_axis or markers.up_axis)


def read_forces(path: str | Path, markers: MarkerSet, up_axis: str | None = None) -> ForceRecord:
    """Read the force plates of a .mot, .sto or .c3d file with y up, by a marker set.

    Raises
    ------
    MotionStyleError
        If the file has no plates, the set does not describe them, or a sign is flipped.
    """
    path = Path(path)
    plates = markers.plates(path)
    if path.suffix.lower() == ".c3d":
        record = read_c3d_forces(path)
        if record is None:
            raise MotionStyleError(f"{path}: the file has no force plates; clear the column forces")
        record = upright_forces(record, up_axis or markers.up_axis)
    else:
        table = read_mot(path)
        record = forces_from_mot(table, plates.columns, position_unit=plates.position_unit)
    check_signs(record, 1)
    return record


def ingest_markers(
    row: ClipRow,
    path: str | Path,
    markersets: str | Path,
    settings: RetargetSettings,
    *,
    static_file: str | Path | None = None,
    forces_file: str | Path | None = None,
    default_mass_kg: float,
    default_sex: Sex,
) -> Ingested:
    """Turn one marker clip into a kinematic motion (nio.md §3, A1, A2).

    Parameters
    ----------
    row : the clip's row in the sheet; `skeleton` names the marker set. path : its file, or a copy.
    markersets : folder of marker sets. settings : from the configuration.
    static_file : trial that shows all landmarks, of the same person; without one the clip itself
        tells the lengths.
    forces_file : force plates; only their sign and the heights of C3D plates are used.
    default_mass_kg, default_sex : where the row gives none. The mass never comes from plates.

    Raises
    ------
    MotionStyleError
        If a file is malformed or implausible, or does not fit the marker set.
    """
    markers = read_marker_set(markersets, row.skeleton or "")
    clip = read_markers(row, path, markers)
    clip = clip.window(*frame_window(row, clip.frames, clip.source))
    assigned = assign_labels(clip, markers)
    check_clip_of_person(clip, assigned)
    record = read_forces(forces_file, markers, row.up_axis) if forces_file else None
    if record is not None:
        check_plates(clip, assigned, record)
    sex: Sex = row.sex or default_sex
    thresholds = by_action(settings.thresholds, row.action)
    belt = belt_velocity(clip, assigned) if markers.on_treadmill(row.path) else np.zeros(3)
    placement = _placement(clip, assigned, belt)
    clip = placement.clip(clip)
    support = None
    if record is not None:
        record = placement.forces(record)
        support = _support(clip, assigned, record) if row.surface != "level" else None
    if static_file is None:
        person = measure_markers(clip, assigned, markers, sex, thresholds, support)
    else:
        still = read_markers(replace(row, rate_hz=None), static_file, markers)
        known = assign_labels(still, markers)
        check_clip_of_person(still, known)
        person = measure_markers(still, known, markers, sex, thresholds)
        leg = build_body(person.geometry, 1.0, sex).leg_length
        person = with_trunk_of(person, clip, assigned, leg, sex)
    mass = default_mass_kg if row.mass_kg is None else row.mass_kg
    source = "default" if row.mass_kg is None else "sheet"
    body = build_body(person.geometry, mass, sex, mass_source=source)
    cutoff = by_action(settings.cutoff_hz, row.action)
    observed = observed_coordinates(assigned)
    paths, virtual, seen = marker_targets(clip, assigned, person, cutoff)
    start = start_coordinates(clip, assigned, person, observed)
    coordinates, virtual = fit_markers(body, virtual, seen, start, observed)
    level = row.surface == "level"
    points = contact_points(body, forward_kinematics(body, coordinates))
    ground = ground_height(points, clip.rate_hz, thresholds, level=level)
    if record is not None and not level:
        ground = _plate_height(points, record, ground)
    contacts = detect_contacts(points, clip.rate_hz, thresholds, ground)
    coordinates = fit_legs_to_ground(
        body, virtual, coordinates, contacts, ground, clip.rate_hz, cutoff
    )
    coordinates, rebranched = make_continuous(coordinates)
    distances = marker_distances(body, replace(virtual, world=paths), coordinates)
    distances[~seen] = np.nan
    first = row.first_frame or 0
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
        provenance={
            **provenance(row),
            "source_frames": f"{first}-{first + clip.frames - 1}",
            "measured_on": Path(person.source).name,
            "placement": placement.to_json(),
        },
    )
    report = {
        "marker_rms_cm": 100 * float(np.sqrt(np.nanmean(distances**2))),
        "markers_missing_pct": 100 * float(1.0 - seen.mean()),
        "floor_tilt_deg": 0.0,
        "floor_stances": 0,
        "belt_mps": float(np.linalg.norm(belt)),
        "rebranched_frames": len(rebranched),
        "repaired_frames": 0,
        "warnings": _remarks(clip, virtual.names, seen),
    }
    rms = 100 * np.sqrt(np.nanmean(distances**2, axis=0))
    by_name = {n: float(r) for n, r in zip(virtual.names, rms, strict=True)}
    return Ingested(motion, report, by_name, _measured(virtual, paths, clip.rate_hz))


def _measured(virtual: VirtualMarkers, paths: Array, rate_hz: float) -> MarkerPaths:
    """Return the measured markers on the body, for the physics fit."""
    return MarkerPaths(
        names=virtual.names,
        nodes=virtual.nodes,
        local=virtual.local,
        measured=paths,
        smooth=virtual.world,
        weights=virtual.weights[..., 0],
        rate_hz=rate_hz,
    )


def placed_forces(motion: Motion, path: str | Path, markers: MarkerSet) -> ForceRecord:
    """Return the plates of a clip in its motion's frame and clock: y up, t = 0 at frame 0.

    Raises
    ------
    MotionStyleError
        As `read_forces`, and if the motion does not come from markers.
    """
    placement = motion.provenance.get("placement")
    if placement is None:
        raise MotionStyleError(f"motion {motion.id}: it does not come from a marker file")
    return Placement.from_json(placement).forces(read_forces(path, markers))


def _placement(clip: MarkerClip, assigned: Assigned, belt: Array) -> Placement:
    """Return the move that makes the clip face +x and start over the origin; heights stay."""
    forward = heading(clip, assigned)
    rotation = np.stack([forward, UP, np.cross(forward, UP)])
    points = {name: clip.path(label) for name, label in assigned.landmarks.items()}
    middle = sum(hip_centres(points).values()) / 2
    first = middle[np.flatnonzero(np.isfinite(middle).all(axis=1))[0]]
    return Placement(rotation, -(rotation @ first) * [1, 0, 1], belt, clip.start_s)


def _support(clip: MarkerClip, assigned: Assigned, record: ForceRecord) -> Array | None:
    """Return the height of the plate under the lower foot per frame, (F,), or None off plates."""
    if record.corners is None:
        return None
    feet = []
    for side in "rl":
        labels = [assigned.landmarks.get(f"{n}_{side}") for n in ("heel", "toe", "mtp_lateral")]
        feet.append(np.mean([clip.path(x) for x in labels if x is not None], axis=0))
    lower = np.where((feet[0][:, 1] < feet[1][:, 1])[:, None], feet[0], feet[1])
    return _plate_height(lower[:, None], record, np.zeros((clip.frames, 1)))[:, 0]


def _plate_height(points: Array, record: ForceRecord, elsewhere: Array) -> Array:
    """Return the height of the highest plate below points (F, P, 3), or `elsewhere` (F, P), m."""
    if record.corners is None:
        return elsewhere
    height = np.full(points.shape[:2], -np.inf)
    for corners in record.corners:
        low, high = corners.min(axis=0), corners.max(axis=0)
        inside = (points >= low - BESIDE_PLATE_M) & (points <= high + BESIDE_PLATE_M)
        over = inside[..., 0] & inside[..., 2] & (points[..., 1] > high[1] - BELOW_PLATE_M)
        height = np.where(over, np.maximum(height, high[1]), height)
    return np.where(np.isfinite(height), height, elsewhere)


def _remarks(clip: MarkerClip, names: tuple[str, ...], seen: NDArray[np.bool_]) -> str:
    """Return which markers are missing in more than a tenth of the frames."""
    share = 1.0 - seen.mean(axis=0)
    worst = [f"{n} {100 * s:.0f} %" for n, s in zip(names, share, strict=True) if s > 0.1]
    return f"missing: {', '.join(worst)} of {clip.frames} frames" if worst else ""
