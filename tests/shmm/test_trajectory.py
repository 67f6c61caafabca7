"""The most likely trajectory against numerical minimisation and a dense solve."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from motionstyle.errors import MotionStyleError
from motionstyle.shmm.trajectory import (
    PoseStates,
    dense_system,
    most_likely_trajectory,
    refitted_means,
    with_differences,
)


def problem(rng, states=4, d=3, frames=9, *, hard=False):
    roots = rng.normal(size=(states, 2 * d, 2 * d))
    pose = PoseStates(
        rng.normal(size=(states, 2 * d)), roots @ np.swapaxes(roots, 1, 2) + 0.3 * np.eye(2 * d)
    )
    if hard:
        return np.eye(states)[rng.integers(states, size=frames)], pose
    weights = rng.gamma(0.5, size=(frames, states))
    return weights / weights.sum(axis=1, keepdims=True), pose


def energy(y, occupancy, pose):
    """Return minus the exponent of eq. (20) for frames y_0 … y_T, written out plainly."""
    d = pose.coordinates
    y = y.reshape(-1, d)
    total = 0.0
    for t in range(1, len(y)):
        for n in range(len(pose.means)):
            off = np.concatenate([y[t], y[t] - y[t - 1]]) - pose.means[n]
            total += occupancy[t - 1, n] * off @ np.linalg.solve(pose.covariances[n], off) / 2
    return total


@pytest.mark.parametrize("hard", [False, True])
def test_it_is_the_minimum_of_the_energy(hard):
    occupancy, pose = problem(np.random.default_rng(8), hard=hard)
    found = most_likely_trajectory(occupancy, pose)
    start = np.zeros((len(occupancy) + 1) * pose.coordinates)
    best = minimize(energy, start, args=(occupancy, pose), method="BFGS", options={"gtol": 1e-8})
    np.testing.assert_allclose(found, best.x.reshape(-1, 3)[1:], atol=1e-5)


@pytest.mark.parametrize("frames", [1, 2, 60, 2047, 2048, 2049])
def test_the_banded_solve_equals_the_dense_one(frames):
    d = 3 if frames < 100 else 1
    occupancy, pose = problem(np.random.default_rng(9), d=d, frames=frames)
    found = most_likely_trajectory(occupancy, pose)
    matrix, right = dense_system(occupancy, pose)
    np.testing.assert_allclose(matrix, matrix.T, atol=1e-10)
    dense = np.linalg.solve(matrix, right).reshape(-1, d)[1:]
    np.testing.assert_allclose(found, dense, atol=1e-9)


def test_a_long_stay_in_one_state_rests_at_its_pose_and_moves_with_its_velocity():
    pose = PoseStates(np.array([[1.0, 0.0]]), np.diag([0.1, 0.01])[None])
    np.testing.assert_allclose(most_likely_trajectory(np.ones((50, 1)), pose), 1.0, atol=1e-10)
    moving = PoseStates(np.array([[0.0, 0.2]]), np.diag([1e8, 1e-4])[None])
    y = most_likely_trajectory(np.ones((20, 1)), moving)
    np.testing.assert_allclose(np.diff(y[:, 0]), 0.2, atol=1e-6)


def test_refitted_means_reconstruct_better():
    occupancy, pose = problem(np.random.default_rng(10), frames=30)
    target = np.random.default_rng(11).normal(size=(30, 3)).cumsum(axis=0) / 3
    means = refitted_means(occupancy, pose, target)
    before = np.abs(most_likely_trajectory(occupancy, pose) - target)
    after = np.abs(most_likely_trajectory(occupancy, PoseStates(means, pose.covariances)) - target)
    assert (after**2).sum() < 0.8 * (before**2).sum()


def test_differences_of_the_first_frame_are_those_of_the_second():
    y = np.array([[1.0], [3.0], [4.0]])
    np.testing.assert_array_equal(with_differences(y), [[1, 2], [3, 2], [4, 1]])
    np.testing.assert_array_equal(with_differences(y[:1]), [[1, 0]])


def test_occupancies_of_other_states_are_refused():
    _, pose = problem(np.random.default_rng(12))
    with pytest.raises(MotionStyleError, match="do not fit 4 states"):
        most_likely_trajectory(np.ones((5, 3)), pose)
