"""Springs and dampers: eq. (6) by hand, and eq. (22) recovers what made the forces."""

import numpy as np
import pytest

from motionstyle.dynamics.passive import PassiveParameters, initial_passive, passive_forces, sigmoid


def parameters(above, below, damping, rest):
    return PassiveParameters(*(np.full(29, float(v)) for v in (above, below, damping, rest)))


def test_each_side_of_the_rest_angle_has_its_own_stiffness():
    spring = parameters(40, 90, 3, 0.2)
    angles = np.tile([[0.5], [0.2], [-0.1]], 29)
    rates = np.tile([[0.0], [2.0], [-1.0]], 29)
    expected = [-40 * 0.3, -3 * 2.0, 90 * 0.3 + 3.0]
    np.testing.assert_allclose(passive_forces(spring, angles, rates)[:, 0], expected, rtol=1e-9)


def test_the_sigmoid_is_that_of_equation_7():
    x = np.array([-1.0, -0.002, 0.0, 0.002, 1.0])
    expected = [0.0, 0.5 * (1 - np.tanh(1)), 0.5, 0.5 * (1 + np.tanh(1)), 1.0]
    np.testing.assert_allclose(sigmoid(x), expected, atol=1e-12)
    steps = np.linspace(-0.02, 0.02, 401)
    assert (np.diff(sigmoid(steps)) > 0).all()
    np.testing.assert_allclose(sigmoid(steps) + sigmoid(-steps), 1.0, atol=1e-15)


def test_springs_pull_towards_rest_without_a_jump():
    spring = parameters(400, 20, 0, 0.1)
    angles = 0.1 + np.linspace(-0.02, 0.02, 801)[:, None] * np.ones(29)
    force = passive_forces(spring, angles, np.zeros_like(angles))[:, 0]
    assert (force[:400] > 0).all()
    assert (force[401:] < 0).all()
    assert force[400] == pytest.approx(0, abs=1e-9)
    assert np.abs(np.diff(force)).max() < 0.05  # N·m between neighbours 5e-5 rad apart


def test_dampers_take_energy_away():
    rng = np.random.default_rng(8)
    rates = rng.standard_normal((50, 29))
    force = passive_forces(parameters(0, 0, 7, 0), np.zeros((50, 29)), rates)
    np.testing.assert_allclose(force, -7 * rates)


def test_springs_and_dampers_are_recovered_from_the_forces_they_explain():
    rng = np.random.default_rng(4)
    angles, rates = rng.standard_normal((80, 29)) * 0.4, rng.standard_normal((80, 29)) * 2
    true = PassiveParameters(
        rng.uniform(10, 200, 29), rng.uniform(10, 200, 29), rng.uniform(0, 9, 29), angles.mean(0)
    )
    found = initial_passive(angles, rates, passive_forces(true, angles, rates))
    np.testing.assert_allclose(found.stiffness_above, true.stiffness_above, rtol=1e-6)
    np.testing.assert_allclose(found.stiffness_below, true.stiffness_below, rtol=1e-6)
    np.testing.assert_allclose(found.damping, true.damping, atol=1e-6)


def test_no_spring_creates_energy():
    """Forces that push away from rest and along the motion leave all parameters at zero."""
    turn = np.linspace(0, 2 * np.pi, 60, endpoint=False)[:, None] * np.ones(29)
    angles, rates = np.sin(turn), np.cos(turn)
    found = initial_passive(angles, rates, 300 * angles + 10 * rates)
    for stiffness in (found.stiffness_above, found.stiffness_below, found.damping):
        assert stiffness.max() == pytest.approx(0, abs=1e-5)


def test_a_locked_joint_has_no_springs():
    found = initial_passive(np.zeros((20, 29)), np.zeros((20, 29)), np.ones((20, 29)))
    assert (found.stiffness_above == 0).all()
    assert (found.damping == 0).all()
