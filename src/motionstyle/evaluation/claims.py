"""The verdicts: every claim of the ledger judged from the tables of one results folder.

The ledger itself is `config/claims.yaml`; the outcome is `tables/claims.csv`. No verdict is
typed by hand: a number that is missing or not finite leaves its claim "not yet measured".
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from motionstyle.evaluation.ledger import Claim, load_claims
from motionstyle.evaluation.rules import measure, read_table
from motionstyle.files import atomic_write

__all__ = [
    "CLAIMS_COLUMNS",
    "VERDICTS",
    "Claim",
    "ClaimResult",
    "evaluate_claims",
    "load_claims",
    "write_claims_csv",
]

NOT_TESTABLE = "not testable here"
NOT_MEASURED = "not yet measured"
VERDICTS = ("replicated", "partly", "not", NOT_TESTABLE, NOT_MEASURED)


def _short(value: float) -> str:
    """Return a number with four digits, whole ones in full."""
    return f"{value:.0f}" if value == round(value) and abs(value) < 1e9 else f"{value:.4g}"


@dataclass(frozen=True)
class ClaimResult:
    """A claim with what was measured; `verdict` is one of `VERDICTS`, `data` labels its rows."""

    claim: Claim
    measured: Mapping[str, float]
    verdict: str
    data: str
    reason: str

    @property
    def data_warning(self) -> str:
        """Say "planted data" or "partly planted data" where a verdict rests on such, else ""."""
        if self.verdict in (NOT_TESTABLE, NOT_MEASURED) or "planted" not in self.data:
            return ""
        return "planted data" if self.data == "planted" else "partly planted data"

    @property
    def verdict_text(self) -> str:
        """The verdict, which says so where it rests on planted data."""
        return f"{self.verdict} ({self.data_warning})" if self.data_warning else self.verdict

    @property
    def measured_text(self) -> str:
        """The measured number, or all of them with their names."""
        if len(self.claim.metrics) == 1:
            return "".join(map(_short, self.measured.values()))
        return "; ".join(f"{name} = {_short(value)}" for name, value in self.measured.items())

    @property
    def distance(self) -> str:
        """First measured number minus the paper's, absolute and in percent; may be empty."""
        paper = self.claim.paper_number
        first = next(iter(self.claim.metrics), None)
        if paper is None or first not in self.measured:
            return ""
        difference = self.measured[first] - paper
        relative = f" ({100 * difference / abs(paper):+.1f} %)" if paper else ""
        return f"{difference:+.3g}{relative}"

    def row(self) -> dict[str, str]:
        """Return the row of `tables/claims.csv`."""
        claim = self.claim
        return {
            "id": claim.id,
            "paper": claim.paper,
            "source": claim.source,
            "claim": claim.claim,
            "paper_value": claim.paper_value,
            "measured": self.measured_text,
            "unit": claim.unit,
            "distance_from_paper": self.distance,
            "verdict": self.verdict_text,
            "data": self.data,
            "table": "; ".join(dict.fromkeys(m.table for m in claim.metrics.values())),
            "rule": ". ".join(
                t for t in (claim.rule_text(), claim.metrics_text(), claim.note) if t
            ),
            "rule_changed": f"yes ({', '.join(claim.changed)})" if claim.changed else "no",
            "reason": self.reason,
        }


CLAIMS_COLUMNS = (
    *("id", "paper", "source", "claim", "paper_value", "measured", "unit", "distance_from_paper"),
    *("verdict", "data", "table", "rule", "rule_changed", "reason"),
)


def evaluate_claims(claims: Sequence[Claim], results_root: str | Path) -> list[ClaimResult]:
    """Judge every claim from the tables of one results folder.

    A table, column or row that is missing, and any number that is not finite, leaves the claim
    "not yet measured" with the reason.
    """
    tables = {m.table for claim in claims for m in claim.metrics.values()}
    read = {table: read_table(Path(results_root) / table) for table in sorted(tables)}
    results = []
    for claim in claims:
        if claim.replicated is None:
            results.append(ClaimResult(claim, {}, NOT_TESTABLE, "", claim.why))
            continue
        found = {
            name: measure(metric, read[metric.table], claim.data_column)
            for name, metric in claim.metrics.items()
        }
        values = {name: m.value for name, m in found.items() if m.value is not None}
        labels = sorted(frozenset[str]().union(*(m.labels for m in found.values())))
        if claim.planted_only and not labels:
            labels = ["planted"]
        reasons = dict.fromkeys(m.reason for m in found.values() if m.reason)
        if reasons:
            verdict = NOT_MEASURED
        elif claim.replicated.holds(values):
            verdict = "replicated"
        else:
            verdict = "partly" if claim.partly and claim.partly.holds(values) else "not"
        data = ", ".join(labels) or ("not stated" if values else "")
        results.append(ClaimResult(claim, values, verdict, data, "; ".join(reasons)))
    return results


def write_claims_csv(path: str | Path, results: Sequence[ClaimResult]) -> None:
    """Write the ledger with its verdicts as a CSV table, atomically.

    Raises
    ------
    OSError
        If the folder cannot be written to.
    """
    with atomic_write(path) as handle:
        writer = csv.DictWriter(handle, CLAIMS_COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(result.row() for result in results)
