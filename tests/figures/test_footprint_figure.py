"""The preview of footprints shows every print and period, true to scale."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.image import imread
from matplotlib.patches import Polygon, Rectangle

from motionstyle.figures.footprints import footprint_figure
from motionstyle.figures.style import SIDE_COLOURS, save
from motionstyle.spacetime.captured_footprints import footprints_of
from motionstyle.spacetime.footprint_constraints import print_poses
from motionstyle.spacetime.relay import Ramp, arc, relay, straight
from synthetic_walk import RATE, make_walk

WALK = make_walk(300)
ROWS = footprints_of(WALK)


def figure_of(rows, title="plan"):
    return footprint_figure(rows, WALK.body, WALK.frames, RATE, title=title)


def test_level_prints_are_seen_from_above_and_in_time():
    figure = figure_of(ROWS)
    above, timing = figure.axes
    poses = print_poses(ROWS, WALK.body, RATE)
    filled = [p for p in above.patches if isinstance(p, Polygon) and p.get_fill()]
    assert len(filled) == len(poses)
    assert [t.get_text() for t in above.texts] == [str(k + 1) for k in range(len(poses))]
    heels = [p.get_xy()[0] for p in filled]
    expected = [[pose.heel[0], -pose.heel[2]] for pose in poses]  # left is up on paper
    assert np.array(heels) == pytest.approx(np.array(expected), abs=1e-6)
    bars = [p for p in timing.patches if isinstance(p, Rectangle)]
    assert len(bars) == len(ROWS)
    assert sum(bar.get_width() for bar in bars) == pytest.approx(
        sum(r.t_off - r.t_on for r in ROWS)
    )
    assert {bar.get_facecolor()[:3] for bar in bars} == {
        tuple(int(SIDE_COLOURS[s][k : k + 2], 16) / 255 for k in (1, 3, 5)) for s in "rl"
    }


def test_prints_that_climb_are_seen_from_the_side_too():
    rows = relay(ROWS, WALK.body, RATE, straight(), surface=Ramp(8))
    assert len(figure_of(rows).axes) == 3
    assert len(figure_of(relay(ROWS, WALK.body, RATE, arc(2, "left"))).axes) == 2


def test_files_have_the_same_bytes_each_time(tmp_path):
    files = [save(figure_of(ROWS), tmp_path / name) for name in ("a", "b")]
    for first, second in zip(*files, strict=True):
        assert first.read_bytes() == second.read_bytes()
    assert imread(files[0][1]).shape[1] == 1400
