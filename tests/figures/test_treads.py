"""Ground under feet in strips."""

from dataclasses import replace

import numpy as np

from motionstyle.body.layout import CONTACT_POINTS
from motionstyle.figures.skeleton import named_points
from motionstyle.figures.treads import HALF_M, tread_lines


def drawn(motion):
    return tread_lines(motion, named_points(motion.body, motion.coordinates))


def raised(motion, height):
    lift = np.zeros(motion.coordinates.shape[1])
    lift[1] = height
    return replace(motion, coordinates=motion.coordinates + lift)


def test_the_level_floor_and_feet_in_the_air_have_no_tread(plain_motion):
    on_step = raised(plain_motion, 0.4)
    flying = replace(on_step, contacts=np.zeros_like(on_step.contacts))
    assert all(np.isnan(path).all() for path in drawn(flying).values())
    points = named_points(plain_motion.body, plain_motion.coordinates)
    level = np.broadcast_to([0.0, 1.0, 0.0], plain_motion.contact_normals.shape)
    for height in (0.0, 0.05):  # of a point that bears just before it lifts
        on_floor = {name: path * [1, 0, 1] + [0, height, 0] for name, path in points.items()}
        flat = tread_lines(replace(plain_motion, contact_normals=level), on_floor)
        assert all(np.isnan(path).all() for path in flat.values())


def test_a_tread_lies_under_the_foot_that_stands_on_it(plain_motion):
    on_step = raised(plain_motion, 0.4)
    points = named_points(on_step.body, on_step.coordinates)
    lines = drawn(on_step)
    for side in "rl":
        own = [name.endswith(f"_{side}") for name in CONTACT_POINTS]
        seen = on_step.contacts[:, own].any(axis=1)
        one, other = lines[f"tread_{side}0"], lines[f"tread_{side}1"]
        np.testing.assert_array_equal(~np.isnan(one).any(axis=1), seen)
        np.testing.assert_allclose(np.linalg.norm(other - one, axis=1)[seen], 2 * HALF_M)
        heights = np.stack([points[name][:, 1] for name in CONTACT_POINTS], axis=1)[:, own]
        low, high = heights.min(axis=1)[seen], heights.max(axis=1)[seen]
        middle = 0.5 * (one + other)[seen, 1]
        assert ((middle >= low - 1e-9) & (middle <= high + 1e-9)).all()


def test_a_ramp_s_ground_follows_its_normal(plain_motion):
    angle = np.radians(8.0)
    normals = np.zeros_like(plain_motion.contact_normals)
    normals[..., 0], normals[..., 1] = -np.sin(angle), np.cos(angle)
    line = drawn(replace(plain_motion, contact_normals=normals))
    away = (line["tread_r1"] - line["tread_r0"])[~np.isnan(line["tread_r0"][:, 0])]
    assert len(away)
    np.testing.assert_allclose(away[:, 1] / away[:, 0], np.tan(angle))
