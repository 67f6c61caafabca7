"""The settings of style machines: the shipped files, and mistakes in the user's own."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.style_machines.runs import motion_ids
from motionstyle.evaluation.style_machines.settings import (
    available,
    load_settings,
    pattern_ids,
    planned,
)
from motionstyle.shmm.machine import MachineSettings

ROOT = Path(__file__).parents[2]
SCHEMA = ROOT / "workflow/schemas/style_machines.schema.json"


@pytest.mark.parametrize("name", ["style_machines.yaml", "style_machines.full.yaml"])
def test_the_shipped_settings_are_valid(name):
    settings = load_settings(ROOT / "config" / name, SCHEMA)
    assert MachineSettings.from_config(settings["dance"]).states == 75
    assert MachineSettings.from_config(settings["locomotion"]).schedule.start_temperature == 2.0
    assert settings["analogies"]["planted"]["takes"] == ["1", "2"]  # the base's stays


def test_the_headline_has_ten_clips():
    full = load_settings(ROOT / "config/style_machines.full.yaml", SCHEMA)
    assert len(full["explained_variance"]["headline"]["motions"]) == 10
    assert full["draws"]["count"] == 200


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"dance": {"states": 1}}, r"key 'dance.states': found 1, expected at least 2"),
        ({"dance": {"stats": 9}}, r"key 'dance.stats': unknown key \(did you mean states"),
        ({"dance": {"schedule": {"decay": 2}}}, r"dance.schedule.decay.*expected less than 1"),
        ({"seeds": []}, r"key 'seeds': found an empty list, expected 1 or more entries"),
        ({"held_out": {"x": {"styles": ["a"], "motion": "a", "learn": ["1"], "try": ["2"]}}},
         r"held_out.x.motion.*an id with \{style\} and \{take\}"),
    ],
)  # fmt: skip
def test_mistakes_are_told_in_one_line(tmp_path, change, message):
    raw = {"locomotion": {}, "dance": {}, **change}
    file = tmp_path / "mine.yaml"
    file.write_text(yaml.safe_dump(raw))
    with pytest.raises(MotionStyleError, match=rf"mine\.yaml, .*{message}"):
        load_settings(file, SCHEMA)


def test_a_file_that_is_no_group_or_no_yaml_is_refused(tmp_path):
    for text, message in (("- 1", "expected a group of keys"), ("a: [", "not a readable YAML")):
        file = tmp_path / "mine.yaml"
        file.write_text(text)
        with pytest.raises(MotionStyleError, match=message):
            load_settings(file, SCHEMA)


def test_an_experiment_is_whole_absent_or_an_error():
    assert available(["a", "b"], ["a", "b", "c"], "x")
    assert not available(["a", "b"], ["c"], "x")
    with pytest.raises(
        MotionStyleError, match=r"analogies\.mine: no motion walk_2 \(did you mean walk_1"
    ):
        available(["walk_1", "walk_2"], ["walk_1"], "analogies.mine")


def test_a_run_without_the_clips_plans_nothing():
    settings = load_settings(ROOT / "config/style_machines.yaml", SCHEMA)
    plan = planned(settings, ["something_else"])
    assert not plan["analogies"]
    assert "gaits" not in plan
    assert motion_ids(plan) == {"gaits": [], "dances": [], "driving": []}


def test_patterns_name_planted_and_captured_motions():
    assert pattern_ids("planted-walk-{style}-take{take}", ["planted-brisk"], ["2"]) == [
        "planted-walk-brisk-take2"
    ]
    assert pattern_ids("b_{style}_{take}", ["old", "sad"], ["1"]) == ["b_old_1", "b_sad_1"]
