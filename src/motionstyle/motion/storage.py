"""Motions on disk: `{root}/motions/{kind}/{id}.npz` with a JSON sidecar of the same stem.

The .npz holds the arrays; the sidecar what a person or a table wants to read. A failed motion
is a sidecar with status "failed" and a reason beside an .npz without frames, so that a stage
that asks for it is told why it is not there.
"""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from motionstyle.body.body import Body, BodyGeometry
from motionstyle.body.layout import CONTACT_POINTS, COORDINATES, NODES
from motionstyle.errors import MotionStyleError
from motionstyle.files import atomic_write, read_json, write_json
from motionstyle.motion.motion import Motion

SCHEMA_VERSION = 1
_BODY_ARRAYS = ("masses", "coms", "inertias", "semi_axes")
_GEOMETRY_ARRAYS = ("joint_offsets", "contact_points", "end_points")


def sidecar_path(path: str | Path) -> Path:
    """Return the JSON sidecar of a motion file."""
    return Path(path).with_suffix(".json")


def save_motion(path: str | Path, motion: Motion) -> None:
    """Write a motion and its sidecar, each atomically."""
    arrays: dict[str, Any] = {
        "schema_version": np.int64(SCHEMA_VERSION),
        "status": np.str_("ok"),
        "coordinates": motion.coordinates,
        "contacts": motion.contacts,
        "contact_normals": motion.contact_normals,
        "observed": motion.observed,
        "rebranched": np.array(motion.rebranched, dtype=np.int64),
        "rate_hz": np.float64(motion.rate_hz),
    }
    if motion.contact_forces is not None:
        arrays["contact_forces"] = motion.contact_forces
    for name in _BODY_ARRAYS:
        arrays[f"body_{name}"] = getattr(motion.body, name)
    for name in _GEOMETRY_ARRAYS:
        arrays[f"body_{name}"] = getattr(motion.body.geometry, name)
    _save_npz(path, arrays)
    write_json(
        sidecar_path(path),
        {
            "schema_version": SCHEMA_VERSION,
            "id": motion.id,
            "kind": motion.kind,
            "status": "ok",
            "frames": motion.frames,
            "rate_hz": motion.rate_hz,
            "coordinates": list(COORDINATES),
            "nodes": list(NODES),
            "contact_points": list(CONTACT_POINTS),
            "unobserved": [
                n for n, seen in zip(COORDINATES, motion.observed, strict=True) if not seen
            ],
            "body": {
                "mass_kg": motion.body.mass,
                "sex": motion.body.sex,
                "mass_source": motion.body.mass_source,
                "leg_length_m": motion.body.leg_length,
            },
            "provenance": dict(motion.provenance),
        },
    )


def save_failure(path: str | Path, id: str, kind: str, reason: str, **provenance: object) -> None:
    """Record that a motion could not be made, and why."""
    _save_npz(
        path,
        {
            "schema_version": np.int64(SCHEMA_VERSION),
            "status": np.str_("failed"),
            "reason": np.str_(reason),
        },
    )
    write_json(
        sidecar_path(path),
        {
            "schema_version": SCHEMA_VERSION,
            "id": id,
            "kind": kind,
            "status": "failed",
            "reason": reason,
            "provenance": provenance,
        },
    )


def load_motion(path: str | Path) -> Motion:
    """Read a motion.

    Raises
    ------
    MotionStyleError
        If the file is corrupt, of another schema version, or records a failed motion; the
        message says which rule to rerun.
    """
    path = Path(path)
    kind, name = path.parent.name, path.stem
    again = f"delete it and run Snakemake again to remake motion {kind}/{name}"
    try:
        with np.load(path, allow_pickle=False) as stored:
            data = {key: stored[key] for key in stored.files}
        sidecar = read_json(sidecar_path(path))
    except (OSError, ValueError, EOFError, zipfile.BadZipFile, KeyError) as error:
        raise MotionStyleError(f"{path}: not a readable motion file ({error}); {again}") from error
    version = int(data.get("schema_version", -1))
    if version != SCHEMA_VERSION:
        raise MotionStyleError(
            f"{path}: motion schema version {version}, this program reads {SCHEMA_VERSION}; {again}"
        )
    if str(data["status"]) != "ok":
        raise MotionStyleError(f"motion {kind}/{name} is not available: {data['reason']}")
    missing = [k for k in ("coordinates", "contacts", "observed", "body_masses") if k not in data]
    if missing:
        raise MotionStyleError(f"{path}: {', '.join(missing)} missing from the file; {again}")
    geometry = BodyGeometry(*(data[f"body_{name}"] for name in _GEOMETRY_ARRAYS))
    body = Body(
        geometry,
        *(data[f"body_{name}"] for name in _BODY_ARRAYS),
        sex=sidecar["body"]["sex"],
        mass_source=sidecar["body"]["mass_source"],
    )
    return Motion(
        id=sidecar["id"],
        kind=sidecar["kind"],
        rate_hz=float(data["rate_hz"]),
        coordinates=data["coordinates"],
        body=body,
        contacts=data["contacts"],
        contact_normals=data["contact_normals"],
        contact_forces=data.get("contact_forces"),
        observed=data["observed"],
        rebranched=tuple(int(f) for f in data["rebranched"]),
        provenance=sidecar["provenance"],
    )


def _save_npz(path: str | Path, arrays: dict[str, Any]) -> None:
    """Write arrays as an uncompressed .npz whose bytes depend on the arrays alone."""
    with atomic_write(path, "wb") as handle, zipfile.ZipFile(handle, "w") as archive:
        for name in sorted(arrays):
            info = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
            info.compress_type = zipfile.ZIP_DEFLATED
            with archive.open(info, "w", force_zip64=True) as member:
                np.lib.format.write_array(member, np.asanyarray(arrays[name]), allow_pickle=False)
