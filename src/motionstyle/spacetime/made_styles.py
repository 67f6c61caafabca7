"""Styles nobody learnt: set by hand from a small table, or drawn at random for twins.

A hand-set style is what a biomechanist would write down without any data: groups of joints with a
stiffness, a damping, a preference and a rest angle. A twin's style θ* is drawn around the initial
style of a motion, so that motions made with it have a known truth.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from motionstyle.body.layout import JOINT_COORDINATES
from motionstyle.body.ranges import joint_ranges
from motionstyle.dynamics.passive import (
    LARGEST_DAMPING,
    LARGEST_STIFFNESS,
    PassiveParameters,
)
from motionstyle.errors import MotionStyleError, near_matches
from motionstyle.motion.motion import Motion
from motionstyle.spacetime.style import JOINTS_29, Style

Array = NDArray[np.float64]
NUMBERS = ("stiffness", "damping", "preference", "rest_deg")
TOP_KEYS = ("reference_mass_kg", "shoe_stiffness", "shoe_rest_length", "joints")

STIFFEST_SHOE, THICKEST_SHOE = 1e5, 0.05  # N/m, m


# ---------------------------------------------------------------------------------- set by hand
def hand_style(path: str | Path, motion: Motion) -> Style:
    """Return the style of a hand-written table, for the body of a motion.

    The table's `joints` are patterns of joint names (`knee_flexion_*`), the first that fits counts,
    each with `stiffness` (N·m/rad), `damping` (N·m·s/rad), `preference` (relative) and `rest_deg`.
    Stiffness and damping scale with body mass over `reference_mass_kg`; preferences sum to 1.

    Raises
    ------
    MotionStyleError
        With the file and every entry that is missing, unknown, not a number or out of bounds.
    """
    path = Path(path)
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, yaml.YAMLError) as error:
        raise MotionStyleError(f"{path}: not a readable YAML file ({error})") from error
    if not isinstance(content, dict) or not isinstance(content.get("joints"), dict):
        raise MotionStyleError(f"{path}: needs a group `joints` of patterns of joint names")
    faults = [
        f"{key!r} is unknown{near_matches(str(key), TOP_KEYS)}"
        for key in content
        if key not in TOP_KEYS
    ]
    top = {key: _number(content, key, faults, least=0.0) for key in TOP_KEYS if key != "joints"}
    groups = {}
    for pattern, given in content["joints"].items():
        entry = given if isinstance(given, dict) else {}
        inner: list[str] = []
        groups[str(pattern)] = {
            name: _number(entry, name, inner, least=None if name == "rest_deg" else 0.0)
            for name in NUMBERS
        }
        inner += [
            f"{key!r} is unknown{near_matches(str(key), NUMBERS)}"
            for key in entry
            if key not in NUMBERS
        ]
        if not any(fnmatchcase(joint, str(pattern)) for joint in JOINTS_29):
            inner.append(f"fits no joint{near_matches(str(pattern), JOINTS_29)}")
        faults += [f"joints.{pattern}: {fault}" for fault in inner]
    chosen = {
        joint: next((g for p, g in groups.items() if fnmatchcase(joint, p)), None)
        for joint in JOINTS_29
    }
    faults += [f"no pattern fits joint {joint}" for joint, group in chosen.items() if group is None]
    if not faults and top["reference_mass_kg"] == 0:
        faults.append("reference_mass_kg is 0, must be positive")
    if not faults and sum(group["preference"] for group in groups.values()) == 0:
        faults.append("all preferences are 0")
    if faults:
        raise MotionStyleError(f"{path}: " + "; ".join(faults[:8]))
    column = {name: np.array([chosen[joint][name] for joint in JOINTS_29]) for name in NUMBERS}
    scale = motion.body.mass / top["reference_mass_kg"]
    stiffness = scale * column["stiffness"]
    passive = PassiveParameters(
        stiffness, stiffness.copy(), scale * column["damping"], np.radians(column["rest_deg"])
    )
    about = {"recipe": "hand", "clip": motion.id, "table": path.name}
    about |= {"solver_status": "not needed", "body_mass_kg": motion.body.mass}
    return Style(
        column["preference"] / column["preference"].sum(),
        passive,
        top["shoe_stiffness"],
        top["shoe_rest_length"],
        about,
    )


def _number(
    entry: Mapping[str, Any], name: str, faults: list[str], least: float | None = None
) -> float:
    """Return a number of a group; note what is wrong with it."""
    value = entry.get(name)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not np.isfinite(value):
        faults.append(f"{name} is {value!r}, not a number" if name in entry else f"needs {name}")
        return 0.0
    if least is not None and value < least:
        faults.append(f"{name} is {value}, must not be negative")
    return float(value)


# ------------------------------------------------------------------------------------- at random
@dataclass(frozen=True)
class Spread:
    """How far θ* strays from the style it is drawn around.

    preference, stiffness, damping, shoe : standard deviation of the logarithm. rest_deg : of the
    rest angles, degrees. least_stiffness, least_damping : what zeros count as before the draw,
    N·m/rad and N·m·s/rad: the springs of eq. (22) are often zero.
    """

    preference: float = 0.5
    stiffness: float = 0.5
    damping: float = 0.5
    shoe: float = 0.3
    rest_deg: float = 5.0
    least_stiffness: float = 5.0
    least_damping: float = 0.5


def random_style(initial: Style, seed: int, spread: Spread | None = None) -> Style:
    """Return θ* drawn around a style: log-normal α, springs, dampers and shoes, normal rest angles.

    Each parameter is drawn by itself, stiffness above and below apart; springs, dampers and shoes
    are cut at the bounds of learning, rest angles at the joint ranges. α sums to 1. The same for
    the same seed.
    """
    spread = spread or Spread()
    rng = np.random.default_rng(seed)
    count = len(JOINTS_29)

    def around(values: Array, least: float, width: float, most: float) -> Array:
        return np.minimum(
            np.maximum(values, least) * np.exp(width * rng.standard_normal(len(values))), most
        )

    p = initial.passive
    preferences = initial.preferences * np.exp(spread.preference * rng.standard_normal(count))
    above = around(p.stiffness_above, spread.least_stiffness, spread.stiffness, LARGEST_STIFFNESS)
    below = around(p.stiffness_below, spread.least_stiffness, spread.stiffness, LARGEST_STIFFNESS)
    damping = around(p.damping, spread.least_damping, spread.damping, LARGEST_DAMPING)
    low, high = joint_ranges()[JOINT_COORDINATES].T
    rest = p.rest_angle + np.radians(spread.rest_deg) * rng.standard_normal(count)
    shoes = around(np.array([initial.shoe_stiffness]), 0.0, spread.shoe, STIFFEST_SHOE)
    soles = around(np.array([initial.shoe_rest_length]), 0.0, spread.shoe, THICKEST_SHOE)
    drawn = replace(
        initial,
        preferences=preferences / preferences.sum(),
        passive=PassiveParameters(above, below, damping, np.clip(rest, low, high)),
        shoe_stiffness=float(shoes[0]),
        shoe_rest_length=float(soles[0]),
    )
    return replace(drawn, about={**initial.about, "recipe": "twin", "seed": seed})
