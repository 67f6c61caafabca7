"""One checked way to run a solver, and what to read when it fails.

Every solve of this room goes through `checked_solve`: whatever happens there is a `SolveRecord`
with status, iterations, optimality and worst violations, and a diagnosis that names the ten worst
constraints by joint and frame, the variables at their bounds, and the terms of the cost.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from time import perf_counter
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError

Array = NDArray[np.float64]
Value = TypeVar("Value")
WORST = 10


@dataclass(frozen=True)
class Constraint:
    """Something that should be zero (or not positive) in every frame.

    name, unit : for people. limit : up to which a violation is fine. where : what each column is,
    a joint, a foot point, a direction. violation : (F, len(where)), ≥ 0.
    """

    name: str
    unit: str
    limit: float
    where: Sequence[str]
    violation: Array

    def worst(self) -> float:
        """Return the largest violation."""
        return float(np.max(self.violation, initial=0.0))


@dataclass(frozen=True)
class Outcome(Generic[Value]):
    """What a solver returns to `checked_solve`.

    value : the solution. converged, message : its own verdict in one phrase. iterations : of its
    inner loop. optimality : fall of the cost that one more Newton step promises, as a share of
    the cost. constraints : to be held against. at_bounds : how many frames each named variable
    spends at a bound. terms : shares of the cost by name.
    """

    value: Value
    converged: bool
    message: str
    iterations: int
    optimality: float
    constraints: tuple[Constraint, ...] = ()
    at_bounds: Mapping[str, int] = field(default_factory=dict)
    terms: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class SolveRecord:
    """How a solve went, for tables: status is "converged", "not converged" or "failed"."""

    status: str
    reason: str
    iterations: int
    seconds: float
    optimality: float
    violations: Mapping[str, float]


def checked_solve(
    run: Callable[[], Outcome[Value]], log: Callable[[str], None] = print
) -> tuple[Value | None, SolveRecord, dict[str, Any]]:
    """Run a solver; return its value, the record, and the diagnosis.

    A numerical breakdown (singular matrix, overflow, floating-point error) is status "failed" with
    no value, and numbers that are not finite are never reported as converged. Errors in the
    input, `MotionStyleError`, pass through.
    """
    started = perf_counter()
    try:
        outcome = run()
    except MotionStyleError:
        raise
    except (np.linalg.LinAlgError, ArithmeticError, ValueError, RuntimeError) as error:
        reason = f"{type(error).__name__}: {error}"
        record = SolveRecord("failed", reason, 0, perf_counter() - started, float("nan"), {})
        log(f"solve failed: {reason}")
        return None, record, {**asdict(record), "worst": [], "at_bounds": {}, "terms": {}}
    finite = all(np.isfinite(c.violation).all() for c in outcome.constraints)
    finite = finite and all(np.isfinite(v) for v in outcome.terms.values())
    violated = [c for c in outcome.constraints if not c.worst() <= c.limit]
    reason = outcome.message
    if not finite:
        reason = f"numbers that are not finite ({outcome.message})"
    elif not outcome.converged and violated:
        named = ", ".join(f"{c.name} {c.worst():.3g} {c.unit}" for c in violated[:3])
        reason = f"{outcome.message}; {named}"
    converged = outcome.converged and finite
    record = SolveRecord(
        status="converged" if converged else "not converged",
        reason="" if converged else reason,
        iterations=outcome.iterations,
        seconds=perf_counter() - started,
        optimality=outcome.optimality,
        violations={c.name: c.worst() for c in outcome.constraints},
    )
    log(f"{record.status} after {record.iterations} iterations; {reason}")
    return outcome.value, record, diagnosis(record, outcome)


def worst_constraints(constraints: Sequence[Constraint]) -> list[dict[str, Any]]:
    """Return the ten worst violations against their limits, each constraint and column once."""
    found = []
    for constraint in constraints:
        if not constraint.violation.size:
            continue
        frames = np.argmax(constraint.violation, axis=0)
        for column, frame in enumerate(frames):
            value = float(constraint.violation[frame, column])
            if value > 0 or not np.isfinite(value):
                found.append(
                    {
                        "constraint": constraint.name,
                        "where": constraint.where[column],
                        "frame": int(frame),
                        "violation": value,
                        "unit": constraint.unit,
                        "limit": constraint.limit,
                    }
                )
    found.sort(key=lambda one: -np.nan_to_num(one["violation"] / one["limit"], nan=np.inf))
    return found[:WORST]


def diagnosis(record: SolveRecord, outcome: Outcome[Any]) -> dict[str, Any]:
    """Return what to read when a solve went wrong, as JSON values."""
    bounds = sorted(outcome.at_bounds.items(), key=lambda one: -one[1])
    return {
        **asdict(record),
        "worst": worst_constraints(outcome.constraints),
        "at_bounds": {name: count for name, count in bounds if count},
        "terms": dict(outcome.terms),
    }
