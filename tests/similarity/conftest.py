"""Made-up walkers: one walk whose numbers are known, varied by style, subject and noise."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from motionstyle.body.layout import COORDINATE_INDEX
from motionstyle.configuration import read_settings
from motionstyle.motion.motion import Motion
from motionstyle.similarity.bank import Bank, build_bank
from motionstyle.similarity.events import EventRules

sys.path.append(str(Path(__file__).parents[1] / "evaluation"))
import synthetic_walk

ROOT = Path(__file__).parents[2]
RULES = EventRules(simultaneous_s=0.06, standing_s=0.6, fewest=3)


def varied_walk(name: str, *, seed: int, lean_deg: float = 0.0, **known: object) -> Motion:
    """A walk of 3 s with a lean of the trunk, its own step and smooth variation of the joints."""
    generator = np.random.default_rng(seed)
    former = synthetic_walk.STEP, synthetic_walk.SPEED
    step = float(generator.uniform(0.5, 0.72))
    synthetic_walk.STEP = step
    synthetic_walk.SPEED = 2 * step * synthetic_walk.RATE / synthetic_walk.STRIDE
    try:
        walk = synthetic_walk.make_walk(frames=300, **({"dataset": "cmu/made-up"} | known))
    finally:
        synthetic_walk.STEP, synthetic_walk.SPEED = former
    q = walk.coordinates.copy()
    phase = 2 * np.pi * np.arange(len(q)) / 100
    for column in range(len(COORDINATE_INDEX)):
        # legs and pelvis little, so that the feet hardly slip; trunk and arms more
        size = 0.003 if column < 3 else 0.008 if column < 20 else 0.05
        a, b, c = generator.normal(0, size, 3)
        q[:, column] += a * np.sin(phase) + b * np.cos(phase) + (c if column > 5 else 0)
    q[:, COORDINATE_INDEX["abdomen_flexion"]] += np.radians(lean_deg)
    return replace(walk, id=name, coordinates=q)


@pytest.fixture(scope="session")
def rules() -> EventRules:
    """The rules of the shipped settings."""
    return RULES


@pytest.fixture(scope="session")
def settings() -> dict:
    """The shipped settings, with fewer folds and draws so that tests are fast."""
    found = read_settings(
        ROOT / "config/similarity.yaml", ROOT / "workflow/schemas/similarity.schema.json"
    )
    found["validation"] |= {"folds": 5, "bootstraps": 20}
    found["models"]["widths"] = [0.1, 0.5, 2.0]
    return found


@pytest.fixture(scope="session")
def walks() -> list[Motion]:
    """Ten walks of three subjects and one style."""
    return [
        varied_walk(f"walk_{k}", seed=k, subject=f"s{k % 3}", style="normal") for k in range(10)
    ]


@pytest.fixture(scope="session")
def bank(walks: list[Motion], rules: EventRules) -> Bank:
    """The bank of the ten walks."""
    return build_bank(walks, rules, ["walk", "run", "jump"])[0]


@pytest.fixture(scope="session")
def schema_settings() -> dict:
    """The shipped settings as they stand in the file."""
    return yaml.safe_load((ROOT / "config/similarity.yaml").read_text(encoding="utf-8"))
