"""OpenSim reads the exports, and its own inverse dynamics finds our joint moments.

Runs where OPENSIM_PYTHON names a Python with the package `opensim` (in an environment of its own,
`pip install opensim`, 400 MB; no lock file holds it). Legs and pelvis become an OpenSim model out
of its own joints; its tool gets the exported angles, forces and external loads.
"""

import json
import os
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionstyle.body.layout import CONTACT_POINTS, NODES
from motionstyle.dynamics.codegen import load_functions
from motionstyle.dynamics.functions import dynamics_functions
from motionstyle.evaluation.joint_loads import joint_loads
from motionstyle.mocap.formats.mot import read_mot
from motionstyle.motion.opensim_export import (
    ground_reactions,
    opensim_angles,
    write_external_loads,
    write_storage,
)

PYTHON = os.environ.get("OPENSIM_PYTHON")
SCRIPT = Path(__file__).with_name("opensim_inverse_dynamics.py")


@pytest.mark.skipif(not PYTHON, reason="OPENSIM_PYTHON names no Python with the package opensim")
def test_opensim_finds_the_same_moments(plain_motion, tmp_path):
    toes = [i for i, name in enumerate(CONTACT_POINTS) if name.startswith("toe")]
    forces = plain_motion.contact_forces.copy()
    forces[:, toes] = 0.0  # external loads act on the hind foot
    motion = replace(plain_motion, contact_forces=forces)
    functions = load_functions(dynamics_functions, None)
    ours, times = joint_loads(motion, functions).columns(), motion.times
    angles, reactions = opensim_angles(motion), ground_reactions(motion)
    write_storage(tmp_path / "angles.mot", "made", times, angles, in_degrees=True)
    write_storage(tmp_path / "grf.mot", "made", times, reactions, in_degrees=False)
    write_external_loads(tmp_path / "loads.xml", "grf.mot")
    body = motion.body
    parts = zip(
        NODES, body.joint_offsets * (np.arange(18) > 0)[:, None], body.masses, body.coms,
        body.inertias, strict=True,
    )  # fmt: skip
    described = {
        node: {
            "offset": offset.tolist(),
            "mass": float(mass),
            "com": com.tolist(),
            "inertia": inertia.tolist(),
        }
        for node, offset, mass, com, inertia in parts
    }
    (tmp_path / "body.json").write_text(json.dumps(described), encoding="utf-8")
    done = subprocess.run(
        [PYTHON, str(SCRIPT)], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert f"angles {motion.frames} yes" in done.stdout
    found = read_mot(tmp_path / "found.sto")
    inner = (times > 0.1) & (times < times[-1] - 0.1)
    names = ("hip_flexion", "hip_adduction", "hip_rotation", "knee_angle", "ankle_angle")
    for name in (f"{n}_{side}_moment" for n in (*names, "subtalar_angle") for side in "rl"):
        theirs = np.interp(times, found.times, found.column(name))
        away = np.sqrt(((theirs - ours[name])[inner] ** 2).mean())
        assert away < 1e-3 * np.abs(ours[name][inner]).max() + 0.005, name
