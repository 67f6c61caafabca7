"""Marker distances of many clips pooled by where the marker sits, whatever its laboratory."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from motionstyle.mocap.markers.markerset import MarkerSet

_PLACES = {"centre": "centre", "x": "ahead", "y": "above", "z": "beside"}


def _sideless(name: str) -> str:
    return name.removesuffix("_r").removesuffix("_l").replace("_", " ")


def virtual_place(name: str) -> str:
    """Return where a virtual marker ("foot_l x") sits: "foot, 10 cm ahead" or "foot, centre"."""
    node, _space, point = name.partition(" ")
    if not point:
        return _sideless(node)
    where = _PLACES.get(point, point)
    return f"{_sideless(node)}, {where if where == 'centre' else f'10 cm {where}'}"


def measured_places(markers: MarkerSet) -> dict[str, str]:
    """Return where each label of a laboratory sits: a landmark, or a node's further markers."""
    places = {label: _sideless(k) for k, v in markers.landmarks.items() for label in v}
    further = {
        label: f"{_sideless(k)}, further" for k, v in markers.tracking.items() for label in v
    }
    return further | places


def pooled_distances(
    clips: Iterable[tuple[Mapping[str, Any], MarkerSet | None]],
) -> dict[str, dict[str, list[float]]]:
    """Return rms distances in cm by kind ("virtual", "measured") and place, one per clip and side.

    Parameters
    ----------
    clips : what retargeting found ("quality") and the marker set, None for a skeleton's motion.
        Failed clips are passed over.
    """
    pooled: dict[str, dict[str, list[float]]] = {"virtual": {}, "measured": {}}
    for quality, markers in clips:
        if quality["status"] != "ok":
            continue
        labelled = {} if markers is None else measured_places(markers)
        for name, rms in quality["marker_rms_cm"].items():
            known = labelled.get(name)
            kind = "virtual" if markers is None else "measured"
            place = known if known is not None else virtual_place(name)
            if kind == "virtual" or known is not None:
                pooled[kind].setdefault(place, []).append(float(rms))
    return pooled
