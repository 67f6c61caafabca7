"""The row of a physical motion says whether its fit succeeded."""

from motionstyle.evaluation.physical import PHYSICAL_COLUMNS, physical_row


def test_a_fit_that_converged_succeeded_and_others_did_not():
    one = physical_row({"id": "a", "status": "converged", "marker_rms_cm": 0.7}, "full")
    assert tuple(one) == PHYSICAL_COLUMNS
    assert (one["succeeded"], one["config"], one["marker_rms_cm"]) == (True, "full", 0.7)
    for status in ("not converged", "failed"):
        other = physical_row({"id": "b", "status": status, "reason": "too short"}, "full")
        assert other["succeeded"] is False
