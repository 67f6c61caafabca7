"""The checked wrapper: what it records, what it names, and what it does not let pass."""

import numpy as np
import pytest

from motionstyle.errors import MotionStyleError
from motionstyle.spacetime.diagnosis import Constraint, Outcome, checked_solve


def silent(_text):
    pass


def outcome(converged=True, violation=0.0, **kwargs):
    values = np.zeros((5, 12))
    values[3, 7] = violation
    slip = Constraint("slip", "m", 0.01, [f"point {k}" for k in range(12)], values)
    found = {"terms": {"markers": 2.0}, "at_bounds": {"knee": 3, "hip": 0, "ankle": 9}, **kwargs}
    return Outcome("answer", converged, "8 rounds done", 40, 1e-4, (slip,), **found)


def test_a_solve_that_converges_is_recorded():
    value, record, diagnosis = checked_solve(outcome, silent)
    assert value == "answer"
    assert (record.status, record.reason, record.iterations) == ("converged", "", 40)
    assert record.seconds >= 0
    assert record.violations == {"slip": 0.0}
    assert diagnosis["worst"] == []


def test_a_failure_names_constraint_place_and_frame():
    lines = []
    value, record, diagnosis = checked_solve(lambda: outcome(False, 0.25), lines.append)
    assert value == "answer"
    assert record.status == "not converged"
    assert "8 rounds done; slip 0.25 m" in record.reason
    worst = diagnosis["worst"][0]
    assert (worst["constraint"], worst["where"], worst["frame"]) == ("slip", "point 7", 3)
    assert worst["violation"] == 0.25
    assert list(diagnosis["at_bounds"]) == ["ankle", "knee"]
    assert diagnosis["terms"] == {"markers": 2.0}
    assert "not converged" in lines[-1]


def test_the_ten_worst_come_first_against_their_limits():
    rng = np.random.default_rng(0)
    wide = Constraint("force", "N", 10.0, [f"f{k}" for k in range(20)], rng.random((30, 20)))
    tight = Constraint("range", "rad", 0.01, [f"r{k}" for k in range(20)], rng.random((30, 20)))
    result = Outcome(None, False, "", 1, 0.0, (wide, tight))
    _, _, diagnosis = checked_solve(lambda: result, silent)
    assert len(diagnosis["worst"]) == 10
    assert {one["constraint"] for one in diagnosis["worst"]} == {"range"}
    ratios = [one["violation"] / one["limit"] for one in diagnosis["worst"]]
    assert ratios == sorted(ratios, reverse=True)
    assert ratios[0] == pytest.approx(tight.violation.max() / 0.01)


@pytest.mark.parametrize("spoil", [{"violation": np.nan}, {"terms": {"markers": np.inf}}])
def test_numbers_that_are_not_finite_never_converge(spoil):
    _, record, _ = checked_solve(lambda: outcome(True, **spoil), silent)
    assert record.status == "not converged"
    assert "not finite" in record.reason


def test_a_breakdown_is_a_status_and_bad_input_an_error():
    def singular():
        np.linalg.solve(np.zeros((2, 2)), np.ones(2))

    value, record, diagnosis = checked_solve(singular, silent)
    assert value is None
    assert record.status == "failed"
    assert "LinAlgError" in record.reason
    assert diagnosis["status"] == "failed"

    def refused():
        raise MotionStyleError("6 frames are too few")

    with pytest.raises(MotionStyleError, match="too few"):
        checked_solve(refused, silent)
