"""Marker sets: which label of a laboratory is which landmark, cluster marker or force plate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from motionstyle.body.layout import NODES
from motionstyle.errors import MotionStyleError, near_matches
from motionstyle.mocap.formats.marker_clip import MarkerClip
from motionstyle.mocap.formats.mot import POSITION_UNITS, PlateColumns
from motionstyle.mocap.map_file import read_map_file

# The node each landmark is fixed to. `toe` is a marker over the second metatarsal's head,
# `mtp_*` ones beside the first and fifth, `toe_tip` one at the end of the toes.
_SIDED = {
    "pelvis": ("asis", "psis"),
    "thigh": ("knee_lateral", "knee_medial"),
    "shank": ("ankle_lateral", "ankle_medial"),
    "foot": ("heel", "toe", "mtp_lateral", "mtp_medial"),
    "toes": ("toe_tip",),
    "thorax": ("acromion",),
    "upper_arm": ("elbow_lateral", "elbow_medial"),
    "forearm": ("wrist_radius", "wrist_ulna"),
    "hand": ("finger",),
    "head": ("head_front", "head_back"),
}
_UNSIDED = {"pelvis": ("sacrum",), "thorax": ("c7", "t10", "clavicle", "sternum")}
_WHOLE = ("pelvis", "thorax", "head")  # nodes without a side
LANDMARKS: dict[str, str] = {
    f"{name}_{side}": node if node in _WHOLE else f"{node}_{side}"
    for node, names in _SIDED.items()
    for name in names
    for side in "rl"
} | {name: node for node, names in _UNSIDED.items() for name in names}
LANDMARKS["head_top"] = "head"
# Each group needs one of its landmarks (or both of a pair) in every file.
NEEDED = (
    ("asis_r",),
    ("asis_l",),
    ("psis_r", "sacrum"),
    ("psis_l", "sacrum"),
    ("heel_r",),
    ("heel_l",),
    ("toe_r", "mtp_lateral_r", "mtp_medial_r"),
    ("toe_l", "mtp_lateral_l", "mtp_medial_l"),
)
# And these in the file that tells the body's lengths, unless clusters of three replace them.
NEEDED_TO_MEASURE = tuple(
    (f"{name}_{side}",) for name in ("knee_lateral", "ankle_lateral") for side in "rl"
)
_KEYS = {
    **dict.fromkeys(("landmarks", "tracking"), dict),
    "forces": list,
    **dict.fromkeys(("note", "ignored", "static_only", "treadmill", "up_axis")),
}
FEET = ("right", "left", "nearest")


@dataclass(frozen=True)
class Plates:
    """How the plates of some files are named and whose foot stands on each.

    files : pattern of file names. feet : "right", "left" or "nearest" by plate name.
    columns : by plate name, for storage files. position_unit : of centres and moments.
    """

    files: str
    feet: Mapping[str, str]
    columns: Mapping[str, PlateColumns] = field(default_factory=dict)
    position_unit: str = "m"


@dataclass(frozen=True)
class MarkerSet:
    """One laboratory's labels.

    Attributes
    ----------
    name : of the file under `config/markersets`.
    landmarks : labels by landmark, the first that a file has is taken.
    tracking : further labels by node.
    ignored, static_only : patterns of labels of no use, and of those in static trials only.
    forces : plates, by file pattern.
    treadmill : patterns of names of files recorded on a belt.
    up_axis : of the files, where the sheet is silent.
    """

    name: str
    landmarks: Mapping[str, tuple[str, ...]]
    tracking: Mapping[str, tuple[str, ...]]
    ignored: tuple[str, ...] = ()
    static_only: tuple[str, ...] = ()
    forces: tuple[Plates, ...] = ()
    treadmill: tuple[str, ...] = ()
    up_axis: str = "y"

    @property
    def known(self) -> list[str]:
        """All labels that the set names."""
        both = [*self.landmarks.values(), *self.tracking.values()]
        return sorted({label for labels in both for label in labels})

    def on_treadmill(self, path: str | Path) -> bool:
        """Whether a file of this name was recorded on a belt."""
        return any(fnmatchcase(Path(path).name, pattern) for pattern in self.treadmill)

    def plates(self, path: str | Path) -> Plates:
        """Return the plates of a force file.

        Raises
        ------
        MotionStyleError
            If the set has none for a file of this name.
        """
        for plates in self.forces:
            if fnmatchcase(Path(path).name, plates.files):
                return plates
        patterns = ", ".join(p.files for p in self.forces) or "none"
        raise MotionStyleError(
            f"{path}: marker set '{self.name}' describes no force plates for this file (patterns: "
            f"{patterns}); add them under `forces` in config/markersets/{self.name}.yaml"
        )


@dataclass(frozen=True)
class Assigned:
    """A clip's labels in use: `landmarks` label by landmark, `nodes` node by label."""

    landmarks: Mapping[str, str]
    nodes: Mapping[str, str]


