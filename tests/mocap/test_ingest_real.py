"""Real clips of the mirror, from their files to motions, against what was measured of them."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_body_fit import SKELETONS
from test_ingest import ingest

from motionstyle.body.layout import NODE_INDEX
from motionstyle.evaluation import gait
from motionstyle.mocap.datasets.doors import read_datasets
from motionstyle.mocap.datasets.sheet import read_sheet

MIRROR = Path(__file__).parents[3] / "shared" / "mocap"
MB, AALTO = "cmu/bvh-motionbuilder", "aalto-walks/t_"
T_FAST = f"{AALTO}walk_fast_t_walk_angry_t_walk_regular_100_000_000.bvh"
T_REGULAR = f"{AALTO}run_slow_t_limp_fast_t_walk_regular_000_000_100.bvh"
# path, floor tilt by README.md of the clips (None: level within 0.5 degrees)
REAL = {
    f"{MB}/07_01.bvh": (1.0, 1.15),
    f"{MB}/07_05.bvh": (1.0, 1.15),
    f"{MB}/08_01.bvh": (1.0, 1.3),
    f"{MB}/08_08.bvh": (1.0, 1.3),
    "cmu/bvh-daz/08_01.bvh": (1.0, 1.35),
    f"{MB}/09_01.bvh": None,
    T_FAST: (2.5, 3.0),
    T_REGULAR: (2.5, 2.9),
    "bandai/dataset-1/dataset-1_walk_normal_001.bvh": None,
    "bandai/dataset-2/dataset-2_run_normal_001.bvh": None,
    "xia-styles/neutral_01_000.bvh": None,
}


def ingest_real(path, action=None):
    config = SKELETONS.parent
    datasets = read_datasets(config / "datasets.tsv")
    rows = {row.path: row for row in read_sheet(config / "motions.full.tsv", datasets)}
    row = rows[path] if action is None else replace(rows[path], action=action)
    asf = [MIRROR / name for name in row.companions if name.endswith(".asf")]
    return ingest(MIRROR / path, row, skeleton_file=asf[0] if asf else None)


needs_mirror = pytest.mark.skipif(not MIRROR.is_dir(), reason="no mirror folder")


@pytest.mark.mirror
@needs_mirror
@pytest.mark.parametrize("path", REAL)
def test_real_clips_agree_with_what_was_measured_of_them(path):
    with (MIRROR / "manifest.csv").open() as file:
        measured = next(row for row in csv.DictReader(file) if row["path"] == path)
    out = ingest_real(path)
    motion, tilt = out.motion, out.report["floor_tilt_deg"]
    assert out.report["marker_rms_cm"] <= 1.5
    # the Daz conversion lets the feet of subject 08 slide
    assert gait.foot_slip_mm(motion) <= (12 if "daz" in path else 10)
    assert gait.penetration_mm(motion) <= 35  # of the worst point in the worst frame
    low, high = REAL[path] or (0.0, 0.5)
    assert low <= tilt <= high
    assert gait.mean_speed(motion) == pytest.approx(float(measured["mean_speed_mps"]), rel=0.1)
    assert np.median(gait.step_lengths(motion)) == pytest.approx(
        float(measured["median_step_m"]), rel=0.1
    )
    assert np.abs(motion.coordinates[0, [0, 2]]).max() < 0.02


@pytest.mark.mirror
@needs_mirror
def test_a_real_run_needs_the_gates_of_a_run():
    path = "bandai/dataset-2/dataset-2_run_normal_001.bvh"
    run, walk = ingest_real(path).motion, ingest_real(path, action="walk").motion
    assert len(gait.foot_stances(run)) >= 5
    assert run.contacts.sum() > walk.contacts.sum()


@pytest.mark.mirror
@needs_mirror
def test_bvh_and_amc_of_one_trial_are_one_motion():
    """The same trial, converted by others: other Euler angles, rounded to 1e-4 degrees or so.

    Such rounding adds up along a limb and leaves 0.03 degrees and 0.02 mm; an axis, a frame or a
    bone taken wrongly would show as degrees.
    """
    bvh, amc = (ingest_real(path).motion for path in (f"{MB}/02_01.bvh", "cmu/asfamc/02_01.amc"))
    assert bvh.frames == amc.frames == 343  # without the T-pose before it
    off = bvh.coordinates - amc.coordinates
    assert 1000 * np.abs(off[:, :3]).max() < 0.1
    assert np.degrees(np.abs(off[:, 3:]).max()) < 0.1
    apart = np.abs(bvh.body.joint_offsets - amc.body.joint_offsets).max(axis=1)
    # the bone that the conversion lost has its length back, but the direction of its neighbour
    restored = [NODE_INDEX[node] for node in ("head", "upper_arm_r", "upper_arm_l")]
    assert apart[restored].max() < 5e-3
    assert np.delete(apart, restored).max() < 1e-5
    assert (bvh.contacts != amc.contacts).mean() < 0.002
