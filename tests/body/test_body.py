"""Masses, centres of mass and inertias against the tables and the closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motionstyle.body.anthropometry import (
    BALL_FRACTION,
    DE_LEVA,
    REARFOOT_MASS_FRACTION,
    TRUNK_LENGTHS,
    total_mass,
)
from motionstyle.body.body import DENSITY, build_body
from motionstyle.body.kinematics import centre_of_mass, forward_kinematics
from motionstyle.body.layout import NODE_INDEX, NODES
from motionstyle.errors import MotionStyleError

THIGH, SHANK, FOOT, TOES = (NODE_INDEX[f"{n}_r"] for n in ("thigh", "shank", "foot", "toes"))
ROWS = {
    "pelvis": "lower_trunk",
    "abdomen": "middle_trunk",
    "thorax": "upper_trunk",
    "head": "head",
    **{f"{n}_{s}": n for n in ("thigh", "shank", "upper_arm", "forearm", "hand") for s in "rl"},
}


def lengths(geometry, sex):
    """Segment lengths (m) between the table's end points, feet whole."""
    trunk = sum(geometry.joint_offsets[NODE_INDEX[n]] for n in ("abdomen", "thorax", "head"))
    hips = [geometry.joint_offsets[NODE_INDEX[f"thigh_{side}"]] for side in "rl"]
    trunk_length = float(np.linalg.norm(trunk - sum(hips) / 2))
    parts = TRUNK_LENGTHS[sex]
    norm = {n: float(np.linalg.norm(geometry.joint_offsets[i])) for n, i in NODE_INDEX.items()}
    found = {
        node: part / sum(parts) * trunk_length
        for node, part in zip(("pelvis", "abdomen", "thorax"), parts, strict=True)
    }
    found["head"] = float(np.linalg.norm(geometry.end_points[0]))
    for side, tip in zip("rl", geometry.end_points[1:], strict=True):
        found[f"thigh_{side}"] = norm[f"shank_{side}"]
        found[f"shank_{side}"] = norm[f"foot_{side}"]
        found[f"upper_arm_{side}"] = norm[f"forearm_{side}"]
        found[f"forearm_{side}"] = norm[f"hand_{side}"]
        found[f"hand_{side}"] = float(np.linalg.norm(tip))
    return found


# Typed from the published table, apart from the program's own copy: mass %, COM %, r_s, r_t, r_l.
PUBLISHED = """
head         6.94 50.02 30.3 31.5 26.1   6.68 48.41 27.1 29.5 26.1
upper_trunk 15.96 50.66 50.5 32.0 46.5  15.45 50.50 46.6 31.4 44.9
middle_trunk 16.33 45.02 48.2 38.3 46.8 14.65 45.12 43.3 35.4 41.5
lower_trunk 11.17 61.15 61.5 55.1 58.7  12.47 49.20 43.3 40.2 44.4
upper_arm    2.71 57.72 28.5 26.9 15.8   2.55 57.54 27.8 26.0 14.8
forearm      1.62 45.74 27.6 26.5 12.1   1.38 45.59 26.1 25.7  9.4
hand         0.61 36.24 28.8 23.5 18.4   0.56 34.27 24.4 20.8 15.4
thigh       14.16 40.95 32.9 32.9 14.9  14.78 36.12 36.9 36.4 16.2
shank        4.33 43.95 25.1 24.6 10.2   4.81 43.52 26.7 26.3  9.2
foot         1.37 44.15 25.7 24.5 12.4   1.29 40.14 29.9 27.9 13.9
"""


def test_the_tables_are_the_published_ones():
    lines = [line.split() for line in PUBLISHED.split("\n") if line]
    assert {name for name, *_ in lines} == set(DE_LEVA["male"]) == set(DE_LEVA["female"])
    for name, *values in lines:
        for sex, part in (("male", values[:5]), ("female", values[5:])):
            row = DE_LEVA[sex][name]
            found = [row.mass, row.com, row.sagittal, row.transverse, row.longitudinal]
            assert np.allclose(found, np.array(part, dtype=float) / 100, rtol=1e-12), (sex, name)


def test_the_tables_sum_to_100_00_and_99_99_percent():
    assert round(100 * total_mass("male"), 2) == 100.00
    assert round(100 * total_mass("female"), 2) == 99.99


@pytest.mark.parametrize("sex", ["male", "female"])
@pytest.mark.parametrize("mass", [41.3, 73.0, 120.0])
def test_masses_sum_to_the_given_mass(plain_geometry, sex, mass):
    body = build_body(plain_geometry, mass, sex)
    assert np.isclose(body.mass, mass, rtol=1e-14, atol=0)
    assert (body.masses > 0).all()


