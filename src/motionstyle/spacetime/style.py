"""θ, a style: the 147 parameters of Liu et al. 2005, §3–4, by name and in a file of their own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.layout import COORDINATES, JOINT_COORDINATES
from motionstyle.dynamics.passive import PassiveParameters, initial_passive
from motionstyle.errors import MotionStyleError
from motionstyle.files import read_json, write_json

Array = NDArray[np.float64]
JOINTS_29 = COORDINATES[JOINT_COORDINATES]
SCHEMA_VERSION = 1
UNITS = {
    "preference": "1/(N m)^2",
    "stiffness_above": "N m/rad",
    "stiffness_below": "N m/rad",
    "damping": "N m s/rad",
    "rest_angle": "rad",
}
SHOE_UNITS = {"shoe_stiffness": "N/m", "shoe_rest_length": "m"}


@dataclass(frozen=True)
class Style:
    """One style.

    Attributes
    ----------
    preferences : α of the 29 joint coordinates, sum 1, in 1/(N·m)².
    passive : springs, dampers and rest pose.
    shoe_stiffness, shoe_rest_length : k_shoe in N/m and h̄ in m, of both feet; 0 is no shoe.
    about : where it comes from: body, clip, algorithm, solver status; JSON values only.
    """

    preferences: Array
    passive: PassiveParameters
    shoe_stiffness: float = 0.0
    shoe_rest_length: float = 0.0
    about: Mapping[str, Any] = field(default_factory=dict)

    def vector(self) -> Array:
        """Return the 147 numbers: α, k_s1, k_s2, k_d, q̄ (29 each), k_shoe, h̄."""
        p = self.passive
        blocks = [self.preferences, p.stiffness_above, p.stiffness_below, p.damping, p.rest_angle]
        return np.concatenate([*blocks, [self.shoe_stiffness, self.shoe_rest_length]])

    def with_vector(self, vector: Array) -> Style:
        """Return a style with other numbers, in the order of `vector`."""
        blocks = np.asarray(vector[:-2], dtype=float).reshape(5, len(JOINTS_29))
        passive = PassiveParameters(*blocks[1:])
        return replace(
            self,
            preferences=blocks[0],
            passive=passive,
            shoe_stiffness=float(vector[-2]),
            shoe_rest_length=float(vector[-1]),
        )


def parameter_names() -> list[str]:
    """Return the names of the 147 parameters, as in files: `stiffness_above.knee_flexion_l`."""
    return [f"{kind}.{joint}" for kind in UNITS for joint in JOINTS_29] + list(SHOE_UNITS)


def initial_style(
    angles: Array, rates: Array, joint_forces: Array, shoes: tuple[float, float] = (0.0, 0.0)
) -> Style:
    """Return the start of learning (nio.md A3): α = 1/29, mean pose, springs of eq. (22).

    Parameters
    ----------
    angles, rates : of the 29 joints, (F, 29). joint_forces : inertia − gravity − contacts − shoes.
    shoes : k_shoe and h̄ of the physics fit.
    """
    count = len(JOINTS_29)
    passive = initial_passive(angles, rates, joint_forces)
    return Style(np.full(count, 1 / count), passive, *shoes)


def save_style(path: Path, style: Style) -> None:
    """Write a style to a JSON file that a person can read and edit."""
    units = [UNITS[kind] for kind in UNITS for _ in JOINTS_29] + list(SHOE_UNITS.values())
    values = {
        name: {"value": float(value), "unit": unit}
        for name, value, unit in zip(parameter_names(), style.vector(), units, strict=True)
    }
    write_json(path, {"schema": SCHEMA_VERSION, "about": dict(style.about), "parameters": values})


def save_no_style(path: Path, reason: str) -> None:
    """Write, in place of a style, why there is none."""
    write_json(path, {"schema": SCHEMA_VERSION, "failed": reason})


def load_style(path: Path) -> Style:
    """Read a style and check it.

    Raises
    ------
    MotionStyleError
        With the file's name and each parameter that is missing, unknown, in another unit, not a
        number, or out of bounds; or why there is no style.
    """
    content = read_json(path)
    if "failed" in content:
        raise MotionStyleError(f"{path}: no style was learnt: {content['failed']}")
    if content.get("schema") != SCHEMA_VERSION:
        raise MotionStyleError(
            f"{path}: style schema {content.get('schema')!r}, expected {SCHEMA_VERSION}"
        )
    given, names = content.get("parameters", {}), parameter_names()
    faults = [f"{name} is missing" for name in names if name not in given]
    faults += [f"{name} is unknown" for name in given if name not in names]
    numbers = []
    for name in names:
        if name not in given:
            continue
        kind = name.split(".")[0]
        entry = given[name] if isinstance(given[name], dict) else {"value": given[name]}
        value, unit = entry.get("value"), (UNITS | SHOE_UNITS)[kind]
        if entry.get("unit", unit) != unit:
            faults.append(f"{name} is in {entry['unit']}, expected {unit}")
        if not isinstance(value, (int, float)) or not np.isfinite(value):
            faults.append(f"{name} is {value!r}, not a number")
        elif kind != "rest_angle" and value < 0:
            faults.append(f"{name} is {value}, must not be negative")
        numbers.append(value)
    if faults:
        raise MotionStyleError(f"{path}: " + "; ".join(faults[:8]))
    count = len(JOINTS_29)
    empty = Style(np.zeros(count), PassiveParameters(*np.zeros((4, count))))
    style = empty.with_vector(np.array(numbers, dtype=float))
    return replace(style, about=content.get("about", {}))
