"""Spring shoes, eq. (9): its slopes, its energy, and its work on the body's coordinates."""

import numpy as np
import pytest

from motionstyle.body.kinematics import (
    contact_points,
    coordinate_axes,
    forward_kinematics,
    point_jacobian,
)
from motionstyle.body.layout import CONTACT_POINT_NODES, CONTACT_POINTS
from motionstyle.dynamics.shoes import Shoes

SHOES = Shoes(stiffness=23000.0, rest_length=0.012)
HEIGHTS = np.array([-0.004, 0.0, 0.006, 0.011, 0.0119, 0.0125, 0.016, 0.05])


def test_a_pressed_shoe_is_a_spring_and_a_lifted_one_nothing():
    pressed = SHOES.force(np.array([0.002]))[0]
    assert pressed == pytest.approx(23000 * 0.010, rel=1e-4)
    assert abs(SHOES.force(np.array([0.05]))[0]) < 1e-12


def test_slopes_over_height_and_parameters_are_finite_differences():
    e = 1e-7
    found = (SHOES.force(HEIGHTS + e) - SHOES.force(HEIGHTS - e)) / (2 * e)
    np.testing.assert_allclose(SHOES.force_by_height(HEIGHTS), found, rtol=1e-5, atol=1e-4)
    slopes = SHOES.force_by_parameters(HEIGHTS)
    stiffer = Shoes(SHOES.stiffness + 1, SHOES.rest_length).force(HEIGHTS)
    np.testing.assert_allclose(slopes[:, 0], stiffer - SHOES.force(HEIGHTS), rtol=1e-6, atol=1e-9)
    longer = Shoes(SHOES.stiffness, SHOES.rest_length + e).force(HEIGHTS)
    shorter = Shoes(SHOES.stiffness, SHOES.rest_length - e).force(HEIGHTS)
    np.testing.assert_allclose(slopes[:, 1], (longer - shorter) / (2 * e), rtol=1e-5, atol=1e-4)


def test_its_generalised_force_is_minus_the_slope_of_its_energy(plain_body):
    """Q_s of eq. (9) against −∂/∂q ½k(h̄ − h)² by differences, well inside the pressed range."""
    rng = np.random.default_rng(3)
    q = rng.normal(0, 0.2, (1, 35))
    heel = CONTACT_POINTS.index("heel_r")

    def height(coordinates):
        return contact_points(plain_body, forward_kinematics(plain_body, coordinates))[:, heel, 1]

    q[0, 1] -= height(q)[0] - 0.003  # the heel 9 mm below the rest length
    pose = forward_kinematics(plain_body, q)
    points = contact_points(plain_body, pose)
    jacobian = point_jacobian(pose, coordinate_axes(pose, q), np.array(CONTACT_POINT_NODES), points)
    ours = SHOES.force(height(q))[0] * jacobian[0, heel, 1]
    energy = []
    for sign in (1, -1):
        moved = np.repeat(q, 35, axis=0) + sign * 1e-6 * np.eye(35)
        energy.append(0.5 * SHOES.stiffness * (SHOES.rest_length - height(moved)) ** 2)
    np.testing.assert_allclose(ours, -(energy[0] - energy[1]) / 2e-6, rtol=2e-3, atol=1e-3)
