"""Motions on disk: `{root}/motions/{kind}/{id}.npz` with a JSON sidecar of the same stem.

The .npz holds the arrays; the sidecar what a person or a table wants to read. A failed motion
is a sidecar with status "failed" and a reason beside an .npz without frames, so that a stage
that asks for it is told why it is not there.
"""

from __future__ import annotations

import struct
import zipfile
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from motionstyle.body.body import Body, BodyGeometry
from motionstyle.body.layout import CONTACT_POINTS, COORDINATES, NODES
from motionstyle.errors import MotionStyleError
from motionstyle.files import atomic_write, read_json, write_json
from motionstyle.motion.motion import Motion

SCHEMA_VERSION = 1
_ARRAYS = ("coordinates", "contacts", "contact_normals", "observed", "rebranched", "rate_hz")
_BODY_ARRAYS = ("masses", "coms", "inertias", "semi_axes")
_GEOMETRY_ARRAYS = ("joint_offsets", "contact_points", "end_points")
_SIDECAR_KEYS = {"id": str, "kind": str, "provenance": dict}
# What damaged archives and arrays raise.
_UNREADABLE = (
    *(OSError, ValueError, EOFError, KeyError, TypeError, RuntimeError, MemoryError),
    *(struct.error, zlib.error, zipfile.BadZipFile),
)


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


def read_sidecar(path: str | Path) -> dict[str, Any]:
    """Read and check the sidecar of a motion, whichever of its two files is named.

    Raises
    ------
    MotionStyleError
        If it is missing, damaged, incomplete or of another schema version.
    """
    path = sidecar_path(path)
    again = _remake(path)
    try:
        sidecar = read_json(path)
    except (OSError, ValueError, RecursionError) as error:
        raise MotionStyleError(f"{path}: not a readable motion file ({error}); {again}") from error
    if not isinstance(sidecar, dict):
        raise MotionStyleError(f"{path}: not the sidecar of a motion; {again}")
    _check_version(path, sidecar.get("schema_version"))
    wanted = dict(_SIDECAR_KEYS)
    if sidecar.get("status") == "failed":
        wanted["reason"] = str
    elif sidecar.get("status") == "ok":
        wanted |= {"frames": int, "rate_hz": (int, float), "body": dict}
    wrong = [key for key, type_ in wanted.items() if not isinstance(sidecar.get(key), type_)]
    wrong += [key for key in ("status",) if sidecar.get(key) not in ("ok", "failed")]
    if wrong:
        raise MotionStyleError(
            f"{path}: {', '.join(dict.fromkeys(wrong))} missing or damaged; {again}"
        )
    return sidecar


def load_motion(path: str | Path) -> Motion:
    """Read a motion.

    Raises
    ------
    MotionStyleError
        If the file is missing, damaged, of another schema version, or records a failed motion;
        the message names the file and says what to do.
    """
    path = Path(path)
    again = _remake(path)
    sidecar = read_sidecar(path)
    data = _load_npz(path)
    _check_version(path, data.get("schema_version"))
    if sidecar["status"] == "failed":
        raise MotionStyleError(
            f"{path}: motion {path.parent.name}/{path.stem} could not be made: "
            f"{sidecar['reason']}; mend that or leave the motion out, then {again}"
        )
    needed = (*_ARRAYS, *(f"body_{name}" for name in (*_GEOMETRY_ARRAYS, *_BODY_ARRAYS)))
    missing = [key for key in needed if key not in data]
    missing += [f"body {key}" for key in ("sex", "mass_source") if key not in sidecar["body"]]
    if missing:
        raise MotionStyleError(f"{path}: {', '.join(missing)} missing from the file; {again}")
    if sidecar["frames"] != len(data["coordinates"]):
        raise MotionStyleError(
            f"{path}: {len(data['coordinates'])} frames, but its sidecar says "
            f"{sidecar['frames']}; {again}"
        )
    body = Body(
        BodyGeometry(*(data[f"body_{name}"] for name in _GEOMETRY_ARRAYS)),
        *(data[f"body_{name}"] for name in _BODY_ARRAYS),
        sex=sidecar["body"]["sex"],
        mass_source=sidecar["body"]["mass_source"],
    )
    try:
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
    except MotionStyleError as error:
        raise MotionStyleError(f"{path}: {error}; {again}") from error


def _remake(path: Path) -> str:
    """Say how to make a motion anew."""
    return f"delete it and run Snakemake again to remake motion {path.parent.name}/{path.stem}"


def _check_version(path: Path, found: object) -> None:
    """Raise if a file was not written with this schema version."""
    if found is None or found != SCHEMA_VERSION:
        raise MotionStyleError(
            f"{path}: motion schema version {found}, this program reads {SCHEMA_VERSION}; "
            f"{_remake(path)}"
        )


def _load_npz(path: Path) -> dict[str, Any]:
    """Read all arrays of an .npz."""
    try:
        with path.open("rb") as handle, np.load(handle, allow_pickle=False) as stored:
            return {key: stored[key] for key in stored.files}
    except _UNREADABLE as error:
        raise MotionStyleError(
            f"{path}: not a readable motion file ({error}); {_remake(path)}"
        ) from error


def _save_npz(path: str | Path, arrays: dict[str, Any]) -> None:
    """Write arrays as a compressed .npz without time stamps: equal arrays, equal bytes."""
    with atomic_write(path, "wb") as handle, zipfile.ZipFile(handle, "w") as archive:
        for name in sorted(arrays):
            info = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
            info.compress_type = zipfile.ZIP_DEFLATED
            info.create_system = 3  # the same on every system
            values = np.asarray(arrays[name], order="C")
            with archive.open(info, "w", force_zip64=True) as member:
                np.lib.format.write_array(member, values, allow_pickle=False)


def load_available(paths: Iterable[str | Path], *, allow_none: bool = False) -> list[Motion]:
    """Read the motions that could be made, and print which could not.

    The failed ones keep their row, with the reason, in the tables of their stage. At least one
    must be there, unless `allow_none`.

    Raises
    ------
    MotionStyleError
        If a file is unreadable, or none of the motions is available.
    """
    found, failed = [], []
    for path in paths:
        if read_sidecar(path)["status"] == "ok":
            found.append(load_motion(path))
        else:
            failed.append(Path(path).stem)
    if failed:
        print(f"left out, failed before: {', '.join(failed)}")
    if failed and not found and not allow_none:
        raise MotionStyleError(f"none of these motions is available: {', '.join(failed)}")
    return found
