"""The configuration: defaults, and one line for everything wrong with it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml

from motionstyle.configuration import load_config
from motionstyle.errors import MotionStyleError

ROOT = Path(__file__).parents[1]
SCHEMA = ROOT / "workflow" / "schemas" / "config.schema.json"
NAMES = (
    *("motions.tsv", "datasets.tsv", "embedded.yaml", "claims.yaml"),
    *("planted.yaml", "normative_gait.yaml", "syntheses.tsv"),
    *("similarity.yaml", "adaptations.tsv", "style_machines.yaml", "hand_style.yaml"),
    *("nio.yaml", "styles.tsv"),
)


@pytest.fixture
def root(tmp_path):
    """A folder with every file a configuration names."""
    for folder in ("skeletons", "markersets"):
        (tmp_path / "config" / folder).mkdir(parents=True)
    for name in NAMES:
        (tmp_path / "config" / name).write_text("")
    return tmp_path


SHIPPED = yaml.safe_load((ROOT / "config" / "config.yaml").read_text(encoding="utf-8"))
RAW = {
    "name": "test",
    "results_root": "results",
    "motions": "config/motions.tsv",
    **{group: SHIPPED[group] for group in ("retarget", "contacts", "physical", "figures")},
}


def problems(raw: object, root: Path, schema: Path = SCHEMA) -> list[str]:
    with pytest.raises(MotionStyleError) as caught:
        load_config(raw, schema, root)
    return str(caught.value).splitlines()


def changed(root: Path, **keys: object) -> str:
    found = problems({**RAW, **keys}, root)
    assert len(found) == 1, found
    return found[0]


def test_defaults_are_filled_and_the_input_left_alone(root):
    raw = {**RAW, "body": {"default_sex": "female"}}
    config = load_config(raw, SCHEMA, root)
    assert config["body"] == {"default_sex": "female", "default_mass_kg": 70.0}
    assert config["datasets"] == "config/datasets.tsv"
    assert (config["mirrors"], config["allow_failed_clips"]) == ([], False)
    assert raw == {**RAW, "body": {"default_sex": "female"}}


def test_absent_group_has_its_defaults(root):
    config = load_config(RAW, SCHEMA, root)
    assert config["body"] == {"default_sex": "male", "default_mass_kg": 70.0}


def test_shipped_configurations_agree_with_the_schema(root):
    default = yaml.safe_load((ROOT / "config" / "config.yaml").read_text(encoding="utf-8"))
    full = yaml.safe_load((ROOT / "config" / "full.yaml").read_text(encoding="utf-8"))
    for raw in (default, {**default, **full}):
        for key in ("motions", "syntheses", "style_machines"):
            (root / raw[key]).write_text("")
            (ROOT / raw[key]).resolve(strict=True)
        (root / raw["nio"]["styles"]).write_text("")
        (ROOT / raw["nio"]["styles"]).resolve(strict=True)
        config = load_config(raw, SCHEMA, root)
        assert {key: config[key] for key in raw} == raw
        assert config["mirrors"] == ["../shared/mocap"]


def test_unknown_key_has_near_matches(root):
    found = changed(root, results_rot="x")
    assert found == "config key 'results_rot': unknown key (did you mean results_root?)"


def test_unknown_key_without_near_match_lists_the_known(root):
    found = changed(root, body={"xyz": 1})
    assert found == "config key 'body.xyz': unknown key; known are default_mass_kg, default_sex"


def test_missing_key(root):
    raw = {key: value for key, value in RAW.items() if key != "motions"}
    assert problems(raw, root) == [
        "config key 'motions': found nothing, expected text (a motion sheet (TSV))"
    ]


def test_wrong_type(root):
    assert changed(root, allow_failed_clips="yes") == (
        "config key 'allow_failed_clips': found 'yes', expected true or false"
    )


def test_truth_value_is_no_number(root):
    assert changed(root, body={"default_mass_kg": True}) == (
        "config key 'body.default_mass_kg': found true, expected a number (a mass in kg)"
    )


def test_out_of_range(root):
    assert changed(root, body={"default_mass_kg": -3}) == (
        "config key 'body.default_mass_kg': found -3, expected at least 10 (a mass in kg)"
    )
    assert changed(root, body={"default_mass_kg": 70000}) == (
        "config key 'body.default_mass_kg': found 70000, expected at most 300 (a mass in kg)"
    )


def test_not_a_number(root):
    assert changed(root, body={"default_mass_kg": float("nan")}) == (
        "config key 'body.default_mass_kg': found nan, expected a number (a mass in kg)"
    )


def test_wrong_choice(root):
    assert changed(root, body={"default_sex": "femal"}) == (
        "config key 'body.default_sex': found 'femal', expected one of male, female"
        " (did you mean female, male?)"
    )


def test_null_is_refused_and_told_once(root):
    assert changed(root, body=None) == (
        "config key 'body': found null (nothing after the colon), expected a group of keys"
        " (what to assume of subjects the sheet says nothing about); delete the line to have the"
        " default"
    )
    assert changed(root, name=None).startswith("config key 'name': found null (nothing after")
    assert changed(root, mirrors=["a", None]).startswith("config key 'mirrors[1]': found null (")


def test_null_in_a_group_of_free_keys_is_refused(root):
    gates = {**RAW["contacts"], "limp": {"gap_s": None}}
    assert changed(root, contacts=gates).startswith("config key 'contacts.limp.gap_s': found null")


def test_empty_list_where_an_entry_is_needed(root, tmp_path):
    schema = tmp_path / "schema.json"
    items = {"type": "array", "minItems": 1, "description": "kinds of file"}
    schema.write_text(json.dumps({"properties": {"formats": items}}))
    assert problems({"formats": []}, root, schema) == [
        "config key 'formats': found an empty list, expected 1 or more entries (kinds of file)"
    ]


def test_empty_text(root):
    assert changed(root, mirrors=[""]) == (
        "config key 'mirrors[0]': found '', expected text that is not empty (a folder)"
    )


@pytest.mark.parametrize("value", ["", "re{s}", "results/", "a*"])
def test_results_root_that_cannot_be_a_folder(root, value):
    assert changed(root, results_root=value) == (
        f"config key 'results_root': found {value!r}, expected a folder for everything the run"
        " writes, without braces, '*' or '?' and not ending in '/'"
    )


def test_missing_file_and_folder(root):
    assert problems({**RAW, "motions": "my sheet.tsv", "skeletons": "config/x"}, root) == [
        "config key 'motions': found 'my sheet.tsv', expected an existing file (a motion sheet"
        " (TSV))",
        "config key 'skeletons': found 'config/x', expected an existing folder (the folder of"
        " source skeletons)",
    ]


def test_very_long_path_is_told(root):
    assert "expected an existing file" in changed(root, motions="a" * 5000)


def test_absolute_path_with_spaces_and_letters_beyond_ascii(root):
    path = root / "mes données" / "été.tsv"
    path.parent.mkdir()
    path.write_text("")
    assert load_config({**RAW, "motions": str(path)}, SCHEMA, root)["motions"] == str(path)


def test_no_group_at_all(root):
    assert problems(["name"], root) == [
        "the configuration: found ['name'], expected a group of keys"
    ]


def test_all_problems_at_once_in_order(root):
    raw = {**RAW, "name": 3, "mirrors": "a", "contacts": [], "figures": None, "moitons": "x"}
    keys = [line.split("'")[1] for line in problems(raw, root)]
    assert keys == ["contacts", "figures", "mirrors", "moitons", "name"]


def test_misspelt_contact_threshold(root):
    gates = {**RAW["contacts"], "run": {"enter_hight_m": 0.04}}
    found = changed(root, contacts=gates)
    assert "contacts.run.enter_hight_m" in found
    assert "did you mean enter_height_m" in found


def test_contacts_need_a_default(root):
    found = changed(root, contacts={"run": RAW["contacts"]["run"]})
    assert found.startswith("config key 'contacts.default': found nothing")


def test_cutoff_must_be_a_frequency(root):
    found = changed(root, retarget={**RAW["retarget"], "cutoff_hz": {"default": 0}})
    assert found.startswith("config key 'retarget.cutoff_hz.default': found 0, expected")
