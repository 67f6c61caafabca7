"""The language of the ledger: numbers taken from tables, and conditions on them, both as data.

A metric names a table, a column, the rows (`filter`) and a statistic; it yields one finite number
or a sentence that says why there is none. A condition is a comparison of one metric with a
constant or with another metric (`times` · other + `plus`), or `all` / `any` of conditions.
Nothing here is evaluated as code.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from motionstyle.errors import MotionStyleError, near_matches

Cell = str | float | bool

_COMPARE: dict[str, Callable[[float, float], bool]] = {
    "lt": operator.lt,
    "le": operator.le,
    "gt": operator.gt,
    "ge": operator.ge,
    "eq": lambda a, b: math.isclose(a, b, rel_tol=1e-9, abs_tol=1e-12),
    "ne": lambda a, b: not math.isclose(a, b, rel_tol=1e-9, abs_tol=1e-12),
}
_SIGN = {"lt": "<", "le": "≤", "gt": ">", "ge": "≥", "eq": "=", "ne": "≠"}
OPERATORS = (*_COMPARE, "between")
_TRUTH = {"true": 1.0, "yes": 1.0, "false": 0.0, "no": 0.0}

_STATISTICS: dict[str, Callable[[np.ndarray], float]] = {
    "first": lambda x: x[0],
    "last": lambda x: x[-1],
    "mean": np.mean,
    "median": np.median,
    "median_ratio": np.median,
    "min": np.min,
    "max": np.max,
    "range": np.ptp,
    "rms": lambda x: np.sqrt(np.mean(x**2)),
    "sum": np.sum,
}
STATISTICS = ("value", *_STATISTICS, "count", "count_distinct", "share_true")


@dataclass(frozen=True)
class Metric:
    """Where one number of a claim stands: `statistic` of `column` over the filtered rows."""

    table: str
    column: str
    statistic: str
    filter: Mapping[str, tuple[Cell, ...]]

    def text(self) -> str:
        """Return the metric in words, for the rule's small print."""
        what = self.column if self.statistic == "value" else f"{self.statistic} of {self.column}"
        return f"{what} in {self.table}{self.filter_text()}"

    def filter_text(self) -> str:
        """Return the filter in words, with a leading blank, or an empty string."""
        rows = ", ".join(f"{k} = {' or '.join(map(str, v))}" for k, v in self.filter.items())
        return f" where {rows}" if rows else ""


@dataclass(frozen=True)
class Measurement:
    """What a metric gave: a finite `value`, or None and the `reason`; `labels` of its rows."""

    value: float | None
    reason: str = ""
    labels: frozenset[str] = frozenset()


def read_table(path: Path) -> pd.DataFrame | str:
    """Return a CSV table with every cell as text, or a sentence that says why there is none."""
    try:
        return pd.read_csv(path, dtype=str, keep_default_na=False, encoding="utf-8")
    except FileNotFoundError:
        return "the table does not exist"
    except (OSError, ValueError) as problem:  # pandas' parser errors are ValueErrors
        return f"the table cannot be read: {' '.join(str(problem).split())}"


def _matches(column: pd.Series, wanted: Cell) -> pd.Series:
    if isinstance(wanted, bool):
        return column.str.strip().str.lower().map(_TRUTH) == float(wanted)
    if isinstance(wanted, str):
        return column == wanted
    return pd.to_numeric(column, errors="coerce") == wanted


def _number(cell: str) -> float:
    """Return a cell as a number (a truth value as 1 or 0), NaN if it is neither."""
    stripped = cell.strip().lower()
    if stripped in _TRUTH:
        return _TRUTH[stripped]
    try:
        return float(stripped)
    except ValueError:
        return math.nan


def measure(
    metric: Metric, table: pd.DataFrame | str, data_column: str | None = None
) -> Measurement:
    """Take one number from a table read by `read_table`.

    Where the rows found hold planted and other data, the planted ones are set aside. One cell
    that is no finite number leaves the whole metric unmeasured: failures are left out only where
    the ledger's filter says so. Only `median_ratio` takes infinite ones, ratios to nothing.
    """

    def missing(reason: str) -> Measurement:
        return Measurement(None, f"{metric.table}: {reason}")

    if isinstance(table, str):
        return missing(table)
    needed = [*metric.filter, metric.column, *([data_column] if data_column else [])]
    absent = [c for c in dict.fromkeys(needed) if c not in table.columns]
    if absent:
        return missing(f"no column {', '.join(absent)}")
    rows = table
    for column, wanted in metric.filter.items():
        keep = np.logical_or.reduce([_matches(rows[column], w).to_numpy() for w in wanted])
        rows = rows[keep]
    if rows.empty:
        return missing(f"no rows{metric.filter_text()}")
    labels: frozenset[str] = frozenset()
    label_column = data_column or next((c for c in ("data", "kind") if c in rows.columns), None)
    if label_column:
        labels = frozenset(rows[label_column]) - {""}
        if "planted" in labels and len(labels) > 1:
            rows = rows[rows[label_column] != "planted"]
            labels -= {"planted"}
    return _reduce(metric, list(rows[metric.column]), labels)


