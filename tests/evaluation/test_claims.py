"""The ledger: what it must hold, and verdicts that follow from tables and from nothing else."""

import copy
import csv
from pathlib import Path

import pytest
import yaml

from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.claims import (
    CLAIMS_COLUMNS,
    VERDICTS,
    evaluate_claims,
    load_claims,
    write_claims_csv,
)
from motionstyle.evaluation.rules import STATISTICS, parse_condition
from motionstyle.files import read_json

REPOSITORY = Path(__file__).parents[2]
LEDGER = REPOSITORY / "config" / "claims.yaml"
SCHEMA = REPOSITORY / "workflow" / "schemas" / "claims.schema.json"
CHECKLISTS = {
    "nio": [f"F{i}" for i in range(1, 6)] + [f"E{i}" for i in range(1, 18)] + ["T1"],
    "sm": [f"F{i}" for i in range(9)] + [f"E{i}" for i in range(1, 11)],
    "ss": [f"F{i}" for i in range(1, 5)] + [f"T{i}" for i in range(1, 9)],
}
ENTRY = {
    "id": "gt-example",
    "paper": "ground_truth",
    "source": "a goal",
    "claim": "The error is small.",
    "paper_value": "0.06",
    "paper_number": 0.06,
    "unit": "cm",
    "metrics": {"error": {"table": "tables/t.csv", "column": "error_cm", "statistic": "value"}},
    "rule": {
        "replicated": {"op": "le", "value": 0.08},
        "partly": {"op": "le", "value": 0.15},
    },
}


@pytest.fixture(scope="module")
def ledger():
    return load_claims(LEDGER, SCHEMA)


@pytest.fixture
def judge(tmp_path):
    """Judge one changed copy of ENTRY on tables given as text."""

    def run(changes=None, remove=(), **tables):
        entry = {**copy.deepcopy(ENTRY), **(changes or {})}
        for key in remove:
            del entry[key]
        for name, text in tables.items():
            (tmp_path / "tables").mkdir(exist_ok=True)
            (tmp_path / "tables" / f"{name}.csv").write_text(text, encoding="utf-8")
        return evaluate_claims(load(tmp_path, [entry]), tmp_path)[0]

    return run


def load(folder, entries, text=None):
    path = folder / "claims.yaml"
    data = {"status_if_unmeasured": "not yet measured", "claims": entries}
    path.write_text(text or yaml.safe_dump(data, sort_keys=False), encoding="utf-8")
    return load_claims(path, SCHEMA)


def complaint(folder, changes=None, remove=(), text=None):
    entry = {**copy.deepcopy(ENTRY), **(changes or {})}
    for key in remove:
        del entry[key]
    with pytest.raises(MotionStyleError) as caught:
        load(folder, [entry], text)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(str(folder / "claims.yaml"))
    assert len(message) < 500
    return message


# The shipped ledger


def test_every_checklist_id_is_in_the_ledger(ledger):
    wanted = {f"{paper}-{name}" for paper, names in CHECKLISTS.items() for name in names}
    assert len(wanted) == 54
    assert wanted - {claim.id for claim in ledger} == set()


def test_ids_beyond_the_checklists_are_few_and_known(ledger):
    wanted = {f"{paper}-{name}" for paper, names in CHECKLISTS.items() for name in names}
    others = {c.id for c in ledger if c.paper != "ground_truth"} - wanted
    assert others == {"sm-E7-video"}


def test_numbers_of_the_papers(ledger):
    numbers = {c.id: c.paper_number for c in ledger}
    expected = {"nio-F5": 0.059, "sm-E1": 0.93, "sm-F4": 69, "ss-T1": 99.9, "ss-T4": 0.1}
    assert {name: numbers[name] for name in expected} == expected


def test_every_claim_is_one_sentence_and_untestable_ones_say_why(ledger):
    for claim in ledger:
        assert claim.claim.endswith("."), claim.id
        assert ". " not in claim.claim, claim.id
        assert bool(claim.replicated) != bool(claim.why), claim.id
    untestable = {c.id for c in ledger if c.why}
    assert untestable == {"sm-F7", "sm-E7-video", "ss-F4", "gt-captured-ramp"}


def test_ledger_before_any_number(ledger, tmp_path):
    results = evaluate_claims(ledger, tmp_path)
    assert {r.verdict for r in results} == {"not yet measured", "not testable here"}
    assert all(r.reason for r in results)
    assert not any(r.measured for r in results)


