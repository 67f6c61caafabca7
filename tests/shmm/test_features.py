"""Features and pose channels of a made-up walk."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motionstyle.body.kinematics import centre_of_mass, forward_kinematics
from motionstyle.body.layout import COORDINATE_INDEX
from motionstyle.body.rotations import exponential
from motionstyle.errors import MotionStyleError
from motionstyle.shmm.contact_cleanup import clean_up
from motionstyle.shmm.features import (
    CHANNELS,
    coordinates_of,
    joint_scales,
    learn_features,
    mean_body,
    pose_channels,
)
from motionstyle.shmm.machine import MachineSettings, learn_machine, motion_from, prepared
from motionstyle.shmm.schedule import Schedule

LIGHT = MachineSettings(
    states=12, dimensions=3, style_dof=2, schedule=Schedule(start_temperature=2.0, steps=15)
)


def turned(motion, angle):
    """Return the motion in a world turned about the vertical, with a curved way."""
    q = motion.coordinates.copy()
    yaw = angle + 0.6 * np.linspace(0, 1, len(q))
    turn = exponential(np.outer(yaw, [0.0, 1.0, 0.0]))
    q[:, :3] = np.einsum("fab,fb->fa", turn, q[:, :3])
    from motionstyle.body.rotations import logarithm

    q[:, 3:6] = logarithm(turn @ exponential(q[:, 3:6]))
    return replace(motion, coordinates=q)


def test_channels_are_integrated_back_exactly(plain_motion):
    curved = turned(plain_motion, 0.0)
    channels = pose_channels(curved)
    assert channels.shape == (curved.frames, len(CHANNELS))
    back, jumps = coordinates_of(channels, curved.rate_hz)
    assert jumps == ()
    np.testing.assert_allclose(back[:, 6:], curved.coordinates[:, 6:])
    np.testing.assert_allclose(back[:, 1], curved.coordinates[:, 1])
    ours = forward_kinematics(curved.body, back).positions
    theirs = curved.pose().positions
    # the same shape of the whole way, whatever its heading
    ours, theirs = (points - points[:1, :1] for points in (ours, theirs))
    lengths = [np.linalg.norm(np.diff(p[:, 0], axis=0), axis=1) for p in (ours, theirs)]
    np.testing.assert_allclose(lengths[0], lengths[1], atol=1e-12)
    np.testing.assert_allclose(
        np.linalg.norm(ours[-1, 0]), np.linalg.norm(theirs[-1, 0]), atol=1e-9
    )


def test_channels_do_not_know_the_heading(plain_motion):
    a, b = pose_channels(plain_motion), pose_channels(turned(plain_motion, 0.0))
    np.testing.assert_allclose(
        pose_channels(turned(plain_motion, 1.2))[:, :33], b[:, :33], atol=1e-9
    )
    assert abs(a[:, -1].mean()) < 0.05


def test_scales_are_finite_differences_of_the_centres_of_mass(plain_motion):
    one = plain_motion.window(10, 10)
    scales = joint_scales([one])
    name, step = "hip_flexion_r", 1e-5
    moved = one.coordinates.copy()
    moved[0, COORDINATE_INDEX[name]] += step
    body = one.body
    change = []
    for q in (one.coordinates, moved):
        pose = forward_kinematics(body, q)
        local = np.einsum("nab,nb->na", pose.rotations[0], body.coms)
        change.append(pose.positions[0] + local)
    per_rad = np.linalg.norm(change[1] - change[0], axis=1) / step
    expected = np.sqrt((body.masses / body.mass * per_rad**2).sum())
    assert scales[COORDINATE_INDEX[name] - 6] == pytest.approx(expected, rel=1e-4)
    assert np.isfinite(centre_of_mass(body, one.pose())).all()


def test_a_sequence_loses_its_mean_pose_only_if_asked(plain_motion):
    leaning = plain_motion.coordinates.copy()
    leaning[:, COORDINATE_INDEX["abdomen_flexion"]] += 0.3
    motions = [plain_motion, replace(plain_motion, id="leaning", coordinates=leaning)]
    with_posture = learn_features(motions, 3, own_mean=True)
    without = learn_features(motions, 3, own_mean=False)
    gaps = [
        np.linalg.norm(s.features(motions[0]).mean(0) - s.features(motions[1]).mean(0))
        for s in (with_posture, without)
    ]
    assert gaps[0] > 0.02
    assert gaps[1] == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(with_posture.basis.T @ with_posture.basis, np.eye(3), atol=1e-12)


def test_more_dimensions_than_the_joints_move_in_is_one_clear_error(plain_motion):
    still = replace(
        plain_motion, coordinates=np.repeat(plain_motion.coordinates[:1], 30, axis=0),
        contacts=plain_motion.contacts[:30], contact_normals=plain_motion.contact_normals[:30],
        contact_forces=None,
    )  # fmt: skip
    with pytest.raises(MotionStyleError, match="move in 0 only: lower 'dimensions'"):
        learn_features([still], 2, own_mean=True)
    with pytest.raises(MotionStyleError, match="no motion to learn features from"):
        learn_features([], 2, own_mean=True)


def test_a_machine_of_two_motions_names_its_models(plain_motion):
    bigger = plain_motion.coordinates.copy()
    swing = [COORDINATE_INDEX[f"shoulder_flexion_{s}"] for s in "rl"]
    bigger[:, swing] *= 2
    other = replace(plain_motion, id="swinging", coordinates=bigger)
    machine = learn_machine([plain_motion, other], ["calm", "swinging"], LIGHT)
    assert machine.names == ("calm", "swinging")
    assert machine.coordinates("calm").shape == (2,)
    with pytest.raises(MotionStyleError, match=r"'swining' is no model.*did you mean swinging"):
        machine.index("swining")
    made = motion_from("x", pose_channels(machine.motions[0]), machine, style="calm")
    assert made.kind == "shmm"
    assert not made.observed[COORDINATE_INDEX["toes_extension_l"]]
    assert mean_body([plain_motion, other]) is machine.body or machine.body is other.body


def test_long_clips_are_cut_to_their_middle(plain_motion):
    cut = prepared(plain_motion, MachineSettings(longest_s=1.0, rate_hz=60.0))
    assert cut.frames == 60
    assert cut.rate_hz == 60.0
    assert prepared(plain_motion, MachineSettings(longest_s=9.0)).frames == 121


def test_clean_up_lets_the_standing_foot_rest(plain_motion):
    sliding = plain_motion.coordinates.copy()
    sliding[:, 0] = 0.0  # marching on the spot: the standing foot slides back
    march = replace(plain_motion, coordinates=sliding)
    from motionstyle.evaluation.style_machines.synthesis import skate_mm

    lowered = march.coordinates.copy()
    from motionstyle.body.kinematics import contact_points

    lowered[:, 1] -= contact_points(march.body, march.pose())[..., 1].min(axis=1)
    march = replace(march, coordinates=lowered)
    before, after = skate_mm(march), skate_mm(clean_up(march))
    assert after < 0.5 * before
    np.testing.assert_array_equal(clean_up(march).coordinates[:, 6:], march.coordinates[:, 6:])