def _texts(value: object) -> tuple[str, ...]:
    """Return a text or a list of texts as a tuple."""
    if value is None:
        return ()
    return tuple(str(v) for v in value) if isinstance(value, list) else (str(value),)


def _plates(entry: Any, problems: list[str]) -> Plates:  # noqa: ANN401 (YAML)
    entry = entry if isinstance(entry, dict) else {}
    feet, columns = {}, {}
    for name, plate in (entry.get("plates") or {}).items():
        plate = plate if isinstance(plate, dict) else {"foot": plate}  # noqa: PLW2901
        foot = str(plate.get("foot", ""))
        if foot not in FEET:
            near = near_matches(foot, FEET)
            problems.append(
                f"forces: plate '{name}' has foot '{foot}', not {', '.join(FEET)}{near}"
            )
        feet[str(name)] = foot
        if "force" in plate:
            parts = [str(plate.get(key, "")) for key in ("force", "point", "moment")]
            columns[str(name)] = PlateColumns(*parts)
    unit = str(entry.get("unit", "m"))
    if unit not in POSITION_UNITS:
        problems.append(f"forces: unit '{unit}' is not one of {', '.join(POSITION_UNITS)}")
    if not feet:
        problems.append("forces: each entry needs `plates`, a foot by plate name")
    return Plates(str(entry.get("files", "*")), feet, columns, unit)


def read_marker_set(folder: str | Path, name: str) -> MarkerSet:
    """Read and check one marker set.

    Raises
    ------
    MotionStyleError
        If there is no such set, or with every unknown key, landmark, node or foot in it, and
        every label that is used twice.
    """
    path, data, problems = read_map_file(folder, name, "marker set", _KEYS)
    landmarks = {str(k): _texts(v) for k, v in (data.get("landmarks") or {}).items()}
    tracking = {str(k): _texts(v) for k, v in (data.get("tracking") or {}).items()}
    for section, found, names in (
        ("landmarks", landmarks, list(LANDMARKS)),
        ("tracking", tracking, list(NODES)),
    ):
        kind = section.rstrip("s") if section == "landmarks" else "node"
        problems += [
            f"{section}: unknown {kind} '{key}'{near_matches(key, names)}"
            for key in found
            if key not in names
        ]
    labels = [label for found in (landmarks, tracking) for v in found.values() for label in v]
    problems += [
        f"label '{label}' stands there {labels.count(label)} times"
        for label in sorted({label for label in labels if labels.count(label) > 1})
    ]
    up_axis = str(data.get("up_axis", "y"))
    if up_axis not in {"y", "z"}:
        problems.append(f"up_axis is '{up_axis}', expected y or z")
    forces = tuple(_plates(entry, problems) for entry in data.get("forces") or [])
    if problems:
        raise MotionStyleError(f"{path}: " + "; ".join(sorted(problems)))
    return MarkerSet(
        name=name,
        landmarks=landmarks,
        tracking=tracking,
        ignored=_texts(data.get("ignored")),
        static_only=_texts(data.get("static_only")),
        forces=forces,
        treadmill=_texts(data.get("treadmill")),
        up_axis=up_axis,
    )


def assign_labels(clip: MarkerClip, markers: MarkerSet) -> Assigned:
    """Find the landmarks and cluster markers among a clip's labels.

    Raises
    ------
    MotionStyleError
        With every label that the set does not know, with near matches, and every needed landmark
        that no marker shows: absent, or not seen in any frame.
    """
    known, problems = markers.known, []
    idle = (*markers.ignored, *markers.static_only)
    for label in clip.labels:
        if label not in known and not any(fnmatchcase(label, p) for p in idle):
            problems.append(f"unknown marker '{label}'{near_matches(label, known)}")
    seen = {
        label
        for k, label in enumerate(clip.labels)
        if np.isfinite(clip.positions[:, k]).all(axis=-1).any()
    }
    landmarks, nodes = {}, {}
    for landmark, labels in markers.landmarks.items():
        found = next((label for label in labels if label in seen), None)
        if found is not None:
            landmarks[landmark] = found
            nodes[found] = LANDMARKS[landmark]
    for node, labels in markers.tracking.items():
        nodes |= {label: node for label in labels if label in seen}
    for group in NEEDED:
        if not any(landmark in landmarks for landmark in group):
            wanted = [x for name in group for x in markers.landmarks.get(name, ())]
            never = [label for label in wanted if label in clip.labels]
            why = f"never seen in {clip.frames} frames" if never else "missing"
            names = " or ".join(f"'{label}'" for label in never or wanted) or "no label is mapped"
            problems.append(f"needed marker {names} ({' or '.join(group)}) is {why}")
    if problems:
        raise MotionStyleError(
            f"{clip.source}: does not fit marker set '{markers.name}': "
            + "; ".join(problems)
            + ". Choose another marker set in the sheet (column skeleton), or mend "
            f"config/markersets/{markers.name}.yaml (labels of no use go under `ignored`)"
        )
    return Assigned(landmarks, nodes)