# One row per claim with a rule of its own: the numbers that replicate it, and those that do not.


def test_nio_figure_5_follows_its_three_numbers(ledger, tmp_path):
    (tmp_path / "tables").mkdir()
    claim = [c for c in ledger if c.id == "nio-F5"]
    head = "algorithm,inner,action,mood,iteration,step_10,last_step,G,G_over_E_target,data\n"
    row = "paper,truncated,walk,neutral,{},{},{},{},{},captured\n"

    def verdict(last_gap, tenth):
        rows = [(0, "", "", 6000, 0.8), (10, "yes", "", tenth, 0.1)]
        rows.append((42, "", "yes", 474.05, last_gap))
        text = head + "".join(row.format(*values) for values in rows)
        (tmp_path / "tables" / "nio_learning.csv").write_text(text)
        result = evaluate_claims(claim, tmp_path)[0]
        assert result.data == "captured"
        return result.verdict

    assert verdict(0.059, 60) == "replicated"
    assert verdict(0.0801, 60) == "partly"
    assert verdict(0.059, 61) == "partly"
    assert verdict(0.16, 61) == "not"
    assert verdict(-0.01, 61) == "not"


def test_leakage_on_planted_pairs_is_not_claimed(ledger, tmp_path):
    (tmp_path / "tables").mkdir()
    claim = [c for c in ledger if c.id == "ss-F3"]
    head = "set,size,folds,width,mean_relative_leakage,share_below_0_2,data\n"
    table = tmp_path / "tables" / "leakage.csv"
    table.write_text(head + "whole_body,paper,pattern,chosen,0.1,0.9,planted\n")
    assert evaluate_claims(claim, tmp_path)[0].verdict == "not yet measured"
    table.write_text(head + "whole_body,paper,pattern,chosen,0.1,0.9,captured\n")
    assert evaluate_claims(claim, tmp_path)[0].verdict == "replicated"


# Verdicts


@pytest.mark.parametrize(
    ("value", "verdict"),
    [
        ("0.08", "replicated"),
        ("0.0800001", "partly"),
        ("0.15", "partly"),
        ("0.1500001", "not"),
        ("-1", "replicated"),
    ],
)
def test_verdict_flips_at_the_bounds(judge, value, verdict):
    assert judge(t=f"error_cm\n{value}\n").verdict == verdict


@pytest.mark.parametrize(
    ("op", "value", "true", "false"),
    [
        ("lt", 2, "1.999", "2"),
        ("le", 2, "2", "2.001"),
        ("gt", 2, "2.001", "2"),
        ("ge", 2, "2", "1.999"),
        ("eq", 2, "2.0", "2.001"),
        ("ne", 2, "2.001", "2.0"),
        ("between", [1, 2], "1", "0.999"),
        ("between", [1, 2], "2", "2.001"),
    ],
)
def test_every_operator(judge, op, value, true, false):
    rule = {"rule": {"replicated": {"op": op, "value": value}}}
    assert judge(rule, t=f"error_cm\n{true}\n").verdict == "replicated"
    assert judge(rule, t=f"error_cm\n{false}\n").verdict == "not"


def test_all_any_and_comparison_with_another_metric(judge):
    metrics = {
        name: {"table": "tables/t.csv", "column": name, "statistic": "value"} for name in "ab"
    }
    twice = {"metric": "a", "op": "gt", "than": "b", "times": 2, "plus": 1}
    small = {"metric": "b", "op": "lt", "value": 10}
    entry = {
        "metrics": metrics,
        "rule": {"replicated": {"all": [twice, small]}, "partly": {"any": [twice, small]}},
    }
    assert judge(entry, t="a,b\n7.1,3\n").verdict == "replicated"
    assert judge(entry, t="a,b\n7,3\n").verdict == "partly"
    assert judge(entry, t="a,b\n21.1,10\n").verdict == "partly"
    assert judge(entry, t="a,b\n21,10\n").verdict == "not"
    rule = judge(entry, t="a,b\n7,3\n").claim.rule_text()
    both = "a > 2 · b + 1 {} b < 10"
    assert rule == (
        f"replicated if {both.format('and')}; partly if {both.format('or')}; otherwise not"
    )