@pytest.mark.parametrize("sex", ["male", "female"])
def test_each_segment_has_its_share_of_the_mass(plain_geometry, sex):
    body = build_body(plain_geometry, 80.0, sex)
    for node, row in ROWS.items():
        share = DE_LEVA[sex][row].mass / total_mass(sex)
        assert np.isclose(body.masses[NODE_INDEX[node]], 80.0 * share, rtol=1e-12)
    foot = DE_LEVA[sex]["foot"].mass / total_mass(sex) * 80.0
    assert np.isclose(body.masses[FOOT] + body.masses[TOES], foot, rtol=1e-12)
    assert np.isclose(body.masses[FOOT] / foot, REARFOOT_MASS_FRACTION)


@pytest.mark.parametrize("mass", [0.0, -70.0, float("nan"), float("inf")])
def test_a_mass_that_is_none_is_refused(plain_geometry, mass):
    with pytest.raises(MotionStyleError, match=r"body mass is .* must be a positive number"):
        build_body(plain_geometry, mass)


@pytest.mark.parametrize("value", [0.0, float("nan")])
def test_a_segment_without_length_is_refused_by_name(plain_geometry, value):
    offsets = plain_geometry.joint_offsets.copy()
    offsets[SHANK] = value
    with pytest.raises(MotionStyleError, match="segment thigh_r has no length"):
        build_body(replace(plain_geometry, joint_offsets=offsets), 70.0)


@pytest.mark.parametrize("sex", ["male", "female"])
def test_centre_of_mass_of_a_standing_person(plain_geometry, standing, sex):
    body = build_body(plain_geometry, 73.0, sex)
    com = centre_of_mass(body, forward_kinematics(body, standing))[0]
    assert 0.54 < com[1] / 1.74 < 0.58
    assert abs(com[2]) < 1e-12
    assert abs(com[0]) < 0.02


def test_segment_centres_lie_at_the_table_s_fractions(plain_geometry, plain_body):
    long = lengths(plain_geometry, "male")
    table = DE_LEVA["male"]
    thigh = [0, -table["thigh"].com * long["thigh_r"], 0]
    assert np.allclose(plain_body.coms[THIGH], thigh, atol=1e-12)
    forearm = [0, -table["forearm"].com * long["forearm_l"], 0]
    assert np.allclose(plain_body.coms[NODE_INDEX["forearm_l"]], forearm, atol=1e-12)
    # trunk and head are measured from their upper ends
    for node in ("pelvis", "abdomen", "thorax", "head"):
        height = (1 - table[ROWS[node]].com) * long[node]
        assert np.allclose(plain_body.coms[NODE_INDEX[node]], [0, height, 0], atol=1e-12)


def test_rear_foot_and_toes_together_balance_like_the_whole_foot(plain_geometry, plain_body):
    heel, toe = plain_geometry.contact_points[0], plain_geometry.contact_points[3]
    ball = plain_geometry.joint_offsets[TOES]
    parts = np.array([plain_body.coms[FOOT], ball + plain_body.coms[TOES]])
    weights = plain_body.masses[[FOOT, TOES]]
    whole = heel + DE_LEVA["male"]["foot"].com * (ball + toe - heel)
    assert np.allclose((weights @ parts / weights.sum())[[0, 2]], whole[[0, 2]], atol=1e-12)
    assert heel[1] < parts[0, 1] < 0
    assert heel[0] < parts[0, 0] < ball[0] < parts[1, 0] < (ball + toe)[0]


@pytest.mark.parametrize("sex", ["male", "female"])
def test_table_inertias_are_m_r_l_squared(plain_geometry, sex):
    body = build_body(plain_geometry, 68.0, sex)
    long = lengths(plain_geometry, sex)
    for node, name in ROWS.items():
        i, row = NODE_INDEX[node], DE_LEVA[sex][name]
        radii = np.array([row.sagittal, row.longitudinal, row.transverse])
        expected = np.diag(body.masses[i] * (radii * long[node]) ** 2)
        assert np.allclose(body.inertias[i], expected, rtol=1e-12, atol=0), node


def test_the_foot_s_long_axis_is_horizontal_and_its_parts_share_its_cross_section(
    plain_geometry, plain_body
):
    row = DE_LEVA["male"]["foot"]
    heel, toe = plain_geometry.contact_points[0], plain_geometry.contact_points[3]
    length = np.linalg.norm(plain_geometry.joint_offsets[TOES] + toe - heel)
    whole = (np.array([row.longitudinal, row.transverse, row.sagittal]) * length) ** 2
    whole_spread = whole.sum() / 2 - whole  # ∫x²dm / m and so on
    for node, share in ((FOOT, BALL_FRACTION), (TOES, 1 - BALL_FRACTION)):
        moments = np.diag(plain_body.inertias[node]) / plain_body.masses[node]
        spread = moments.sum() / 2 - moments
        assert np.allclose(spread, whole_spread * [share**2, 1, 1], rtol=1e-9), NODES[node]


