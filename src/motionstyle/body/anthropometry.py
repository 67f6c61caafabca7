"""Segment masses, centres of mass and radii of gyration: de Leva 1996, Table 4.

P. de Leva, J. Biomechanics 29(9):1223–1230. Mass in percent of body mass; centre of mass and
radii of gyration in percent of segment length, the former from the first-named end; radii about
the sagittal (forward), transverse (lateral) and longitudinal axis through the centre of mass.
The table's masses sum to 100.00 % (male) and 99.99 % (female); they are normalised to 1 here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Sex = Literal["male", "female"]


@dataclass(frozen=True)
class Segment:
    """One row of the table as fractions; `com` is measured from the segment's first end."""

    mass: float
    com: float
    sagittal: float
    transverse: float
    longitudinal: float


def _percent(*values: float) -> Segment:
    return Segment(*(v / 100 for v in values))


# End points: head vertex→cervicale, upper trunk cervicale→xiphion, middle trunk
# xiphion→omphalion, lower trunk omphalion→mid-hip, hand wrist→3rd dactylion,
# shank knee→ankle joint centre, foot heel→toe tip (the alternative end points of the table
# where our joints are such points).
DE_LEVA: dict[Sex, dict[str, Segment]] = {
    "male": {
        "head": _percent(6.94, 50.02, 30.3, 31.5, 26.1),
        "upper_trunk": _percent(15.96, 50.66, 50.5, 32.0, 46.5),
        "middle_trunk": _percent(16.33, 45.02, 48.2, 38.3, 46.8),
        "lower_trunk": _percent(11.17, 61.15, 61.5, 55.1, 58.7),
        "upper_arm": _percent(2.71, 57.72, 28.5, 26.9, 15.8),
        "forearm": _percent(1.62, 45.74, 27.6, 26.5, 12.1),
        "hand": _percent(0.61, 36.24, 28.8, 23.5, 18.4),
        "thigh": _percent(14.16, 40.95, 32.9, 32.9, 14.9),
        "shank": _percent(4.33, 43.95, 25.1, 24.6, 10.2),
        "foot": _percent(1.37, 44.15, 25.7, 24.5, 12.4),
    },
    "female": {
        "head": _percent(6.68, 48.41, 27.1, 29.5, 26.1),
        "upper_trunk": _percent(15.45, 50.50, 46.6, 31.4, 44.9),
        "middle_trunk": _percent(14.65, 45.12, 43.3, 35.4, 41.5),
        "lower_trunk": _percent(12.47, 49.20, 43.3, 40.2, 44.4),
        "upper_arm": _percent(2.55, 57.54, 27.8, 26.0, 14.8),
        "forearm": _percent(1.38, 45.59, 26.1, 25.7, 9.4),
        "hand": _percent(0.56, 34.27, 24.4, 20.8, 15.4),
        "thigh": _percent(14.78, 36.12, 36.9, 36.4, 16.2),
        "shank": _percent(4.81, 43.52, 26.7, 26.3, 9.2),
        "foot": _percent(1.29, 40.14, 29.9, 27.9, 13.9),
    },
}
PAIRED_SEGMENTS = ("upper_arm", "forearm", "hand", "thigh", "shank", "foot")

# de Leva's male subjects stood 1.741 m, female ones 1.735 m; lengths of segments (m) that a
# capture may not show are scaled from these by the legs.
REFERENCE_LENGTHS: dict[Sex, dict[str, float]] = {
    "male": {"thigh": 0.4222, "shank": 0.4403, "foot": 0.2581, "head": 0.2429, "hand": 0.1879},
    "female": {"thigh": 0.3685, "shank": 0.4386, "foot": 0.2283, "head": 0.2437, "hand": 0.1701},
}

# Lower, middle and upper trunk (mid-hip→omphalion→xiphion→cervicale), m.
TRUNK_LENGTHS: dict[Sex, tuple[float, float, float]] = {
    "male": (0.1457, 0.2155, 0.2421),
    "female": (0.1815, 0.2053, 0.2280),
}

# Where the ball of the foot lies between heel and toe tip, and its share of the foot's mass
# behind it (our choice, nio.md §3).
BALL_FRACTION = 0.70
REARFOOT_MASS_FRACTION = 0.80
TOES_COM_FRACTION = 0.85


def total_mass(sex: Sex) -> float:
    """Return the sum of the table's mass fractions, both sides counted."""
    table = DE_LEVA[sex]
    return sum(s.mass * (2 if name in PAIRED_SEGMENTS else 1) for name, s in table.items())
