"""Figures of style machines from made-up tables: what they show, and what without data."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from motionstyle.evaluation.style_machines.checks import prior_ellipses
from motionstyle.figures import style_machine_models as models
from motionstyle.figures import style_machines as figures
from motionstyle.figures.style import save

EMPTY = pd.DataFrame(columns=["set", "prior", "dof", "cumulative_share", "status"])


def texts(figure):
    """Return all text of a figure."""
    found = [t.get_text() for t in figure.texts]
    for axes in figure.axes:
        found += [axes.get_title(loc="left"), axes.get_xlabel(), axes.get_ylabel()]
        found += [t.get_text() for t in axes.texts]
    return " | ".join(found)


@pytest.mark.parametrize(
    "make",
    [
        lambda: models.models_figure({}, EMPTY),
        lambda: figures.dof_figure(EMPTY),
        lambda: models.dance_figure({}, "", None),
        lambda: models.annealing_figure({}),
        lambda: figures.axes_figure(EMPTY, {}),
        lambda: figures.analogies_figure(EMPTY),
        lambda: figures.held_out_figure(EMPTY),
        lambda: figures.driving_figure(EMPTY, {}),
        lambda: figures.phases_figure({}, EMPTY),
        lambda: figures.novice_figure(EMPTY),
    ],
)
def test_without_motions_a_figure_says_so(make):
    assert models.NO_DATA in texts(make())


def test_explained_variance_shows_the_paper_and_the_median_draw(tmp_path):
    rows = [
        {"set": "headline", "prior": prior, "dof": d, "cumulative_share": 1 - 0.5**d}
        for prior in ("cross_entropy", "none")
        for d in range(1, 9)
    ]
    rows += [
        {"set": "draw", "prior": "cross_entropy", "dof": 3, "cumulative_share": 0.7 + 0.01 * k}
        for k in range(5)
    ]
    figure = figures.dof_figure(pd.DataFrame(rows))
    assert "paper: 93 % with 3" in texts(figure)
    assert "5 random draws of ten, median 72 %" in texts(figure)
    svg, png = save(figure, tmp_path / "dof")
    assert svg.stat().st_size > 1000
    assert png.stat().st_size > 1000


def test_analogies_show_the_median_over_pairs():
    rows = [
        {"status": "ok", "set": "s", "take": "1", "pair": f"p{k}", "method": method,
         "pose_distance_deg": size + k}
        for method, size in (("style_machine", 10.0), ("linear_mixing", 12.0))
        for k in range(3)
    ]  # fmt: skip
    words = texts(figures.analogies_figure(pd.DataFrame(rows)))
    assert "s: 3 pairs, 1 take(s)" in words
    assert "11.0" in words
    assert "13.0" in words


def test_dances_show_the_four_numbers_of_the_paper():
    arrays = {
        "m_transitions": np.array([[0.9, 0.1], [0.2, 0.8]]),
        "m_means": np.array([[0.0, 0.0], [1.0, 0.5]]),
        "m_names": np.array(["a", "b"]),
        "m_occupancy_0": np.eye(2)[[0, 0, 1]],
        "m_occupancy_1": np.eye(2)[[1, 1, 0]],
    }
    row = {"states_start": 3, "states_end": 2, "parameters": 40, "frames": 6, "rate_hz": 60.0}
    words = texts(models.dance_figure(arrays, "m", row))
    assert "3 to 2 states, 40 parameters, 6 frames" in words
    assert "occupancy of b" in words


def test_priors_and_graphs_need_no_motion(tmp_path):
    arrays = {f"priors_{k}": v for k, v in prior_ellipses().items()}
    assert "Z (entropy: shrinks)" in texts(models.priors_figure(arrays))
    assert "stylistic model" in texts(models.graphs_figure())


def test_known_models_are_shown_by_noise():
    rows = [
        {"noise": noise, "states_found": 8, "states_true": 8, "subspace_angle_deg": 1.0,
         "v_correlation": 0.99}
        for noise in ("low", "high")
    ]  # fmt: skip
    assert "states found" in texts(figures.twin_figure(pd.DataFrame(rows)))
