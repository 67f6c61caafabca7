"""Figures are written without a display, the same bytes each time, and show what they claim."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.image import imread

from motionstyle.body.layout import CONTACT_POINTS, COORDINATES, NODES
from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.normative import read_normative
from motionstyle.figures.bodies import body_figure, marker_figure, marker_fit_figure
from motionstyle.figures.force_strips import METRES_PER_WEIGHT, force_strip_figure
from motionstyle.figures.gait import gait_figure
from motionstyle.figures.moments import joint_moment_figure, plate_moment_figure
from motionstyle.figures.residuals import residual_figure
from motionstyle.figures.skeleton import BONES, named_points, project
from motionstyle.figures.strips import LONGEST_M, stick_strip, strip_figure
from motionstyle.figures.style import SIDE_COLOURS, SIDE_LINES, motion_title, new_figure, save

ROOT = Path(__file__).parents[2]
NORMATIVE = read_normative(ROOT / "config" / "normative_gait.yaml")
POOLED = {"virtual": {"foot, centre": [0.2, 0.4]}, "measured": {"asis": [1.0], "heel": [2.0, 3.0]}}
RESIDUALS = [
    {
        "id": f"clip{k}",
        "status": status,
        "force_before_pctbw": "20",
        "force_after_pctbw": "0.1",
        "moment_before_nm": "30",
        "moment_after_nm": "0.2",
    }
    for k, status in enumerate(("converged", "not converged"))
]
MARKERS = {"a": {"pelvis centre": 0.2, "toes_r x": 2.5}, "b": {"pelvis centre": 0.4}}


def cycles():
    """Moments of a walk whose right leg was on a plate, and of a run."""
    leg = {"r": list(np.sin(np.linspace(0, 6, 101)))}
    walk = {"estimated": dict.fromkeys(("hip", "knee", "ankle"), leg)}
    walk["measured"] = walk["estimated"]
    none = {joint: {} for joint in ("hip", "knee", "ankle")}
    run = {**walk, "measured": none, "level_walk": False, "action": "run"}
    return {"walk": {**walk, "level_walk": True, "action": "walk"}, "run": run}


def stances():
    """Moments of the right leg, of which the plate saw the second half."""
    times = list(np.linspace(0, 1, 10))
    seen = [None] * 5 + [0.5] * 5
    return [{"foot": "r", "times": times, "estimated": [times] * 3, "measured": [seen] * 3}]


def makers(motion):
    return {
        "strips": lambda: strip_figure([motion, motion], ["one", "two"]),
        "body": lambda: body_figure(motion.body),
        "gait": lambda: gait_figure([motion], NORMATIVE),
        "markers": lambda: marker_figure(MARKERS),
        "marker_fit": lambda: marker_fit_figure(POOLED),
        "force_strips": lambda: force_strip_figure([motion], ["clip"]),
        "root_residual": lambda: residual_figure(RESIDUALS),
        "joint_moments": lambda: joint_moment_figure(cycles(), NORMATIVE),
        "plate_moments": lambda: plate_moment_figure({"clip": stances()}),
    }


def all_text(figure) -> list[str]:
    return [t.get_text() for t in figure.findobj(matplotlib.text.Text) if t.get_text()]


@pytest.mark.parametrize(
    "name",
    [
        *("strips", "body", "gait", "markers", "marker_fit", "force_strips", "root_residual"),
        *("joint_moments", "plate_moments"),
    ],
)
def test_files_are_written_and_have_the_same_bytes_each_time(plain_motion, tmp_path, name):
    make = makers(plain_motion)[name]
    first = save(make(), tmp_path / "1" / name)
    with matplotlib.rc_context({"font.size": 20, "svg.hashsalt": "other", "lines.linewidth": 9}):
        again = save(make(), tmp_path / "2" / name)
    assert [p.name for p in first] == [f"{name}.svg", f"{name}.png"]
    for a, b in zip(first, again, strict=True):
        assert a.stat().st_size > 5000
        assert a.read_bytes() == b.read_bytes()
    assert b"<dc:date>" not in first[0].read_bytes()
    assert len(list((tmp_path / "1").iterdir())) == 2  # no temporary file is left


def test_a_dot_in_the_name_is_not_an_ending(plain_motion, tmp_path):
    svg, png = save(marker_figure(MARKERS), tmp_path / "markers.v2")
    assert (svg.name, png.name) == ("markers.v2.svg", "markers.v2.png")


@pytest.mark.parametrize(
    "name",
    [
        *("strips", "body", "gait", "markers", "marker_fit", "force_strips", "root_residual"),
        *("joint_moments", "plate_moments"),
    ],
)
def test_nothing_is_cut_off_and_text_is_readable(plain_motion, tmp_path, name):
    figure = makers(plain_motion)[name]()
    sizes = {t.get_fontsize() for t in figure.findobj(matplotlib.text.Text) if t.get_text()}
    assert min(sizes) >= 7
    assert figure.get_size_inches()[0] == pytest.approx(7.0)
    _svg, png = save(figure, tmp_path / name)
    pixels = imread(png)[..., :3]
    edges = np.concatenate([pixels[0], pixels[-1], pixels[:, 0], pixels[:, -1]])
    assert edges.min() == 1.0  # white: nothing runs off the paper
    assert pixels.min() < 0.2


def test_no_display_is_needed_and_the_backend_is_agg():
    environment = {k: v for k, v in os.environ.items() if k not in {"DISPLAY", "WAYLAND_DISPLAY"}}
    environment |= {"MPLBACKEND": "", "PYTHONPATH": str(ROOT / "src")}
    program = (
        "import motionstyle.figures.style as s, sys; import matplotlib.pyplot as p;"
        "s.new_figure(1.0); print(p.get_backend(), len(p.get_fignums()))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.lower().split() == ["agg", "0"]


def test_the_asked_number_of_figures_is_drawn(plain_motion):
    axes = new_figure(2.0).subplots()
    strip = stick_strip(axes, plain_motion, 5)
    bones = [c for c in axes.collections if isinstance(c, LineCollection)]
    assert len(bones) == len(BONES) + 1  # and the heads
    assert {len(c.get_segments()) for c in bones} == {5}
    assert strip.frames[0] == 0
    assert strip.frames[-1] == plain_motion.frames - 1
    times = [t.get_text() for t in axes.texts]
    assert times == [f"{f / plain_motion.rate_hz:.2f}" for f in strip.frames]


def test_contacts_are_dots_at_the_bearing_points_of_the_drawn_frames(plain_motion):
    axes = new_figure(2.0).subplots()
    strip = stick_strip(axes, plain_motion, 4)
    dots = {}
    for line in axes.lines:
        if line.get_marker() == "o":
            dots[line.get_color()] = dots.get(line.get_color(), 0) + len(line.get_xdata())
    bearing = plain_motion.contacts[list(strip.frames)]
    for side in "rl":
        own = [k for k, name in enumerate(CONTACT_POINTS) if name.endswith(side)]
        assert dots[SIDE_COLOURS[side]] == bearing[:, own].sum() > 0


def test_forces_are_arrows_from_the_foot_of_half_a_metre_a_body_weight(plain_motion):
    axes = new_figure(2.0).subplots()
    strip = stick_strip(axes, plain_motion, 3, forces=True)
    arrows = [t for t in axes.texts if t.get_text() == ""]
    feet = [slice(0, 4), slice(4, 8)]
    down = sum(plain_motion.contacts[f, foot].any() for f in strip.frames for foot in feet)
    assert len(arrows) == down
    rises = sum(arrow.xy[1] - arrow.xyann[1] for arrow in arrows)
    vertical = plain_motion.contact_forces[list(strip.frames), :, 1].sum()
    assert rises == pytest.approx(0.5 * vertical / (plain_motion.body.mass * 9.81))
    without = new_figure(2.0).subplots()
    stick_strip(without, replace(plain_motion, contact_forces=None), 3, forces=True)
    assert all(t.get_text() for t in without.texts)


def test_sides_differ_in_colour_and_in_line_style():
    assert SIDE_COLOURS["r"] != SIDE_COLOURS["l"]
    assert SIDE_LINES["r"] != SIDE_LINES["l"]


def test_figures_stand_where_the_motion_was_unless_it_hardly_travels(plain_motion):
    axes = new_figure(2.0).subplots()
    strip = stick_strip(axes, plain_motion)
    assert not strip.offset_in_time
    assert not strip.shift.any()
    q = plain_motion.coordinates.copy()
    q[:, 0] *= 0.1
    axes = new_figure(2.0).subplots()
    strip = stick_strip(axes, replace(plain_motion, coordinates=q))
    assert strip.offset_in_time
    apart = np.diff(strip.shift[list(strip.frames)])
    assert apart.min() > 0.4
    assert "moved right by" in axes.get_xlabel()


def test_a_long_way_is_cut_and_the_title_says_so(plain_motion):
    q = plain_motion.coordinates.copy()
    q[:, 0] *= 6
    axes = new_figure(2.0).subplots()
    strip = stick_strip(axes, replace(plain_motion, coordinates=q))
    assert strip.last_frame < plain_motion.frames - 1
    assert q[strip.last_frame, 0] <= LONGEST_M
    assert axes.get_title(loc="left").startswith("plain: first ")


def test_planted_motions_are_called_planted_whatever_their_title(plain_motion):
    planted = replace(plain_motion, kind="planted")
    flagged = replace(plain_motion, provenance={"planted": True})
    assert motion_title(planted) == "plain (planted)"
    assert motion_title(flagged, "longer steps") == "longer steps (planted)"
    assert motion_title(planted, "planted walk") == "planted walk"
    assert motion_title(plain_motion) == "plain"
    figure = strip_figure([plain_motion, planted], ["one", "two"])
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles == ["one", "two (planted)"]
    assert any("(planted)" in t for t in all_text(gait_figure([planted], NORMATIVE)))


@pytest.mark.parametrize("make", [strip_figure, lambda m, t: gait_figure(m, NORMATIVE, t)])
def test_titles_and_motions_must_match(plain_motion, make):
    with pytest.raises(MotionStyleError, match="1 motions got 2 titles"):
        make([plain_motion], ["one", "two"])
    with pytest.raises(MotionStyleError, match="0 motions"):
        make([], [])


def test_views_turn_the_way_to_the_right(plain_motion):
    turn = replace(plain_motion, coordinates=plain_motion.coordinates.copy())
    turn.coordinates[:, 2] = -turn.coordinates[:, 0]  # 45° to the left
    turn.coordinates[:, 0] = -plain_motion.coordinates[:, 2]
    points = named_points(turn.body, turn.coordinates)
    for view in ("side", "travel"):
        flat = project(turn, points, view)
        assert np.ptp(flat["pelvis"][:, 0]) == pytest.approx(2.6, rel=0.01), view
        assert flat["pelvis"][-1, 0] > flat["pelvis"][0, 0]
        np.testing.assert_allclose(flat["head"][:, 1], points["head"][:, 1])
    oblique = project(turn, points, "oblique")
    assert np.ptp(oblique["pelvis"][:, 0]) == pytest.approx(2.6 * np.cos(np.radians(30)), rel=0.02)


def test_the_body_figure_names_every_node_and_its_mass_sums_to_100(plain_body):
    words = all_text(body_figure(plain_body))
    for node in NODES:
        assert node in words
    assert words[words.index("sum") : words.index("sum") + 4] == [
        "sum",
        str(len(COORDINATES)),
        "73.00",
        "100.00",
    ]


def test_the_gait_figure_draws_the_published_bars_and_names_the_cycles(plain_motion):
    still = replace(plain_motion, id="still", contacts=np.zeros_like(plain_motion.contacts))
    figure = gait_figure([plain_motion, still], NORMATIVE)
    assert len(figure.axes) == 3
    bars = sorted((b.get_y(), b.get_y() + b.get_height()) for b in figure.axes[1].patches)
    assert bars == [(-3, 14), (-1, 17), (1, 21), (55, 72)]
    labels = [t.get_text() for t in figure.legends[0].get_texts()]
    assert labels[1].startswith("plain: ")
    assert labels[1].endswith(("cycle", "cycles"))
    assert labels[2] == "still: no complete cycle"


def test_marker_bars_are_the_means_of_the_clips_that_have_the_marker():
    axes = marker_figure(MARKERS).axes[0]
    assert [b.get_width() for b in axes.patches] == pytest.approx([0.3, 2.5])
    assert [t.get_text() for t in axes.get_yticklabels()] == ["pelvis centre", "toes_r x"]
    with pytest.raises(MotionStyleError, match="no clip"):
        marker_figure({})


def test_force_arrows_are_as_long_as_the_force_and_start_under_the_foot(plain_motion):
    """In the made-up motion the bearing points share the weight, pushed a little forward."""
    figure = force_strip_figure([plain_motion])
    arrows = [t for t in figure.axes[0].texts if getattr(t, "arrow_patch", None) is not None]
    assert len(arrows) >= 9
    feet = np.array([a.xyann for a in arrows])
    lengths = np.array([np.subtract(a.xy, a.xyann) for a in arrows])
    np.testing.assert_allclose(feet[:, 1], 0, atol=0.25)
    assert (lengths[:, 1] > 0).all()
    np.testing.assert_allclose(lengths[:, 0] / lengths[:, 1], 0.1, atol=1e-3)
    assert lengths[:, 1].max() == pytest.approx(METRES_PER_WEIGHT, rel=1e-6)


def test_motions_without_forces_have_no_arrows_to_draw(plain_motion):
    with pytest.raises(MotionStyleError, match="no contact forces"):
        force_strip_figure([replace(plain_motion, contact_forces=None)])


def test_fits_that_did_not_converge_are_told_apart():
    text = all_text(residual_figure(RESIDUALS))
    assert "after, fit not converged" in text
    assert {"clip0", "clip1"} <= set(text)


def test_published_bands_are_drawn_over_the_walks_alone():
    figure = joint_moment_figure(cycles(), NORMATIVE)
    bars = [len(axes.patches) for axes in figure.axes]
    assert bars == [6, 6, 4, 0, 0, 0]  # filled and outlined: three, three and two instants
    assert "(legs: 1, on plates: 1)" in figure.axes[0].get_ylabel()
