"""Features of segments and pairs: dimensions, invariances, subspaces that can be inverted."""

from dataclasses import replace

import numpy as np
import pytest
from sklearn.decomposition import PCA

from motionstyle.body.kinematics import forward_kinematics, points_in_world
from motionstyle.body.layout import NODES
from motionstyle.body.rotations import exponential, logarithm
from motionstyle.errors import MotionStyleError
from motionstyle.similarity.alignment import Segment
from motionstyle.similarity.features import (
    LEG_COORDINATES,
    from_samples,
    leg_vector,
    pair_vector,
    posture_frames,
    to_samples,
    whole_body_vector,
)
from motionstyle.similarity.leg_space import fit_leg_space

STEP = Segment("whole_body", 80, 130, "")


def test_a_leg_vector_holds_25_samples_of_7_joints(walks):
    segment = Segment("right_leg", 30, 90, "contact")
    vector = leg_vector(walks[0], segment)
    assert vector.shape == (175,)
    knee = walks[0].coordinates[30:91, LEG_COORDINATES["r"][3]]
    np.testing.assert_allclose(vector.reshape(7, 25)[3, [0, 12, 24]], knee[[0, 30, 60]], atol=1e-9)


def test_resampling_there_and_back_keeps_smooth_signals():
    frames = np.arange(40)
    signal = np.sin(2 * np.pi * frames / 40)
    back = from_samples(40) @ (to_samples(40) @ signal)
    np.testing.assert_allclose(back, signal, atol=2e-4)


def test_whole_body_features_do_not_change_with_heading_and_place(walks):
    before = whole_body_vector(walks[0], STEP)
    turn = exponential(np.array([0.0, 1.1, 0.0]))
    q = walks[0].coordinates.copy()
    q[:, :3] = q[:, :3] @ turn.T + [3.0, 0.0, -2.0]
    q[:, 3:6] = logarithm(turn @ exponential(q[:, 3:6]))
    np.testing.assert_allclose(
        whole_body_vector(replace(walks[0], coordinates=q), STEP), before, atol=1e-9
    )


def test_the_character_faces_left_and_walks_that_way(walks):
    own = whole_body_vector(walks[0], STEP).reshape(6, 3, 3)
    assert own[-1, 0, 0] < own[0, 0, 0] - 0.3  # the upper body, in leg lengths
    assert (own[:, 0, 1] > own[:, 1, 1]).all()  # and it is above the legs
    assert (own[:, 1, 2] > own[:, 2, 2]).all()  # facing −x, the left leg is on the side of +z


def test_centres_of_mass_against_brute_force(walks):
    motion = walks[1]
    pose = forward_kinematics(motion.body, motion.coordinates)
    coms = points_in_world(pose, np.arange(len(NODES)), motion.body.coms)
    own = whole_body_vector(motion, STEP).reshape(6, 3, 3)
    frames = posture_frames(80, 130)
    left = [i for i, n in enumerate(NODES) if n in {"thigh_l", "shank_l", "foot_l", "toes_l"}]
    for k, frame in enumerate(frames):
        total = sum(motion.body.masses[i] * coms[frame, i] for i in left)
        height = total[1] / motion.body.masses[left].sum() / motion.body.leg_length
        assert own[k, 1, 1] == pytest.approx(height, abs=1e-12)


def test_pairs_have_108_and_30_numbers_in_the_papers_order():
    first, second = np.arange(54.0), 100 + np.arange(54.0)
    pair = pair_vector(first, second)
    assert pair.shape == (108,)
    np.testing.assert_array_equal(pair[:18], [*range(9), *range(100, 109)])
    assert pair_vector(np.zeros(15), np.ones(15)).tolist() == [0.0] * 15 + [1.0] * 15
    with pytest.raises(MotionStyleError, match="as many numbers"):
        pair_vector(np.zeros(15), np.zeros(14))


def test_features_of_an_impossible_segment_are_refused(walks):
    with pytest.raises(MotionStyleError, match="lies outside its 300 frames"):
        leg_vector(walks[0], Segment("left_leg", 280, 320, "contact"))
    q = walks[0].coordinates.copy()
    q[:, 3:6] = [0.0, 0.0, np.pi / 2]
    with pytest.raises(MotionStyleError, match="faces straight up or down"):
        whole_body_vector(replace(walks[0], coordinates=q), STEP)


def test_leg_space_against_scikit_learn_and_back():
    generator = np.random.default_rng(1)
    data = generator.normal(size=(40, 6)) @ generator.normal(size=(6, 175))
    data += 0.01 * generator.normal(size=(40, 175))
    space = fit_leg_space(data, "left_leg")
    referee = PCA(whiten=True).fit(data)
    own, others = space.standardise(data, 6), referee.transform(data)[:, :6]
    np.testing.assert_allclose(np.abs(own), np.abs(others), atol=1e-8)
    np.testing.assert_allclose(own.std(axis=0, ddof=1), 1.0)
    np.testing.assert_allclose(
        space.cumulative_variance()[:39], np.cumsum(referee.explained_variance_ratio_)[:39]
    )
    np.testing.assert_allclose(space.restore(space.standardise(data, space.size)), data, atol=1e-9)


def test_leg_space_of_too_few_or_equal_segments_is_refused():
    with pytest.raises(MotionStyleError, match="2 leg segments, at least 3"):
        fit_leg_space(np.zeros((2, 175)), "left_leg")
    with pytest.raises(MotionStyleError, match="all leg segments are equal"):
        fit_leg_space(np.ones((5, 175)), "left_leg")
