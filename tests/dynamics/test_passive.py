"""Springs and dampers: eq. (6) by hand, and eq. (22) recovers what made the forces."""

import numpy as np
import pytest

from motionstyle.dynamics.passive import PassiveParameters, initial_passive, passive_forces


def parameters(above, below, damping, rest):
    return PassiveParameters(*(np.full(29, float(v)) for v in (above, below, damping, rest)))


def test_each_side_of_the_rest_angle_has_its_own_stiffness():
    spring = parameters(40, 90, 3, 0.2)
    angles = np.tile([[0.5], [0.2], [-0.1]], 29)
    rates = np.tile([[0.0], [2.0], [-1.0]], 29)
    expected = [-40 * 0.3, -3 * 2.0, 90 * 0.3 + 3.0]
    np.testing.assert_allclose(passive_forces(spring, angles, rates)[:, 0], expected, rtol=1e-9)


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
