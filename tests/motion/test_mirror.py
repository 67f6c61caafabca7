"""The mirror image of a motion, against reflected forward kinematics and by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motionstyle.body.body import build_body
from motionstyle.body.kinematics import (
    centre_of_mass,
    contact_points,
    end_points,
    forward_kinematics,
)
from motionstyle.body.layout import (
    CONTACT_POINTS,
    COORDINATE_INDEX,
    COORDINATES,
    END_POINTS,
    NODE_INDEX,
    NODES,
)
from motionstyle.motion.mirror import mirror_body, mirror_motion

REFLECT = np.diag([1.0, 1.0, -1.0])


@pytest.fixture(scope="module")
def lopsided(plain_motion):
    """A motion in which no left side is like its right, with full inertia matrices."""
    rng = np.random.default_rng(8)
    geometry = plain_motion.body.geometry
    geometry = replace(
        geometry,
        joint_offsets=geometry.joint_offsets + 0.02 * rng.normal(size=(18, 3)),
        contact_points=geometry.contact_points + 0.01 * rng.normal(size=(8, 3)),
        end_points=geometry.end_points + 0.02 * rng.normal(size=(3, 3)),
    )
    body = build_body(geometry, 70.0)
    root = rng.normal(size=(18, 3, 3))
    body = replace(
        body,
        masses=body.masses * rng.uniform(0.8, 1.2, 18),
        inertias=body.inertias + 0.001 * root @ np.swapaxes(root, 1, 2),
        semi_axes=body.semi_axes * rng.uniform(0.8, 1.2, (18, 3)),
    )
    shape = plain_motion.contacts.shape
    return replace(
        plain_motion,
        coordinates=plain_motion.coordinates + 0.3 * rng.normal(size=(241, 35)),
        body=body,
        contacts=rng.uniform(size=shape) > 0.5,
        contact_normals=rng.normal(size=(*shape, 3)),
        contact_forces=rng.normal(size=(*shape, 3)),
        observed=rng.uniform(size=35) > 0.5,
        rebranched=(7,),
    )


def partner(name):
    return name[:-1] + {"r": "l", "l": "r"}[name[-1]] if name[-2:] in {"_r", "_l"} else name


def test_mirrored_twice_is_the_same_motion(lopsided):
    back = mirror_motion(mirror_motion(lopsided))
    for name in ("coordinates", "contacts", "contact_normals", "contact_forces", "observed"):
        assert np.array_equal(getattr(back, name), getattr(lopsided, name)), name
    for name in ("masses", "coms", "inertias", "semi_axes"):
        assert np.array_equal(getattr(back.body, name), getattr(lopsided.body, name)), name
    for name in ("joint_offsets", "contact_points", "end_points"):
        before = getattr(lopsided.body.geometry, name)
        assert np.array_equal(getattr(back.body.geometry, name), before), name
    for name in ("id", "kind", "rate_hz", "rebranched", "provenance"):
        assert getattr(back, name) == getattr(lopsided, name), name


def test_poses_of_the_mirrored_motion_are_reflected_poses(lopsided):
    mirrored = mirror_motion(lopsided)
    before, after = lopsided.pose(), mirrored.pose()
    assert np.abs(after.positions - before.positions).max() > 0.1  # it is another motion
    for name, i in NODE_INDEX.items():
        k = NODE_INDEX[partner(name)]
        assert np.allclose(after.positions[:, k], before.positions[:, i] @ REFLECT, atol=1e-12)
        reflected = REFLECT @ before.rotations[:, i] @ REFLECT
        assert np.allclose(after.rotations[:, k], reflected, atol=1e-12), name


def test_points_and_centre_of_mass_are_reflected(lopsided):
    mirrored = mirror_motion(lopsided)
    for points, names in ((contact_points, CONTACT_POINTS), (end_points, END_POINTS)):
        before = points(lopsided.body, lopsided.pose())
        after = points(mirrored.body, mirrored.pose())
        for i, name in enumerate(names):
            k = names.index(partner(name))
            assert np.allclose(after[:, k], before[:, i] @ REFLECT, atol=1e-12), name
    com = centre_of_mass(lopsided.body, lopsided.pose())
    assert np.allclose(centre_of_mass(mirrored.body, mirrored.pose()), com @ REFLECT, atol=1e-12)


def test_energy_of_rotation_is_the_same_in_the_mirror(lopsided):
    """½ ωᵀIω is what a mirror cannot change; ω is an axial vector."""
    mirrored = mirror_body(lopsided.body)
    omega = np.array([0.3, -1.1, 0.7])
    for name, i in NODE_INDEX.items():
        k = NODE_INDEX[partner(name)]
        assert mirrored.masses[k] == lopsided.body.masses[i]
        assert np.array_equal(mirrored.semi_axes[k], lopsided.body.semi_axes[i])
        energy = omega @ lopsided.body.inertias[i] @ omega
        seen = -REFLECT @ omega
        assert np.isclose(seen @ mirrored.inertias[k] @ seen, energy, rtol=1e-12), name


def test_products_of_inertia_with_z_change_sign(lopsided):
    before, after = lopsided.body.inertias[0], mirror_body(lopsided.body).inertias[0]
    assert after[0, 1] == before[0, 1]
    assert after[0, 2] == -before[0, 2]
    assert after[1, 2] == -before[1, 2]
    assert np.array_equal(np.diag(after), np.diag(before))


def test_contacts_normals_and_forces_change_sides(lopsided):
    mirrored = mirror_motion(lopsided)
    for i, name in enumerate(CONTACT_POINTS):
        k = CONTACT_POINTS.index(partner(name))
        assert np.array_equal(mirrored.contacts[:, k], lopsided.contacts[:, i])
        for field in ("contact_normals", "contact_forces"):
            expected = getattr(lopsided, field)[:, i] @ REFLECT
            assert np.array_equal(getattr(mirrored, field)[:, k], expected), (field, name)


def test_observed_coordinates_change_sides(lopsided):
    mirrored = mirror_motion(lopsided)
    for name, i in COORDINATE_INDEX.items():
        other = name if name.startswith("pelvis") else partner(name)
        assert mirrored.observed[COORDINATE_INDEX[other]] == lopsided.observed[i]


def test_unknown_forces_stay_unknown(plain_motion):
    assert mirror_motion(replace(plain_motion, contact_forces=None)).contact_forces is None


def test_name_and_provenance(plain_motion):
    mirrored = mirror_motion(plain_motion)
    assert mirrored.id == "plain_mirror"
    assert mirrored.provenance == {**plain_motion.provenance, "mirrored": True}
    assert "mirrored" not in plain_motion.provenance
    assert mirrored.kind == plain_motion.kind


def test_a_name_that_ends_like_a_mirror_image_is_kept(plain_motion):
    motion = replace(plain_motion, id="walk_mirror")
    assert mirror_motion(motion).id == "walk_mirror_mirror"
    assert mirror_motion(mirror_motion(motion)).id == "walk_mirror"


def test_a_symmetric_body_is_its_own_image(plain_body):
    mirrored = mirror_body(plain_body)
    assert np.allclose(mirrored.inertias, plain_body.inertias, atol=1e-15)
    assert np.allclose(mirrored.coms, plain_body.coms, atol=1e-15)
    assert np.allclose(mirrored.joint_offsets, plain_body.joint_offsets, atol=1e-15)


def test_a_raised_right_arm_becomes_a_raised_left_arm(plain_motion):
    q = np.zeros((1, len(COORDINATES)))
    q[0, COORDINATE_INDEX["shoulder_abduction_r"]] = 1.5
    motion = replace(plain_motion.window(0, 0), coordinates=q)
    pose = forward_kinematics(motion.body, mirror_motion(motion).coordinates)
    assert pose.positions[0, NODES.index("hand_l"), 2] < -0.5
    assert pose.positions[0, NODES.index("hand_r"), 2] < 0.3
