"""The study of forces: known errors of the total and of its sharing are told apart."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.force_plates import FootForce
from motionstyle.evaluation.force_study import STUDY_COLUMNS, read_study, study_row, variants
from motionstyle.spacetime.physical_problem import PhysicalSettings

STUDY = Path(__file__).parents[2] / "config/force_study.yaml"


@pytest.fixture
def two_feet(plain_motion):
    """Weight passes from the right to the left foot; the plates that saw it."""
    frames = 60
    motion = plain_motion.window(0, frames - 1)
    weight = motion.body.mass * 9.81
    share = np.clip((np.arange(frames) - 20) / 20, 0, 1)
    total = weight * (1 + 0.2 * np.sin(np.arange(frames) / 5))
    vertical = np.stack([total * (1 - share), total * share], axis=1)
    forces = np.zeros((frames, 8, 3))
    forces[:, 1, 1], forces[:, 5, 1] = vertical.T
    forces[:, [1, 5], 0] = 0.1 * forces[:, [1, 5], 1]
    plates = {}
    for foot, column in (("r", 1), ("l", 5)):
        plates[foot] = FootForce(motion.times, forces[:, column])
    return replace(motion, contact_forces=forces), plates, share


def test_what_agrees_has_no_error(two_feet):
    motion, plates, _share = two_feet
    row = study_row(motion, plates)
    assert set(row) <= set(STUDY_COLUMNS)
    assert row["vertical_correlation"] > 0.999
    assert row["vertical_rms_pctbw"] < 3  # plates are low-passed
    assert row["total_rms_own_pctbw"] < 1
    assert row["share_rms_pct"] < 3


def test_a_wrong_share_leaves_the_total(two_feet):
    motion, plates, share = two_feet
    forces = motion.contact_forces.copy()
    moved = 0.15 * forces.sum(axis=1)[:, 1] * ((share > 0.1) & (share < 0.9))
    forces[:, 1, 1] -= np.minimum(moved, forces[:, 1, 1])
    forces[:, 5, 1] += np.minimum(moved, motion.contact_forces[:, 1, 1])
    row = study_row(replace(motion, contact_forces=forces), plates)
    assert row["total_rms_own_pctbw"] < 2  # the mass is judged on either foot
    assert row["share_rms_pct"] == pytest.approx(14, abs=3)


def test_a_wrong_total_leaves_the_share(two_feet):
    motion, plates, _share = two_feet
    wave = 1 + 0.1 * np.sin(np.arange(60) / 2)
    forces = motion.contact_forces * wave[:, None, None]
    row = study_row(replace(motion, contact_forces=forces), plates)
    assert row["share_rms_pct"] < 3
    assert row["total_rms_own_pctbw"] == pytest.approx(7, abs=2)


def test_the_study_changes_settings_that_exist():
    known = {*PhysicalSettings.__dataclass_fields__, "rate_hz", "measured_markers"}
    found = variants(read_study(STUDY))
    assert found[0] == ("as configured", {})
    assert len({name for name, _ in found}) == len(found)
    assert all(set(changes) <= known for _, changes in found)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a: [", "not readable as YAML"),
        ("a: 1", "needs the keys development and variants"),
        ("development: []\nvariants: [{name: x}]", "each variant needs name and changes"),
    ],
)
def test_a_study_that_is_malformed_is_refused(tmp_path, text, said):
    (tmp_path / "study.yaml").write_text(text)
    with pytest.raises(MotionStyleError, match=said):
        read_study(tmp_path / "study.yaml")