def _reduce(metric: Metric, cells: Sequence[str], labels: frozenset[str]) -> Measurement:
    where = f"{metric.table}: {metric.column}"
    if metric.statistic in ("count", "count_distinct"):
        if "" in cells:
            return Measurement(None, f"{where} is empty in some rows", labels)
        distinct = metric.statistic == "count_distinct"
        return Measurement(float(len(set(cells) if distinct else cells)), "", labels)
    if metric.statistic == "value" and len(cells) != 1:
        return Measurement(None, f"{where}: {len(cells)} rows match where one is meant", labels)
    numbers = np.array([_number(c) for c in cells])
    # A median needs only an order, in which ratios to nothing have their place.
    bad = np.isnan(numbers) if metric.statistic == "median_ratio" else ~np.isfinite(numbers)
    if metric.statistic == "share_true":
        bad |= ~np.isin(numbers, (0.0, 1.0))
    if bad.any():
        example = cells[int(np.argmax(bad))] or "empty"
        kind = "truth values" if metric.statistic == "share_true" else "finite numbers"
        reason = f"{where}: {bad.sum()} of {len(cells)} cells are no {kind} (first: {example})"
        return Measurement(None, reason, labels)
    # The mean of truth values is their share, of one value the value.
    reduce = _STATISTICS.get(metric.statistic, np.mean)
    found = float(reduce(numbers))
    if not np.isfinite(found):
        return Measurement(None, f"{where}: the {metric.statistic} is infinite", labels)
    return Measurement(found, "", labels)


@dataclass(frozen=True)
class Comparison:
    """`metric` `op` bounds; the bounds are constants or `times` · metric `than` + `plus`."""

    metric: str
    op: str
    bounds: tuple[float, ...]
    than: str | None = None
    times: float = 1.0
    plus: float = 0.0

    def holds(self, values: Mapping[str, float]) -> bool:
        """Say whether the comparison is true of the measured values."""
        value = values[self.metric]
        if self.op == "between":
            return self.bounds[0] <= value <= self.bounds[1]
        bound = self.bounds[0] if self.than is None else self.times * values[self.than] + self.plus
        return _COMPARE[self.op](value, bound)

    def text(self) -> str:
        """Return the comparison in words."""
        if self.op == "between":
            return f"{self.metric} in {self.bounds[0]:g} … {self.bounds[1]:g}"
        if self.than is None:
            return f"{self.metric} {_SIGN[self.op]} {self.bounds[0]:g}"
        factor = "" if self.times == 1 else f"{self.times:g} · "
        offset = "" if self.plus == 0 else f" {'+' if self.plus > 0 else '−'} {abs(self.plus):g}"
        return f"{self.metric} {_SIGN[self.op]} {factor}{self.than}{offset}"


@dataclass(frozen=True)
class Combination:
    """`all` or `any` of several conditions."""

    how: str
    parts: tuple[Condition, ...]

    def holds(self, values: Mapping[str, float]) -> bool:
        """Say whether the combination is true of the measured values."""
        results = [part.holds(values) for part in self.parts]
        return all(results) if self.how == "all" else any(results)

    def text(self) -> str:
        """Return the combination in words."""
        joint = " and " if self.how == "all" else " or "
        parts = [f"({p.text()})" if isinstance(p, Combination) else p.text() for p in self.parts]
        return joint.join(parts)


Condition = Comparison | Combination


def parse_condition(data: Mapping[str, Any], metrics: Sequence[str], where: str) -> Condition:
    """Build a condition from the ledger's data.

    Parameters
    ----------
    data : the condition as read from YAML.
    metrics : names of the claim's metrics; a comparison without `metric` means the only one.
    where : key path for messages.

    Raises
    ------
    MotionStyleError
        For an unknown operator or metric, bounds that do not fit the operator, or a mixture of
        comparison and combination.
    """
    if how := next((h for h in ("all", "any") if h in data), None):
        if others := sorted(set(data) - {how}):
            raise MotionStyleError(
                f"{where}: '{how}' stands alone; move {', '.join(others)} into it"
            )
        parts = enumerate(data[how])
        return Combination(
            how, tuple(parse_condition(p, metrics, f"{where}.{how}[{i}]") for i, p in parts)
        )
    if "op" not in data:
        raise MotionStyleError(f"{where}: a condition needs 'op', 'all' or 'any'")
    op = str(data["op"])
    if op not in OPERATORS:
        raise MotionStyleError(
            f"{where}.op: unknown operator '{op}'{near_matches(op, OPERATORS)}; "
            f"expected one of {', '.join(OPERATORS)}"
        )
    if "metric" not in data and len(metrics) > 1:
        raise MotionStyleError(f"{where}: say which metric is meant: {', '.join(metrics)}")
    name, than = str(data.get("metric", metrics[0])), data.get("than")
    if unknown := [m for m in (name, than) if m is not None and m not in metrics]:
        raise MotionStyleError(
            f"{where}: unknown metric '{unknown[0]}'{near_matches(unknown[0], metrics)}; "
            f"this claim has {', '.join(metrics)}"
        )
    if ("value" in data) == (than is not None):
        raise MotionStyleError(f"{where}: give either 'value' or 'than', and not both")
    if than is None and ("times" in data or "plus" in data):
        raise MotionStyleError(f"{where}: 'times' and 'plus' belong to 'than'")
    value = data.get("value", ())
    bounds = tuple(map(float, value if isinstance(value, list | tuple) else (value,)))
    ordered = len(bounds) == 2 and bounds[0] <= bounds[1]
    if op == "between" and not ordered:
        raise MotionStyleError(f"{where}: 'between' needs value: [low, high]")
    if op != "between" and than is None and len(bounds) != 1:
        raise MotionStyleError(f"{where}: '{op}' needs one number as value")
    times, plus = float(data.get("times", 1.0)), float(data.get("plus", 0.0))
    if not all(map(math.isfinite, (*bounds, times, plus))):
        raise MotionStyleError(f"{where}: bounds must be finite numbers")
    return Comparison(name, op, bounds, than, times, plus)
