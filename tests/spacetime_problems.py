"""Small spacetime problems, made up, that several tests solve or evaluate."""

from __future__ import annotations

import numpy as np

from motionstyle.body.layout import COORDINATE_INDEX
from motionstyle.dynamics.inverse import GRAVITY
from motionstyle.dynamics.passive import PassiveParameters
from motionstyle.dynamics.symbols import parameter_vector
from motionstyle.spacetime.foot_constraints import FootConstraints
from motionstyle.spacetime.spacetime_problem import SpacetimeProblem, SpacetimeSettings
from motionstyle.spacetime.style import Style

RATE = 30.0
FREE = np.full((35, 2), [-np.inf, np.inf])


def plain_style(stiffness=0.0, damping=0.0, rest=None, shoe=(0.0, 0.0)):
    """The same springs at all joints."""
    numbers = (np.full(29, float(v)) for v in (stiffness, stiffness, damping))
    rest = np.zeros(29) if rest is None else np.asarray(rest, dtype=float)
    return Style(np.full(29, 1 / 29), PassiveParameters(*numbers, rest), *shoe)


def flat_feet(functions, body, q, *, held):
    """Feet held where `q` (F, 35) has them, each on a level plane through itself, or all free."""
    frames = len(q)
    points = functions["foot_points"](q, parameter_vector(body))[0].reshape(frames, 8, 3)
    return FootConstraints(
        held=np.full((frames, 8), held),
        sliding=np.zeros((frames, 8), dtype=bool),
        targets=points,
        ground=points if held else points - [0.0, 5.0, 0.0],
        normals=np.tile([0.0, 1.0, 0.0], (frames, 8, 1)),
        clearance=np.zeros((frames, 8)),
        friction=np.full((frames, 8), 0.8),
    )


def throw(body, frames, wobble=0.0):
    """Coordinates (F, 35) of a body thrown up, not turning, its height wobbling (m)."""
    t = np.arange(frames) / RATE
    q = np.zeros((frames, 35))
    q[:, 0] = 1.2 * t
    q[:, 1] = 2.0 + 3.0 * t - GRAVITY / 2 * t**2 + wobble * np.sin(9 * t)
    return q


def flight_problem(functions, body, q, gain=500.0, style=None):
    """Nothing touches; joints are free; without springs E = 0 is within reach."""
    feet = flat_feet(functions, body, q, held=False)
    return SpacetimeProblem(
        body, RATE, feet, FREE, style or plain_style(), functions,
        SpacetimeSettings(sigmoid_gain=gain),
    )  # fmt: skip


def bent(standing, frames):
    """Coordinates (F, 35) of a body that stands still with its joints inside their ranges."""
    q = np.tile(standing, (frames, 1))
    for name, degrees in (("shoulder_abduction", 8), ("elbow_flexion", 10), ("knee_flexion", 8)):
        for side in "rl":
            q[:, COORDINATE_INDEX[f"{name}_{side}"]] = np.radians(degrees)
    for side in "rl":
        q[:, COORDINATE_INDEX[f"hip_flexion_{side}"]] = np.radians(4)
        q[:, COORDINATE_INDEX[f"ankle_dorsiflexion_{side}"]] = np.radians(4)
    return q


def standing_problem(functions, body, q, style, gain=20.0, ranges=FREE):
    """Both feet held all the time where `q` has them; ends kept."""
    feet = flat_feet(functions, body, q, held=True)
    settings = SpacetimeSettings(sigmoid_gain=gain)
    return SpacetimeProblem(body, RATE, feet, ranges, style, functions, settings, keep_ends=3)
