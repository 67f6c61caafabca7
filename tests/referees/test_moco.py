"""OpenSim Moco and our solver agree on the sliding mass of least effort.

Runs where OPENSIM_PYTHON names a Python with the package `opensim`, see `test_opensim.py`.
"""

import os
import subprocess
from pathlib import Path

import pytest

from motionstyle.evaluation.spacetime.known_optima import (
    DISTANCE_M,
    MASS_KG,
    RAIL_HZ,
    known_optima,
    known_optimum_row,
)

PYTHON = os.environ.get("OPENSIM_PYTHON")
SCRIPT = Path(__file__).with_name("opensim_sliding_mass.py")


@pytest.mark.skipif(not PYTHON, reason="OPENSIM_PYTHON names no Python with the package opensim")
def test_moco_finds_the_same_effort(plain_body, all_functions, tmp_path):
    done = subprocess.run(
        [PYTHON, str(SCRIPT), str(MASS_KG), str(DISTANCE_M), "1.0"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    effort = float(next(x.split()[1] for x in done.stdout.splitlines() if x.startswith("effort")))
    sliding = known_optima(plain_body, all_functions)[2]
    row = known_optimum_row(sliding, seed=1)
    # E sums α u² over frames; Moco integrates u². The ends count half in an integral.
    ends = 2 * (6 * MASS_KG * DISTANCE_M) ** 2
    ours = (29 * row["E_solver"] - ends / 2) / RAIL_HZ
    assert effort == pytest.approx(12 * MASS_KG**2 * DISTANCE_M**2, rel=2e-3)
    assert ours == pytest.approx(effort, rel=2e-3)
