"""How long inverse dynamics with its Jacobians takes, against pinocchio in the same run.

Contenders take turns, round after round, so that a busy machine slows all of them alike; the
table gives the median of the rounds and the ratio to pinocchio of the same round.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.body import Body
from motionstyle.dynamics.codegen import FrameFunction
from motionstyle.dynamics.referee import pinocchio_model, pinocchio_state
from motionstyle.dynamics.symbols import parameter_vector

Array = NDArray[np.float64]
BENCHMARK_COLUMNS = (
    *("quantity", "implementation", "microseconds_per_frame", "fastest_microseconds_per_frame"),
    *("ratio_to_pinocchio", "frames", "rounds", "status", "reason"),
)
QUANTITIES = {"forces": "forces", "forces_and_slopes": "forces and Jacobians"}
SLOW_SHARE = 20  # the virtual machine gets this many times fewer frames


def random_states(frames: int, seed: int) -> list[Array]:
    """Return q, q̇, q̈ (F, 35) and contact forces (F, 24) of the size that gait has."""
    rng = np.random.default_rng(seed)
    sizes = ((35, 0.5), (35, 2.0), (35, 8.0), (24, 150.0))
    return [rng.standard_normal((frames, n)) * size for n, size in sizes]


def _pinocchio_runs(body: Body, states: list[Array]) -> dict[str, Callable[[], None]] | str:
    """Return pinocchio's runs by quantity, or why there are none."""
    try:
        pin = importlib.import_module("pinocchio")
    except ImportError:
        return "pinocchio (package pin, of requirements-test.lock) is not installed"
    model, _last = pinocchio_model(pin, body)
    data = model.createData()
    given = [pinocchio_state(pin, *frame)[:3] for frame in zip(*states[:3], strict=True)]

    def forces() -> None:
        for place, rate, second in given:
            pin.rnea(model, data, place, rate, second)

    def slopes() -> None:
        for place, rate, second in given:
            pin.computeRNEADerivatives(model, data, place, rate, second)

    return {"forces": forces, "forces_and_slopes": slopes}


def benchmark_dynamics(
    body: Body,
    compiled: Mapping[str, FrameFunction],
    interpreted: Mapping[str, FrameFunction],
    *,
    frames: int,
    rounds: int,
    seed: int,
) -> list[dict[str, object]]:
    """Return a row with `BENCHMARK_COLUMNS` per quantity and implementation.

    Ours gives τ and its derivatives by q, q̇, q̈ and the contact forces, through the exponential
    maps' chain rule; pinocchio's, called frame by frame from Python, those by configuration,
    velocity and acceleration in its own coordinates, without contact forces.

    Parameters
    ----------
    compiled, interpreted : from `codegen.load_functions`, with and without a library.
    """
    states, parameters = random_states(frames, seed), parameter_vector(body)
    fewer = max(1, frames // SLOW_SHARE)
    pinocchio = _pinocchio_runs(body, states)
    rows: list[dict[str, object]] = []
    for name, quantity in QUANTITIES.items():
        runs: dict[str, tuple[int, Callable[[], object]]] = {}
        missing = {}
        if compiled[name].loop is None:
            missing["generated C"] = "there is no C compiler, so the virtual machine serves"
        else:
            runs["generated C"] = (frames, lambda f=compiled[name]: f(*states, parameters))
        few = [state[:fewer] for state in states]
        machine = interpreted[name]
        runs["virtual machine"] = (fewer, lambda f=machine, x=few: f(*x, parameters))
        if isinstance(pinocchio, str):
            missing["pinocchio"] = pinocchio
        else:
            runs["pinocchio"] = (frames, pinocchio[name])
        times = _alternate(runs, rounds)
        for who in ("generated C", "virtual machine", "pinocchio"):
            row: dict[str, object] = {"quantity": quantity, "implementation": who}
            if who in missing:
                rows.append({**row, "status": "n/a", "reason": missing[who]})
                continue
            ratio = np.median(times[who] / times["pinocchio"]) if "pinocchio" in times else ""
            rows.append(
                row
                | {
                    "microseconds_per_frame": float(np.median(times[who])),
                    "fastest_microseconds_per_frame": float(times[who].min()),
                    "ratio_to_pinocchio": ratio,
                    "frames": runs[who][0],
                    "rounds": rounds,
                    "status": "ok",
                }
            )
    return rows


def _alternate(
    runs: Mapping[str, tuple[int, Callable[[], object]]], rounds: int
) -> dict[str, Array]:
    """Return microseconds per frame by name, (rounds,), after one run that is not counted."""
    times: dict[str, list[float]] = {name: [] for name in runs}
    for turn in range(rounds + 1):
        for name, (frames, run) in runs.items():
            started = perf_counter()
            run()
            if turn:
                times[name].append(1e6 * (perf_counter() - started) / frames)
    return {name: np.array(values) for name, values in times.items()}