@pytest.mark.parametrize(
    ("statistic", "cells", "value"),
    [
        ("value", ["5"], 5),
        ("first", ["3", "1", "2"], 3),
        ("last", ["3", "1", "2"], 2),
        ("mean", ["3", "1", "5"], 3),
        ("median", ["3", "1", "8"], 3),
        ("median_ratio", ["3", "inf", "1", "inf", "0"], 3),
        ("min", ["3", "1", "2"], 1),
        ("max", ["3", "1", "2"], 3),
        ("range", ["3", "1", "6"], 5),
        ("rms", ["3", "-4", "5", "0"], 12.5**0.5),
        ("sum", ["3", "1", "2"], 6),
        ("count", ["x", "x", "y"], 3),
        ("count_distinct", ["x", "x", "y"], 2),
        ("share_true", ["True", "false", "1", "yes"], 0.75),
    ],
)
def test_every_statistic(judge, statistic, cells, value):
    metric = {**ENTRY["metrics"]["error"], "statistic": statistic}
    result = judge({"metrics": {"error": metric}}, t="error_cm\n" + "\n".join(cells) + "\n")
    assert result.measured == {"error": pytest.approx(value)}


def test_statistics_of_code_and_schema_agree():
    schema = read_json(SCHEMA)["$defs"]["metric"]["properties"]["statistic"]["enum"]
    assert set(schema) == set(STATISTICS)


def test_filter_by_text_number_truth_and_list(judge):
    table = "name,n,good,error_cm\na,1.0,True,1\nb,1,False,2\nb,2,True,4\nc,2,yes,8\n"

    def total(wanted):
        metric = {**ENTRY["metrics"]["error"], "statistic": "sum", "filter": wanted}
        return judge({"metrics": {"error": metric}}, t=table).measured.get("error")

    assert total({"name": "b"}) == 6
    assert total({"n": 1}) == 3
    assert total({"good": True}) == 13
    assert total({"name": ["a", "c"]}) == 9
    assert total({"name": "b", "n": 2}) == 4
    assert total({"name": "z"}) is None


# Nothing measured is never a pass


def test_missing_table(judge):
    result = judge()
    assert result.verdict == "not yet measured"
    assert result.reason == "tables/t.csv: the table does not exist"


def test_missing_column_and_rows(judge):
    assert judge(t="other\n1\n").reason == "tables/t.csv: no column error_cm"
    assert judge(t="error_cm\n").reason == "tables/t.csv: no rows"
    metric = {**ENTRY["metrics"]["error"], "filter": {"style": "sad"}}
    result = judge({"metrics": {"error": metric}}, t="error_cm\n0.01\n")
    assert (result.verdict, result.reason) == ("not yet measured", "tables/t.csv: no column style")
    result = judge({"metrics": {"error": metric}}, t="error_cm,style\n0.01,happy\n")
    assert result.reason == "tables/t.csv: no rows where style = sad"


def test_two_rows_where_one_is_meant(judge):
    result = judge(t="error_cm\n0.01\n0.02\n")
    assert result.verdict == "not yet measured"
    assert "2 rows match where one is meant" in result.reason


@pytest.mark.parametrize("cell", ["nan", "NaN", '""', "inf", "-inf", "n/a", "failed"])
@pytest.mark.parametrize("statistic", ["max", "min", "median", "share_true"])
def test_one_cell_without_a_number_leaves_the_claim_unmeasured(judge, cell, statistic):
    metric = {**ENTRY["metrics"]["error"], "statistic": statistic}
    changes = {"metrics": {"error": metric}, "rule": {"replicated": {"op": "le", "value": 1e300}}}
    result = judge(changes, t=f"error_cm\n0\n{cell}\n1\n")
    assert result.verdict == "not yet measured"
    assert "1 of 3 cells are no" in result.reason
    assert result.measured_text == ""
    assert judge(changes, t="error_cm\n0\n1\n1\n").verdict == "replicated"


@pytest.mark.parametrize("cells", [["0", "nan", "inf"], ["0", '""', "1"], ["1", "inf", "inf"]])
def test_a_median_of_ratios_must_itself_be_a_number(judge, cells):
    metric = {**ENTRY["metrics"]["error"], "statistic": "median_ratio"}
    result = judge({"metrics": {"error": metric}}, t="error_cm\n" + "\n".join(cells) + "\n")
    assert result.verdict == "not yet measured"
    assert "finite" in result.reason


