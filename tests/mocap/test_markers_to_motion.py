"""Fits of markers: limbs that came out impossible start again from their neighbours."""

import numpy as np

from motionstyle.body.layout import COORDINATE_INDEX, COORDINATES
from motionstyle.mocap.markers.fit import BENT_ELBOW, reseeded

SEEN = np.ones(len(COORDINATES), dtype=bool)


def bent(frames=12):
    """Elbows bent and feet flat."""
    q = np.zeros((frames, len(COORDINATES)))
    for side in "rl":
        q[:, COORDINATE_INDEX[f"elbow_flexion_{side}"]] = np.linspace(0.5, 0.7, frames)
        q[:, COORDINATE_INDEX[f"ankle_dorsiflexion_{side}"]] = np.linspace(-0.1, 0.1, frames)
    return q


def test_possible_frames_stay_as_they_are():
    np.testing.assert_array_equal(reseeded(bent(), SEEN), bent())


def test_a_foot_that_turned_over_follows_its_neighbour():
    """Few markers on a foot let it turn by whole turns about its length."""
    q = bent()
    inversion, ankle = (
        COORDINATE_INDEX[f"{n}_r"] for n in ("foot_inversion", "ankle_dorsiflexion")
    )
    q[5:8, inversion] = 2 * np.pi
    q[5:8, ankle] = 2.0
    found = reseeded(q, SEEN)
    assert (found[:, inversion] == 0).all()
    np.testing.assert_array_equal(found[5:7, ankle], bent()[[4, 4], ankle])
    assert found[7, ankle] == bent()[8, ankle]
    others = np.ones(len(COORDINATES), dtype=bool)
    others[[inversion, ankle]] = False
    np.testing.assert_array_equal(found[:, others], q[:, others])


def test_an_arm_that_bends_the_wrong_way_follows_its_neighbour_and_a_whole_one_starts_bent():
    q = bent()
    elbow = COORDINATE_INDEX["elbow_flexion_l"]
    q[3, elbow] = -1.0
    assert reseeded(q, SEEN)[3, elbow] == q[2, elbow]
    q[:, elbow] = -1.0
    assert (reseeded(q, SEEN)[:, elbow] == BENT_ELBOW).all()


def test_what_markers_do_not_show_is_left_alone():
    q = bent()
    inversion = COORDINATE_INDEX["foot_inversion_r"]
    q[5, inversion] = 2 * np.pi
    unseen = SEEN.copy()
    unseen[inversion] = False
    np.testing.assert_array_equal(reseeded(q, unseen), q)
