"""The benchmark's rows: all contenders, or the reason why one is missing."""

import importlib

import pytest

from motionstyle.dynamics import benchmark
from motionstyle.dynamics.benchmark import BENCHMARK_COLUMNS, benchmark_dynamics


def rows_of(body, functions):
    return benchmark_dynamics(body, functions, functions, frames=20, rounds=2, seed=3)


def test_without_compiler_or_pinocchio_rows_say_so(functions, plain_body, monkeypatch):
    real = importlib.import_module

    def without(name):
        if name == "pinocchio":
            raise ImportError(name)
        return real(name)

    monkeypatch.setattr(benchmark.importlib, "import_module", without)
    rows = rows_of(plain_body, functions)
    assert all(set(row) <= set(BENCHMARK_COLUMNS) for row in rows)
    by_name = {(r["quantity"], r["implementation"]): r for r in rows}
    assert len(by_name) == 6
    for quantity in ("forces", "forces and Jacobians"):
        assert "not installed" in by_name[quantity, "pinocchio"]["reason"]
        assert "no C compiler" in by_name[quantity, "generated C"]["reason"]
        machine = by_name[quantity, "virtual machine"]
        assert machine["status"] == "ok"
        assert machine["microseconds_per_frame"] > 0
        assert machine["ratio_to_pinocchio"] == ""


def test_with_pinocchio_there_are_ratios(functions, plain_body):
    pytest.importorskip("pinocchio")
    rows = {(r["quantity"], r["implementation"]): r for r in rows_of(plain_body, functions)}
    assert rows["forces", "pinocchio"]["ratio_to_pinocchio"] == 1
    assert rows["forces and Jacobians", "virtual machine"]["ratio_to_pinocchio"] > 0
