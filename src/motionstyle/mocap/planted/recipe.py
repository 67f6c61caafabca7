"""What is planted: the named, true parameters of one planted motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.layout import COORDINATES
from motionstyle.errors import MotionStyleError, near_matches
from motionstyle.mocap.planted.cycle import WINDOWS

LEG_NAMES = ("hip", "knee", "ankle", "foot", "toes")
# Coordinates a posture offset may name; without a side it means both sides.
POSTURE_NAMES = tuple(
    dict.fromkeys(
        part
        for name in COORDINATES[6:]
        if not name.startswith(LEG_NAMES)
        for part in ((name[:-2], name) if name.endswith(("_r", "_l")) else (name,))
    )
)
GROUPS = ("arms", "legs")
FACTOR_RANGE = (0.2, 3.0)


@dataclass(frozen=True)
class PlantedRecipe:
    """One planted motion.

    Attributes
    ----------
    id, base, style : names of the motion, of the motion it is made from, and of its style.
    take, seed : takes differ by seed and source window.
    cycle_frames : frames of one cycle of the base, None for a clip that does not loop.
    cycles : how many cycles are made of a looping base.
    source_window : which source frames, see `planted.cycle`.
    posture_offset_deg : constant offsets by coordinate, deg; a name without side means both.
    swing_gain : factor on the arms' deviation from their mean; for legs, on the way of the feet
        over the ground: the pelvis' travel, the steps and the lift in swing.
    cadence, step_length : factors on steps per second and travel per step.
    phase_noise : rms of a smooth warp of time, in cycles (or of a clip's whole length).
    pose_noise_deg : rms of smooth noise on every seen coordinate above the legs and on the
        pelvis' rotation; pelvis and swinging feet are shifted by 0.3 m per rad of it.
    series, dose, style_coordinates : its place in the catalogue.
    """

    id: str
    base: str
    style: str
    take: int = 1
    seed: int = 0
    cycle_frames: int | None = None
    cycles: int = 1
    source_window: str = "whole"
    posture_offset_deg: Mapping[str, float] = field(default_factory=dict)
    swing_gain: Mapping[str, float] = field(default_factory=dict)
    cadence: float = 1.0
    step_length: float = 1.0
    phase_noise: float = 0.0
    pose_noise_deg: float = 0.0
    series: str = ""
    dose: float | None = None
    style_coordinates: tuple[float, ...] | None = None
    experiments: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        problems = self.problems()
        if problems:
            raise MotionStyleError("\n".join(f"planted {self.id}: {p}" for p in problems))

    @property
    def stride(self) -> float:
        """Factor on steps and travel: step length times leg swing gain."""
        return self.step_length * self.swing_gain.get("legs", 1.0)

    @property
    def truth(self) -> dict[str, Any]:
        """All true parameter values, JSON values only; factors are 1 where nothing is planted."""
        values = None if self.style_coordinates is None else list(self.style_coordinates)
        return {
            "posture_offset_deg": dict(self.posture_offset_deg),
            "swing_gain": {group: self.swing_gain.get(group, 1.0) for group in GROUPS},
            "cadence": self.cadence,
            "step_length": self.step_length,
            "phase_noise": self.phase_noise,
            "pose_noise_deg": self.pose_noise_deg,
            "style_coordinates": values,
            "series": self.series,
            "dose": self.dose,
        }

    @property
    def edit(self) -> str:
        """The recipe in a few words, which begin with "planted"."""
        parts = [f"{n} {v:+g}°" for n, v in self.posture_offset_deg.items() if v]
        parts += [f"{n} swing ×{v:g}" for n, v in self.swing_gain.items() if v != 1]
        parts += [
            f"{n.replace('_', ' ')} ×{getattr(self, n):g}"
            for n in ("step_length", "cadence")
            if getattr(self, n) != 1
        ]
        return f"planted: {', '.join(parts) or 'no change'}; take {self.take}"

    def problems(self) -> list[str]:
        """Return what is wrong with the recipe, one sentence each."""
        found = []
        if "planted" not in self.style:
            found.append(f"style is '{self.style}'; a planted style's name contains 'planted'")
        if self.source_window not in WINDOWS:
            near = near_matches(self.source_window, WINDOWS) or f"; known: {', '.join(WINDOWS)}"
            found.append(f"source_window '{self.source_window}' is unknown{near}")
        for name, value in self.posture_offset_deg.items():
            if name not in POSTURE_NAMES:
                found.append(f"posture_offset_deg: {_unknown_posture(name)}")
            elif not abs(value) <= 90:
                found.append(f"posture_offset_deg: {name} is {value:g}°, expected at most 90°")
        for name in set(self.swing_gain) - set(GROUPS):
            near = near_matches(name, GROUPS) or f"; known: {', '.join(GROUPS)}"
            found.append(f"swing_gain: unknown group '{name}'{near}")
        factors = {f"swing_gain {n}": v for n, v in self.swing_gain.items()}
        factors |= {"cadence": self.cadence, "step_length": self.step_length}
        low, high = FACTOR_RANGE
        for name, value in factors.items():
            least = 0.0 if name == "swing_gain arms" else low
            if not least <= value <= high:
                found.append(f"{name} is {value:g}, expected {least:g} to {high:g}")
        for name, most in (("phase_noise", 0.1), ("pose_noise_deg", 10.0)):
            if not 0 <= getattr(self, name) <= most:
                found.append(f"{name} is {getattr(self, name):g}, expected 0 to {most:g}")
        if self.cycles < 1 or (self.cycle_frames is None and self.cycles != 1):
            found.append(f"cycles is {self.cycles}; a clip without cycle_frames has 1")
        return found


def posture_offsets(recipe: PlantedRecipe) -> NDArray[np.float64]:
    """Return the offsets of all 35 coordinates, rad; both sides where no side is named."""
    offsets = np.zeros(len(COORDINATES))
    for name, degrees in recipe.posture_offset_deg.items():
        for i, coordinate in enumerate(COORDINATES):
            if coordinate in {name, f"{name}_r", f"{name}_l"}:
                offsets[i] += np.radians(degrees)
    return offsets


def _unknown_posture(name: str) -> str:
    if name.startswith((*LEG_NAMES, "pelvis")):
        return (
            f"'{name}' follows from pelvis and feet, which stay on the floor; "
            "use step_length, swing_gain or another joint"
        )
    near = near_matches(name, POSTURE_NAMES) or f"; known: {', '.join(POSTURE_NAMES)}"
    return f"unknown coordinate '{name}'{near}"
