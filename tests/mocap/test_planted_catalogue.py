"""The catalogue of planted motions: what is shipped, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from motionstyle.errors import MotionStyleError
from motionstyle.mocap.planted.variants import read_planted

CATALOGUE = Path(__file__).parents[2] / "config" / "planted.yaml"


def test_the_shipped_catalogue():
    recipes = read_planted(CATALOGUE)
    assert 40 <= len(recipes) <= 60
    assert len({r.id for r in recipes}) == len({r.seed for r in recipes}) == len(recipes)
    assert all(r.style.startswith("planted") and r.id.startswith("planted") for r in recipes)
    styled = [r for r in recipes if r.series == "styles"]
    assert len(styled) == 20
    vectors = {
        base: {r.style: r.style_coordinates for r in styled if r.base == base}
        for base in ("walk", "run")
    }
    assert vectors["walk"] == vectors["run"]
    assert np.linalg.matrix_rank(np.array(list(vectors["walk"].values()))) == 3
    changes = {r.style: (r.posture_offset_deg, r.swing_gain, r.stride, r.cadence) for r in styled}
    for r in styled:
        assert changes[r.style] == (r.posture_offset_deg, r.swing_gain, r.stride, r.cadence)
    windows = {(r.take, r.source_window) for r in recipes}
    assert windows == {(1, "even"), (2, "odd")}
    doses = {s: {r.dose for r in recipes if r.series == s} for s in {r.series for r in recipes}}
    assert len(doses) == 7
    assert all(
        len(doses[s]) == 4 and 0 not in doses[s] for s in doses if s not in ("styles", "dose0")
    )


def changed(tmp_path, *changes):
    text = CATALOGUE.read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "planted.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_every_problem_of_a_catalogue_at_once(tmp_path):
    path = changed(
        tmp_path,
        ("style_axes:", "style_axs:"),
        ("source_window: even", "source_windw: even"),
        ("phase_noise: 0.008", "phase_noise: much"),
        ("parameter: arms", "parameter: arm"),
        ("base: jump", "base: jmp"),
    )
    with pytest.raises(MotionStyleError) as caught:
        read_planted(path)
    text = str(caught.value)
    for said in (
        "unknown key 'style_axs' (did you mean style_axes",
        "'style_axes' is missing",
        "unknown key 'source_windw' (did you mean source_window?)",
        "phase_noise is 'much', expected a number",
        "'arm' is unknown (did you mean arms?)",
        "'jmp' is unknown (did you mean jump?)",
    ):
        assert said in text


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("planted-eager: [1, 1, 1]", "planted-eager: [1, 1]", "expected 3 numbers"),
        ("planted-eager: [1, 1, 1]", "eager: [1, 1, 1]", "begins with 'planted'"),
        ("abdomen_flexion: 10", "abdomen_flexon: 10", "did you mean abdomen_flexion"),
        ("source_window: odd", "source_window: od", "did you mean odd"),
        ("values: [5, 10, 15, 20]", "values: [5, 5, 15, 20]", "asked for twice"),
        ("bases: [walk, run]", "bases: [walk, rum]", "did you mean run"),
        ("takes: [2]", "takes: [3]", "'3' is unknown"),
        ("undosed:", "undosed: 3 #", "expected a group of keys"),
    ],
)
def test_a_wrong_catalogue_is_refused(tmp_path, old, new, said):
    with pytest.raises(MotionStyleError, match=said.replace("'", ".")):
        read_planted(changed(tmp_path, (old, new)))


@pytest.mark.parametrize("content", ["", "- 1\n", "a: [", b"\xff\xfe\x00"])
def test_no_catalogue_at_all(tmp_path, content):
    path = tmp_path / "planted.yaml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(MotionStyleError, match=r"planted\.yaml"):
        read_planted(path)
    with pytest.raises(MotionStyleError, match="not a readable YAML"):
        read_planted(tmp_path / "absent.yaml")
