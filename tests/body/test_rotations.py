"""Exponential maps against SciPy, series and finite differences; continuity in time."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from motionstyle.body.rotations import (
    LARGEST_ANGLE,
    exponential,
    left_jacobian,
    logarithm,
    shortest_arc,
    skew,
    slerp,
    unroll,
)

component = st.floats(-1.0, 1.0, allow_subnormal=False)
vector = st.tuples(component, component, component).map(np.array)
direction = vector.filter(lambda v: np.linalg.norm(v) > 0.1).map(lambda v: v / np.linalg.norm(v))


def series_exponential(v, terms=40):
    """Σ [v]×ⁿ / n!, the definition."""
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    total, power = np.eye(3), np.eye(3)
    for n in range(1, terms):
        power = power @ cross / n
        total = total + power
    return total


@given(direction, st.floats(0.0, 2 * np.pi))
def test_exponential_is_the_matrix_exponential_and_scipys_rotation(axis, angle):
    v = axis * angle
    assert np.allclose(exponential(v), series_exponential(v), atol=1e-12)
    assert np.allclose(exponential(v), expm(skew(v)), atol=1e-12)
    assert np.allclose(exponential(v), Rotation.from_rotvec(v).as_matrix(), atol=1e-14)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-8, 1e-5, 1e-3])
def test_exponential_of_small_angles_is_its_taylor_series(angle):
    v = angle * np.array([0.6, 0.0, 0.8])
    cross = skew(v)
    taylor = np.eye(3) + (1 - angle**2 / 6) * cross + (0.5 - angle**2 / 24) * cross @ cross
    assert np.allclose(exponential(v), taylor, atol=1e-14)


@given(direction, st.floats(0.0, np.pi - 1e-6))
def test_logarithm_undoes_the_exponential(axis, angle):
    assert np.allclose(logarithm(exponential(axis * angle)), axis * angle, atol=1e-9)


@given(direction, st.floats(0.0, 10.0))
def test_logarithm_takes_the_smallest_equivalent(axis, angle):
    matrix = exponential(axis * angle)
    smallest = logarithm(matrix)
    assert np.linalg.norm(smallest) <= np.pi + 1e-12
    assert np.allclose(exponential(smallest), matrix, atol=1e-12)


def test_shapes_are_kept():
    v = np.random.default_rng(1).normal(size=(2, 5, 3))
    assert exponential(v).shape == (2, 5, 3, 3)
    assert logarithm(exponential(v)).shape == v.shape
    assert left_jacobian(v).shape == (2, 5, 3, 3)
    assert np.allclose(exponential(v)[1, 3], exponential(v[1, 3]), atol=0)
    assert exponential(v[0, 0]).shape == (3, 3)
    assert logarithm(np.eye(3)).shape == (3,)


@given(vector, vector)
def test_skew_is_the_cross_product(a, b):
    assert np.allclose(skew(a) @ b, np.cross(a, b), atol=1e-15)
    assert np.array_equal(skew(a), -skew(a).T)


def angular_velocity(v, rate, step=1e-6):
    """ω of d/dt exp(v + t·rate) at t = 0 by central differences, in the parent frame."""
    change = (exponential(v + step * rate) - exponential(v - step * rate)) / (2 * step)
    spin = change @ exponential(v).T
    return np.array([spin[2, 1], spin[0, 2], spin[1, 0]])


@given(direction, st.one_of(st.floats(0.0, 6.0), st.sampled_from([1e-9, 9.9e-5, 1.01e-4])), vector)
def test_left_jacobian_turns_rates_into_angular_velocity(axis, angle, rate):
    v = axis * angle
    assert np.allclose(left_jacobian(v) @ rate, angular_velocity(v, rate), atol=1e-7, rtol=0)


def test_left_jacobian_does_not_jump_where_its_series_ends():
    axis = np.array([0.36, 0.48, 0.8])
    below, above = left_jacobian(0.99999e-4 * axis), left_jacobian(1.00001e-4 * axis)
    assert np.abs(below - above).max() < 1e-8


def turning(axis, angles):
    """Rotation vectors as a reader gives them: never longer than π."""
    return logarithm(exponential(np.asarray(angles)[:, None] * axis))


@given(direction)
def test_unroll_is_continuous_through_half_a_turn(axis):
    angles = np.linspace(0.0, 1.7 * np.pi, 150)
    wrapped = turning(axis, angles)
    assert np.linalg.norm(np.diff(wrapped, axis=0), axis=1).max() > np.pi  # there is work to do
    result, jumps = unroll(wrapped)
    assert jumps == []
    assert np.allclose(result, angles[:, None] * axis, atol=1e-7)


def test_unroll_goes_back_through_half_a_turn_the_same_way():
    angles = np.pi + 0.4 * np.sin(np.linspace(0, 6 * np.pi, 300))
    result, jumps = unroll(turning(np.array([0.0, 0.6, 0.8]), angles))
    assert jumps == []
    assert np.linalg.norm(np.diff(result, axis=0), axis=1).max() < 0.05


def test_unroll_jumps_once_in_each_full_turn_and_reports_it():
    angles = np.linspace(0.0, 4 * 2 * np.pi, 800)
    axis = np.array([0.0, 1.0, 0.0])
    result, jumps = unroll(turning(axis, angles))
    steps = np.linalg.norm(np.diff(result, axis=0), axis=1)
    assert len(jumps) == 4
    assert jumps == [i + 1 for i in np.flatnonzero(steps > 0.1)]
    assert np.linalg.norm(result, axis=1).max() <= LARGEST_ANGLE
    assert np.allclose(exponential(result), exponential(angles[:, None] * axis), atol=1e-9)


@given(st.integers(0, 2**32 - 1))
def test_unroll_keeps_every_rotation_and_reports_every_jump(seed):
    rng = np.random.default_rng(seed)
    rate = rng.normal(size=3) + np.cumsum(0.3 * rng.normal(size=(400, 3)), axis=0)
    matrices = np.empty((400, 3, 3))
    matrices[0] = exponential(3 * rng.normal(size=3))
    for i in range(1, 400):
        matrices[i] = exponential(0.02 * rate[i]) @ matrices[i - 1]
    result, jumps = unroll(logarithm(matrices))
    assert np.allclose(exponential(result), matrices, atol=1e-9)
    steps = np.linalg.norm(np.diff(result, axis=0), axis=1)
    # where exp is not singular a small turn is a small step; what is larger is a jump
    assert jumps == [i + 1 for i in np.flatnonzero(steps > np.pi)]
    largest = np.linalg.norm(result, axis=1).max()
    assert largest <= LARGEST_ANGLE


def test_unroll_passes_through_the_identity_of_a_full_turn_as_one_jump():
    angles = np.concatenate([np.linspace(0.7, 1.7, 30), [2.0], np.linspace(2.1, 2.5, 20)]) * np.pi
    result, jumps = unroll(turning(np.array([0.0, 0.0, 1.0]), angles))
    assert jumps == [30]
    assert np.allclose(result[29], [0, 0, 1.7 * np.pi], atol=1e-9)
    assert np.allclose(result[30], 0, atol=1e-9)


def test_unroll_leaves_its_argument_alone():
    vectors = turning(np.array([1.0, 0.0, 0.0]), np.linspace(0, 5, 50))
    before = vectors.copy()
    unroll(vectors)
    assert np.array_equal(vectors, before)


@given(direction, direction, st.floats(0.1, 5), st.floats(0.1, 5))
def test_shortest_arc_turns_one_direction_into_the_other_by_their_angle(a, b, long, short):
    turn = shortest_arc(long * a, short * b)
    assert np.allclose(turn @ a, b, atol=1e-12)
    angle = np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)
    assert np.isclose(np.linalg.norm(logarithm(turn)), angle, atol=1e-7)


@given(direction)
def test_shortest_arc_of_opposite_directions_is_half_a_turn(a):
    turn = shortest_arc(a, -a)
    assert np.allclose(turn @ a, -a, atol=1e-12)
    assert np.isclose(np.linalg.det(turn), 1.0)
    assert np.isclose(np.trace(turn), -1.0, atol=1e-12)


@pytest.mark.parametrize("exponent", range(-15, -2))
def test_shortest_arc_is_exact_for_almost_opposite_directions(exponent):
    rng = np.random.default_rng(0)
    for _ in range(200):
        a, nudge = rng.normal(size=(2, 3))
        a /= np.linalg.norm(a)
        b = -a + 10.0**exponent * nudge
        b /= np.linalg.norm(b)
        assert np.allclose(shortest_arc(a, b) @ a, b, atol=1e-11)


@given(direction)
def test_shortest_arc_of_equal_directions_is_the_identity(a):
    assert np.allclose(shortest_arc(a, 2 * a), np.eye(3), atol=1e-12)


def test_slerp_turns_evenly():
    start, axis = exponential(np.array([0.3, -0.2, 0.9])), np.array([0.0, 0.6, 0.8])
    matrices = np.stack([start, exponential(2.0 * axis) @ start])
    middle = slerp(matrices, np.array([1.0, 3.0]), np.array([1.0, 1.5, 3.0]))
    assert np.allclose(middle[0], start, atol=1e-12)
    assert np.allclose(middle[1], exponential(0.5 * axis) @ start, atol=1e-12)
    assert np.allclose(middle[2], matrices[1], atol=1e-12)