@pytest.mark.parametrize("sex", ["male", "female"])
@pytest.mark.parametrize("inertia", ["table", "ellipsoid"])
def test_inertias_are_those_of_solid_bodies(plain_geometry, sex, inertia):
    body = build_body(plain_geometry, 73.0, sex, inertia=inertia)
    for node, matrix in zip(NODES, body.inertias, strict=True):
        assert np.array_equal(matrix, matrix.T), node
        moments = np.linalg.eigvalsh(matrix)
        assert moments[0] > 0, node
        assert moments[0] + moments[1] > moments[2], node  # the triangle inequality


@pytest.mark.parametrize("sex", ["male", "female"])
@pytest.mark.parametrize("inertia", ["table", "ellipsoid"])
def test_semi_axes_are_of_ellipsoids_of_the_same_inertia(plain_geometry, sex, inertia):
    body = build_body(plain_geometry, 73.0, sex, inertia=inertia)
    squared = body.semi_axes**2
    moments = body.masses[:, None] / 5 * (squared.sum(axis=1, keepdims=True) - squared)
    found = np.array([np.diag(matrix) for matrix in body.inertias])
    assert np.allclose(moments, found, rtol=1e-9)


def test_ellipsoid_of_the_thigh_is_the_worked_example(plain_geometry):
    # biomechanics.md §2: 73 kg, ℓ = 0.422 m → b = 0.108 m, r_t = 25 %
    offsets = plain_geometry.joint_offsets.copy()
    offsets[SHANK] = [0, -0.422, 0]
    body = build_body(
        replace(plain_geometry, joint_offsets=offsets), 73.0, "male", inertia="ellipsoid"
    )
    mass, length = body.masses[THIGH], 0.422
    assert round(mass, 2) == 10.34
    minor = np.sqrt(3 * mass / (2 * np.pi * DENSITY * length))
    assert round(minor, 3) == 0.108
    assert np.allclose(body.semi_axes[THIGH], [minor, length / 2, minor], rtol=1e-9)
    across = mass / 5 * ((length / 2) ** 2 + minor**2)
    along = mass / 5 * 2 * minor**2
    assert np.allclose(body.inertias[THIGH], np.diag([across, along, across]), rtol=1e-12)
    assert round(100 * np.sqrt(across / mass) / length) == 25


def test_ellipsoids_have_the_density_of_water_and_the_segment_s_length(plain_geometry):
    body = build_body(plain_geometry, 73.0, "female", inertia="ellipsoid")
    volumes = 4 / 3 * np.pi * body.semi_axes.prod(axis=1)
    assert np.allclose(body.masses / volumes, DENSITY, rtol=1e-9)
    for node, length in lengths(plain_geometry, "female").items():
        assert np.isclose(body.semi_axes[NODE_INDEX[node], 1], length / 2, rtol=1e-9), node


def test_ellipsoids_and_table_share_masses_and_centres(plain_geometry, plain_body):
    other = build_body(plain_geometry, 73.0, "male", inertia="ellipsoid")
    assert np.array_equal(other.masses, plain_body.masses)
    assert np.array_equal(other.coms, plain_body.coms)
    assert other.inertias[THIGH, 0, 0] < 0.7 * plain_body.inertias[THIGH, 0, 0]


def test_left_and_right_of_a_symmetric_geometry_are_equal(plain_body):
    for name in NODES:
        if name.endswith("_r"):
            right, left = NODE_INDEX[name], NODE_INDEX[name[:-1] + "l"]
            assert plain_body.masses[right] == plain_body.masses[left]
            assert np.allclose(plain_body.inertias[right], plain_body.inertias[left], rtol=1e-12)
            assert np.allclose(plain_body.coms[right], plain_body.coms[left] * [1, 1, -1])


def test_leg_length_is_hip_to_ankle(plain_body):
    assert np.isclose(plain_body.leg_length, 1.74 / 1.7837 * (0.4222 + 0.4403), rtol=1e-9)
    assert plain_body.mass_source == "given"


def test_the_trunk_weighs_the_same_wherever_a_skeleton_has_its_spine_joints(plain_geometry):
    offsets = np.array(plain_geometry.joint_offsets)
    rise = np.array([0.0, 0.06, 0.0])
    offsets[NODE_INDEX["abdomen"]] += rise
    offsets[NODE_INDEX["thorax"]] -= rise
    one = build_body(plain_geometry, 70.0)
    other = build_body(replace(plain_geometry, joint_offsets=offsets), 70.0)
    np.testing.assert_allclose(other.inertias, one.inertias, rtol=1e-12)
    still = np.zeros((1, 35))
    np.testing.assert_allclose(
        centre_of_mass(other, forward_kinematics(other, still)),
        centre_of_mass(one, forward_kinematics(one, still)),
        atol=1e-12,
    )
