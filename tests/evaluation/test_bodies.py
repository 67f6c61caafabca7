"""The table of a body: the counts of the paper's Fig. 1."""

import pytest

from motionstyle.evaluation.bodies import BODY_COLUMNS, body_table


def test_18_nodes_35_degrees_of_freedom_and_the_whole_mass(plain_motion):
    rows = body_table(plain_motion, "default")
    assert all(tuple(row) == BODY_COLUMNS for row in rows)
    assert len({row["node"] for row in rows}) == 18
    assert sum(row["dof"] for row in rows) == 35
    assert sum(row["mass_pctbw"] for row in rows) == pytest.approx(100, abs=1e-9)
    assert [row["node"] for row in rows if row["parent"] == "world"] == ["pelvis"]
