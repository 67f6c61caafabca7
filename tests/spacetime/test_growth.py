"""The benchmark's rows, on tiny problems."""

import pytest

from motionstyle.spacetime.growth import COLUMNS, growth_exponent, growth_row
from spacetime_problems import bent, plain_style, standing_problem


def test_a_row_has_all_columns_and_a_warm_re_solve_is_short(all_functions, plain_body, standing):
    q = bent(standing, 9)
    problem = standing_problem(
        all_functions, plain_body, q, plain_style(60, 5, rest=q[0, 6:] + 0.02)
    )
    told = []
    row = growth_row(problem, problem.basis().fit(q), log=told.append)
    assert tuple(row) == COLUMNS
    assert (row["status"], row["warm_status"]) == ("converged", "converged")
    assert row["warm_iterations"] <= 10
    assert 0 < row["peak_memory_mb"] < 100
    assert len(told) == 1


def test_growth_is_the_slope_in_logarithms():
    rows = [{"frames": f, "ms_per_iteration": 0.3 * f**1.1} for f in (30, 62, 150, 300)]
    assert growth_exponent(rows) == pytest.approx(1.1)
