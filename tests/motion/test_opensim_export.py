"""OpenSim files: read back by our own reader, angles of the body, wrenches of the feet kept."""

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionstyle.body.kinematics import contact_points
from motionstyle.body.layout import COORDINATE_INDEX, NODE_INDEX
from motionstyle.errors import MotionStyleError
from motionstyle.mocap.formats.mot import PlateColumns, forces_from_mot, read_mot
from motionstyle.motion.mirror import mirror_motion
from motionstyle.motion.opensim_export import (
    ground_reactions,
    opensim_angles,
    write_external_loads,
    write_no_motion,
    write_storage,
)

PLATES = {
    side: PlateColumns(f"ground_force_{side}_v", f"ground_force_{side}_p", f"ground_torque_{side}_")
    for side in "rl"
}


def test_angles_survive_the_file(plain_motion, tmp_path):
    columns = opensim_angles(plain_motion)
    write_storage(tmp_path / "a.mot", "plain", plain_motion.times, columns, in_degrees=True)
    table = read_mot(tmp_path / "a.mot")
    assert table.in_degrees
    assert table.columns == ("time", *columns)
    np.testing.assert_allclose(table.times, plain_motion.times, atol=1e-9)
    for name, values in columns.items():
        np.testing.assert_allclose(table.column(name), values, rtol=1e-8, atol=1e-8)


def test_ball_joints_turn_as_the_file_says(plain_motion):
    columns, pose = opensim_angles(plain_motion), plain_motion.pose()
    pelvis = pose.rotations[:, NODE_INDEX["pelvis"]]
    angles = np.stack([columns[f"pelvis_{n}"] for n in ("tilt", "list", "rotation")], axis=1)
    again = Rotation.from_euler("ZXY", angles, degrees=True).as_matrix()
    np.testing.assert_allclose(again, pelvis, atol=1e-12)
    thigh = np.swapaxes(pelvis, 1, 2) @ pose.rotations[:, NODE_INDEX["thigh_l"]]
    angles = np.stack([columns[f"hip_{n}_l"] for n in ("flexion", "adduction", "rotation")], 1)
    angles *= [1, -1, -1]  # OpenSim's left hip turns about −x and −y
    again = Rotation.from_euler("ZXY", angles, degrees=True).as_matrix()
    np.testing.assert_allclose(again, thigh, atol=1e-12)
    knee = plain_motion.coordinates[:, COORDINATE_INDEX["knee_flexion_r"]]
    np.testing.assert_allclose(columns["knee_angle_r"], np.degrees(knee))


def test_a_mirrored_motion_has_the_same_angles_on_the_other_side(plain_motion):
    columns, other = opensim_angles(plain_motion), opensim_angles(mirror_motion(plain_motion))
    for name in ("hip_flexion", "hip_adduction", "hip_rotation", "arm_add", "subtalar_angle"):
        np.testing.assert_allclose(columns[f"{name}_r"], other[f"{name}_l"], atol=1e-9)


def test_feet_keep_their_wrench_and_our_reader_takes_the_file_for_plates(plain_motion, tmp_path):
    columns = ground_reactions(plain_motion)
    write_storage(tmp_path / "g.mot", "plain", plain_motion.times, columns, in_degrees=False)
    record = forces_from_mot(read_mot(tmp_path / "g.mot"), PLATES)
    points = contact_points(plain_motion.body, plain_motion.pose())
    for foot, own in enumerate((slice(0, 4), slice(4, 8))):
        force = plain_motion.contact_forces[:, own]
        np.testing.assert_allclose(record.force[foot], force.sum(axis=1), rtol=1e-7, atol=1e-6)
        expected = np.cross(points[:, own], force).sum(axis=1)
        centre = np.nan_to_num(record.centre[foot])
        found = np.cross(centre, record.force[foot]) + record.moment[foot]
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-4)
        standing = force[..., 1].sum(axis=1) > 20
        assert standing.any()
        low, high = (f(points[standing][:, own, 0], axis=1) for f in (np.min, np.max))
        assert (centre[standing, 0] >= low - 1e-6).all()
        assert (centre[standing, 0] <= high + 1e-6).all()


def test_a_foot_in_the_air_has_zeros_and_no_nan(plain_motion):
    flight = replace(plain_motion, contact_forces=np.zeros((plain_motion.frames, 8, 3)))
    assert all((values == 0).all() for values in ground_reactions(flight).values())


def test_ground_reactions_of_a_kinematic_motion_are_refused(plain_motion):
    with pytest.raises(MotionStyleError, match="no contact forces"):
        ground_reactions(replace(plain_motion, contact_forces=None))


def test_external_loads_name_columns_that_the_forces_file_has(plain_motion, tmp_path):
    write_external_loads(tmp_path / "l.xml", "g.mot")
    loads = ET.parse(tmp_path / "l.xml").getroot().find("ExternalLoads")
    assert loads.findtext("datafile") == "g.mot"
    names = list(ground_reactions(plain_motion))
    forces = loads.findall("objects/ExternalForce")
    assert [f.findtext("applied_to_body") for f in forces] == ["calcn_r", "calcn_l"]
    for force in forces:
        for kind in ("force", "point", "torque"):
            prefix = force.findtext(f"{kind}_identifier")
            assert all(prefix + axis in names for axis in "xyz")


def test_a_motion_that_failed_is_a_file_that_says_so(tmp_path):
    write_no_motion(tmp_path / "n.mot", "the fit failed")
    assert "the fit failed" in (tmp_path / "n.mot").read_text(encoding="utf-8")
    with pytest.raises(MotionStyleError, match="no rows follow"):
        read_mot(tmp_path / "n.mot")