def test_unreadable_table_is_a_reason(judge):
    assert judge(t="").reason.startswith("tables/t.csv: the table cannot be read")
    assert judge(t='error_cm\n"0.01\n').reason.startswith("tables/t.csv: the table cannot be read")


def test_one_missing_metric_of_two_leaves_the_claim_unmeasured(judge):
    metrics = {
        "error": ENTRY["metrics"]["error"],
        "count": {"table": "tables/u.csv", "column": "n", "statistic": "sum"},
    }
    rule = {"replicated": {"metric": "error", "op": "le", "value": 1}}
    result = judge({"metrics": metrics, "rule": rule}, t="error_cm\n0.5\n")
    assert result.verdict == "not yet measured"
    assert result.measured_text == "error = 0.5"
    assert result.reason == "tables/u.csv: the table does not exist"


# Where the data come from


def test_planted_rows_show_in_the_verdict(judge):
    result = judge(t="error_cm,data\n0.01,planted\n")
    assert (result.verdict, result.data) == ("replicated", "planted")
    assert result.row()["verdict"] == "replicated (planted data)"
    assert judge(t="error_cm,kind\n0.9,planted\n").row()["verdict"] == "not (planted data)"
    assert judge(t="error_cm,data\n0.01,captured\n").row()["verdict"] == "replicated"
    assert judge(t="error_cm\n0.01\n").data == "not stated"


def test_data_column_goes_before_kind_and_can_be_named(judge):
    table = "error_cm,kind,data,origin\n0.01,nio,captured,planted\n"
    assert judge(t=table).data == "captured"
    assert judge({"data_column": "origin"}, t=table).data == "planted"
    assert judge({"data_column": "where"}, t=table).verdict == "not yet measured"


def test_planted_rows_stand_aside_for_captured_ones(judge):
    result = judge(t="error_cm,data\n0.5,captured\n0.01,planted\n")
    assert (result.verdict, result.data, result.measured) == ("not", "captured", {"error": 0.5})


def test_planted_by_construction(judge):
    result = judge({"planted_only": True}, t="error_cm\n0.01\n")
    assert result.row()["verdict"] == "replicated (planted data)"


def test_captured_and_planted_numbers_in_one_claim(judge):
    metrics = {
        "error": ENTRY["metrics"]["error"],
        "other": {"table": "tables/u.csv", "column": "error_cm", "statistic": "value"},
    }
    rule = {"replicated": {"metric": "error", "op": "le", "value": 1}}
    result = judge(
        {"metrics": metrics, "rule": rule},
        t="error_cm,data\n0.5,captured\n",
        u="error_cm,data\n0.5,planted\n",
    )
    assert result.verdict_text == "replicated (partly planted data)"


# The table


def test_claims_csv(judge, tmp_path):
    changed = [{"date": "2030-01-02", "commit_subject": "Tighten it", "why": "too lax"}]
    results = [
        judge({"history": changed}, t="error_cm\n0.075\n"),
        judge({"testable": False, "why": "no ramp"}, remove=("metrics", "rule")),
    ]
    path = tmp_path / "out" / "claims.csv"
    write_claims_csv(path, results)
    with path.open(encoding="utf-8", newline="") as handle:
        rows = list(csv.DictReader(handle))
    assert tuple(rows[0]) == CLAIMS_COLUMNS
    assert rows[0]["measured"] == "0.075"
    assert rows[0]["distance_from_paper"] == "+0.015 (+25.0 %)"
    assert rows[0]["rule_changed"] == "yes (2030-01-02)"
    assert rows[0]["table"] == "tables/t.csv"
    assert rows[0]["rule"] == (
        "replicated if error ≤ 0.08; partly if error ≤ 0.15; otherwise not. "
        "error is error_cm in tables/t.csv"
    )
    assert rows[1]["verdict"] == "not testable here"
    assert rows[1]["reason"] == "no ramp"
    assert rows[1]["rule_changed"] == "no"
    assert {row["verdict"] for row in rows} <= set(VERDICTS)


def test_distance_without_a_percentage_where_the_paper_has_zero_or_nothing(judge):
    assert judge({"paper_number": 0}, t="error_cm\n0.5\n").distance == "+0.5"
    assert judge({"paper_number": None}, t="error_cm\n0.5\n").distance == ""


