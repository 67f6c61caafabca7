"""One marker clip to one kinematic `Motion`: read, check, measure, place, fit, ground.

The order: labels → unit, axes, sides → belt of a treadmill → body from the static trial or the
clip → origin → gaps and low-pass → fit → marker offsets once more → fit → contacts → legs to the
ground. What was found is in the report, as `ingest.Ingested` has it.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.anthropometry import Sex
from motionstyle.body.body import Body, build_body
from motionstyle.body.kinematics import contact_points, forward_kinematics
from motionstyle.body.layout import COORDINATE_INDEX, COORDINATE_NODE, COORDINATES, NODE_INDEX, NODES
from motionstyle.body.rotations import logarithm
from motionstyle.errors import MotionStyleError
from motionstyle.mocap.c3d import read_c3d, read_c3d_forces
from motionstyle.mocap.contacts import detect_contacts, ground_height
from motionstyle.mocap.ingest import FEWEST_FRAMES, Ingested, provenance
from motionstyle.mocap.marker_body import MarkerBody, measure_markers
from motionstyle.mocap.marker_checks import check_clip_of_person, heading
from motionstyle.mocap.marker_clip import (
    ForceRecord,
    MarkerClip,
    scaled,
    upright,
    upright_forces,
)
from motionstyle.mocap.marker_joints import hip_centres, pelvis_frame
from motionstyle.mocap.marker_paths import Placement, belt_velocity, fill_gaps, smooth_paths
from motionstyle.mocap.markers import VirtualMarkers, marker_distances
from motionstyle.mocap.markerset import Assigned, MarkerSet, assign_labels, read_marker_set
from motionstyle.mocap.mot import check_signs, forces_from_mot, read_mot
from motionstyle.mocap.retarget import fit_coordinates, fit_legs_to_ground, make_continuous
from motionstyle.mocap.settings import RetargetSettings, by_action
from motionstyle.mocap.sheet import ClipRow
from motionstyle.mocap.trc import UNITS, read_trc
from motionstyle.motion.motion import Motion

Array = NDArray[np.float64]
UP = np.array([0.0, 1.0, 0.0])
# What a marker weighs: on bone 1, on muscle or a limb the body cannot turn with, less.
CLUSTER_WEIGHT = 0.5
LANDMARK_WEIGHT = {"acromion": 0.5, "wrist_radius": 0.5, "wrist_ulna": 0.5, "finger": 0.2}
# How many markers show a node, at least; arms and legs need fewer as their joints add the rest.
ENOUGH = {"thorax": 3, "head": 3}
STANDS_LOW_M = 0.03  # a foot within this of a plate or stair is taken to stand on it


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
    clip = _windowed(read_markers(row, path, markers), row)
    assigned = assign_labels(clip, markers)
    check_clip_of_person(clip, assigned)
    record = read_forces(forces_file, markers, row.up_axis) if forces_file else None
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
    mass = default_mass_kg if row.mass_kg is None else row.mass_kg
    source = "default" if row.mass_kg is None else "sheet"
    body = build_body(person.geometry, mass, sex, mass_source=source)
    cutoff = by_action(settings.cutoff_hz, row.action)
    observed = observed_coordinates(assigned)
    paths, virtual, seen = _targets(clip, assigned, person, cutoff)
    coordinates = _start(clip, assigned, person, observed)
    for iterations in (60, 30):  # the second time with offsets as the clip itself shows them
        coordinates = fit_coordinates(body, virtual, coordinates, observed, iterations=iterations)
        virtual = _with_offsets(body, virtual, coordinates, seen)
    coordinates = fit_coordinates(body, virtual, coordinates, observed, iterations=30)
    level = row.surface == "level"
    points = contact_points(body, forward_kinematics(body, coordinates))
    ground = ground_height(points, clip.rate_hz, level=level)
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
    return Ingested(motion, report, {n: float(r) for n, r in zip(virtual.names, rms, strict=True)})


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


def observed_coordinates(assigned: Assigned) -> NDArray[np.bool_]:
    """Return which of the 35 coordinates the markers show.

    Trunk and head need three markers of their own, other nodes one (legs and arms are chains);
    an upper arm needs a marker beyond its shoulder, and the abdomen is seen through the thorax.
    """
    count = {node: list(assigned.nodes.values()).count(node) for node in NODES}
    count["abdomen"] = count["thorax"]
    for side in "rl":
        count[f"upper_arm_{side}"] += count[f"forearm_{side}"]
        if count["thorax"] < ENOUGH["thorax"]:
            count[f"upper_arm_{side}"] = count[f"forearm_{side}"] = 0
    shown = {n for n in NODES if count[n] >= ENOUGH.get(n.replace("abdomen", "thorax"), 1)}
    return np.array([NODES[node] in shown for node in COORDINATE_NODE])


def _windowed(clip: MarkerClip, row: ClipRow) -> MarkerClip:
    first = row.first_frame or 0
    last = clip.frames - 1 if row.last_frame is None else row.last_frame
    if last >= clip.frames:
        raise MotionStyleError(
            f"{row.id}: last_frame is {last}, but {clip.source} has frames 0 to {clip.frames - 1}"
        )
    if last - first + 1 < FEWEST_FRAMES:
        raise MotionStyleError(
            f"{row.id}: frames {first} to {last} of {clip.source} are {max(0, last - first + 1)} "
            f"frames; a motion needs at least {FEWEST_FRAMES}"
        )
    return clip.window(first, last)


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
    low, high = record.corners.min(axis=1), record.corners.max(axis=1)
    height = np.zeros(clip.frames)
    feet = []
    for side in "rl":
        labels = [assigned.landmarks.get(f"{n}_{side}") for n in ("heel", "toe", "mtp_lateral")]
        feet.append(np.mean([clip.path(x) for x in labels if x is not None], axis=0))
    lower = np.where((feet[0][:, 1] < feet[1][:, 1])[:, None], feet[0], feet[1])
    for a, b in zip(low, high, strict=True):
        over = ((lower > a - STANDS_LOW_M) & (lower < b + STANDS_LOW_M))[:, [0, 2]].all(axis=1)
        height = np.where(over, np.maximum(height, b[1]), height)
    return height


def _targets(
    clip: MarkerClip, assigned: Assigned, person: MarkerBody, cutoff: float
) -> tuple[Array, VirtualMarkers, NDArray[np.bool_]]:
    """Return raw paths, markers with smooth paths and weights, and where they were seen."""
    labels = tuple(assigned.nodes)
    paths, weights, seen = fill_gaps(clip, labels)
    role = {label: landmark.rsplit("_", 1)[0] for landmark, label in assigned.landmarks.items()}
    weigh = [LANDMARK_WEIGHT.get(role[x], 1.0) if x in role else CLUSTER_WEIGHT for x in labels]
    placed = np.array([label in person.offsets for label in labels])
    weights = weights * np.array(weigh) * placed
    virtual = VirtualMarkers(
        names=labels,
        nodes=np.array([NODE_INDEX[assigned.nodes[label]] for label in labels]),
        local=np.array([person.offsets.get(label, np.zeros(3)) for label in labels]),
        world=smooth_paths(paths, seen, clip.rate_hz, cutoff),
        weights=np.repeat(weights[..., None], 3, axis=2),
    )
    return paths, virtual, seen


def _start(
    clip: MarkerClip, assigned: Assigned, person: MarkerBody, observed: NDArray[np.bool_]
) -> Array:
    """Return coordinates (F, 35) that follow the pelvis, with all joints straight.

    A trunk that no marker shows stays upright against the mean tilt of the pelvis.
    """
    labels = tuple(assigned.nodes)
    paths, _, _ = fill_gaps(clip, labels)
    points = {n: paths[:, labels.index(label)] for n, label in assigned.landmarks.items()}
    start = np.zeros((clip.frames, len(COORDINATES)))
    start[:, :3] = sum(hip_centres(points).values()) / 2
    start[:, 3:6] = logarithm(pelvis_frame(points))
    flexion = COORDINATE_INDEX["abdomen_flexion"]
    if not observed[flexion]:
        start[:, flexion] = -person.pelvis_pitch
    return make_continuous(start)[0]


def _with_offsets(
    body: Body, virtual: VirtualMarkers, coordinates: Array, seen: NDArray[np.bool_]
) -> VirtualMarkers:
    """Return the markers moved on their nodes to where the fitted clip shows them on average.

    A marker that the calibration did not place gets its place and its weight here.
    """
    pose = forward_kinematics(body, coordinates)
    away = virtual.world - pose.positions[:, virtual.nodes]
    local = np.einsum("fmba,fmb->fma", pose.rotations[:, virtual.nodes], away)
    local[~seen] = np.nan
    new = virtual.weights.sum(axis=(0, 2)) == 0
    weights = np.where(new[:, None], CLUSTER_WEIGHT * seen[..., None], virtual.weights)
    return replace(virtual, local=np.nanmedian(local, axis=0), weights=weights)


def _remarks(clip: MarkerClip, names: tuple[str, ...], seen: NDArray[np.bool_]) -> str:
    """Return which markers are missing in more than a tenth of the frames."""
    share = 1.0 - seen.mean(axis=0)
    worst = [f"{n} {100 * s:.0f} %" for n, s in zip(names, share, strict=True) if s > 0.1]
    return f"missing: {', '.join(worst)} of {clip.frames} frames" if worst else ""
