"""Reading the ledger: `config/claims.yaml` with its claims, metrics and rules, checked."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.rules import Condition, Metric, parse_condition
from motionstyle.evaluation.schema_messages import schema_problems
from motionstyle.files import read_json

PAPERS = {"nio": "nio", "sm": "style_machines", "ss": "similarity", "gt": "ground_truth"}
_SHOWN_PROBLEMS = 5


@dataclass(frozen=True)
class Claim:
    """One entry of the ledger; `partly` may be missing, and `why` tells why it is not testable."""

    id: str
    paper: str
    source: str
    claim: str
    paper_value: str
    paper_number: float | None
    unit: str
    metrics: Mapping[str, Metric]
    replicated: Condition | None
    partly: Condition | None
    why: str
    note: str
    planted_only: bool
    data_column: str | None
    changed: tuple[str, ...]

    def rule_text(self) -> str:
        """Return the rule for the verdict in words; empty where nothing can be tested."""
        if self.replicated is None:
            return ""
        partly = f"; partly if {self.partly.text()}" if self.partly else ""
        return f"replicated if {self.replicated.text()}{partly}; otherwise not"

    def metrics_text(self) -> str:
        """Return where each number of the rule comes from."""
        return "; ".join(f"{name} is {metric.text()}" for name, metric in self.metrics.items())


class _StrictLoader(yaml.SafeLoader):
    """YAML without silent overwriting by repeated keys; dates stay text."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        """Refuse a mapping that has one key twice."""
        keys = Counter(str(key.value) for key, _ in node.value)
        if repeated := [key for key, count in keys.items() if count > 1]:
            line = node.start_mark.line + 1
            raise MotionStyleError(f"line {line}: key {', '.join(repeated)} stands there twice")
        return super().construct_mapping(node, deep)


_StrictLoader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in pairs if tag != "tag:yaml.org,2002:timestamp"]
    for first, pairs in yaml.SafeLoader.yaml_implicit_resolvers.items()
}


def load_claims(path: str | Path, schema_path: str | Path) -> list[Claim]:
    """Read the ledger and check it against its schema and for sense.

    Raises
    ------
    MotionStyleError
        One line that names the file and the key path of each mistake (of the first five).
    """
    path = Path(path)
    try:
        data = yaml.load(path.read_text(encoding="utf-8"), Loader=_StrictLoader)  # a safe loader
        problems = schema_problems(data, read_json(schema_path))
        if not problems:
            ids = Counter(entry["id"] for entry in data["claims"])
            problems = [f"duplicate id '{name}'" for name, n in ids.items() if n > 1]
        if not problems:
            return [_build(entry) for entry in data["claims"]]
    except OSError as problem:
        raise MotionStyleError(f"{path}: cannot be read: {problem.strerror}") from problem
    except (yaml.YAMLError, UnicodeDecodeError) as problem:
        raise MotionStyleError(f"{path}: not YAML: {' '.join(str(problem).split())}") from problem
    except MotionStyleError as problem:
        raise MotionStyleError(f"{path}: {problem}") from None
    shown = "; ".join(dict.fromkeys(problems[:_SHOWN_PROBLEMS]))
    more = len(problems) - _SHOWN_PROBLEMS
    raise MotionStyleError(f"{path}: {shown}{f'; and {more} more' if more > 0 else ''}")


def _build(entry: Mapping[str, Any]) -> Claim:
    name = entry["id"]
    if PAPERS[name.split("-")[0]] != entry["paper"]:
        raise MotionStyleError(f"claims[{name}].paper: '{entry['paper']}' does not fit the id")
    metrics = {
        key: Metric(
            m["table"],
            m["column"],
            m["statistic"],
            {c: tuple(v) if isinstance(v, list) else (v,) for c, v in m.get("filter", {}).items()},
        )
        for key, m in entry.get("metrics", {}).items()
    }
    conditions = {
        verdict: parse_condition(rule, list(metrics), f"claims[{name}].rule.{verdict}")
        for verdict, rule in entry.get("rule", {}).items()
    }
    number = entry["paper_number"]
    return Claim(
        id=name,
        paper=entry["paper"],
        source=entry["source"],
        claim=entry["claim"],
        paper_value=entry["paper_value"],
        paper_number=None if number is None else float(number),
        unit=entry["unit"],
        metrics=metrics,
        replicated=conditions.get("replicated"),
        partly=conditions.get("partly"),
        why=entry.get("why", ""),
        note=entry.get("note", ""),
        planted_only=entry.get("planted_only", False),
        data_column=entry.get("data_column"),
        changed=tuple(change["date"] for change in entry.get("history", [])),
    )