# Mistakes in the ledger


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"papper_value": "x"}, "unknown key 'papper_value' (did you mean paper_value"),
        ({"claim": None}, "claims[gt-example].claim: is empty; expected string"),
        ({"paper_number": "0.06"}, 'paper_number: is "0.06"; expected number or null'),
        ({"paper": "groundtruth"}, "(did you mean ground_truth?)"),
        ({"paper": "nio"}, "claims[gt-example].paper: 'nio' does not fit the id"),
        ({"id": "xx-F1"}, 'claims[xx-F1].id: is "xx-F1"; expected nio-, sm-, ss- or gt-'),
        ({"metrics": {}}, "claims[gt-example].metrics:"),
        ({"claim": "  "}, "expected text that is not blank"),
        ({"testable": False, "why": "x"}, "no metrics and no rule beside 'testable: false'"),
        ({"why": "x"}, "no 'why' in a testable claim"),
        ({"history": [{"date": "yesterday"}]}, "history[0]: misses key commit_subject, why"),
        ({"rule": {"replicated": {"op": "lee", "value": 1}}}, "rule.replicated.op: is"),
        ({"rule": {"replicated": {"op": "le", "value": "1"}}}, "expected a number, or [low, high]"),
        ({"rule": {"replicated": {"op": "le"}}}, "either 'value' or 'than'"),
        ({"rule": {"replicated": {"op": "le", "value": [1, 2]}}}, "'le' needs one number"),
        ({"rule": {"replicated": {"op": "between", "value": [2, 1]}}}, "[low, high]"),
        ({"rule": {"replicated": {"op": "le", "value": 1, "plus": 1}}}, "belong to 'than'"),
        ({"rule": {"replicated": {"metric": "eror", "op": "le", "value": 1}}}, "mean error?"),
        ({"rule": {"replicated": {"all": [{"op": "le", "value": 1}], "op": "le"}}}, "stands alone"),
        ({"rule": {"replicated": {"value": 1}}}, "needs 'op', 'all' or 'any'"),
        ({"rule": {"partly": {"op": "le", "value": 1}}}, "rule: misses key replicated"),
    ],
)
def test_mistakes_are_told_in_one_line_with_the_key_path(tmp_path, changes, said):
    message = complaint(tmp_path, changes)
    assert said in message
    assert "claims[" in message


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"statistic": "meen"}, 'statistic: is "meen"; expected one of value'),
        ({"statistic": "meen"}, "(did you mean mean"),
        ({"colum": "x"}, "metrics.error: unknown key 'colum' (did you mean column?)"),
        ({"table": "../t.csv"}, 'metrics.error.table: is "../t.csv"; expected tables/<name>.csv'),
        ({"filter": {"style": None}}, "metrics.error.filter.style: is null; expected a text"),
    ],
)
def test_mistakes_in_a_metric(tmp_path, change, said):
    assert said in complaint(
        tmp_path, {"metrics": {"error": {**ENTRY["metrics"]["error"], **change}}}
    )


def test_missing_key(tmp_path):
    assert "claims[gt-example]: misses key unit" in complaint(tmp_path, remove=["unit"])


def test_many_mistakes_are_cut_short(tmp_path):
    blank = dict.fromkeys(("source", "claim", "paper_value", "unit", "metrics", "rule", "note"))
    message = complaint(tmp_path, blank)
    assert message.count("is empty") == 5
    assert message.endswith("; and 2 more")


def test_duplicate_ids_and_keys(tmp_path):
    with pytest.raises(MotionStyleError, match="duplicate id 'gt-example'"):
        load(tmp_path, [ENTRY, ENTRY])
    assert "line 1: key claims stands there twice" in complaint(
        tmp_path, text="claims: []\nclaims: []\n"
    )


def test_not_yaml_not_a_ledger_and_not_there(tmp_path):
    assert "not YAML" in complaint(tmp_path, text="claims: [\n")
    assert "top level: is [" in complaint(tmp_path, text="- 1\n")
    with pytest.raises(MotionStyleError, match="cannot be read: No such file"):
        load_claims(tmp_path / "none.yaml", SCHEMA)


def test_several_metrics_need_a_name_in_each_condition():
    with pytest.raises(MotionStyleError, match="say which metric is meant: a, b"):
        parse_condition({"op": "le", "value": 1}, ["a", "b"], "rule")


def test_bounds_must_be_finite():
    with pytest.raises(MotionStyleError, match="finite"):
        parse_condition({"op": "le", "value": float("inf")}, ["a"], "rule")
