"""Times of style machines in one run, one BLAS thread: EM step, dance model, synthesis.

Run it with OMP_NUM_THREADS=1 and OPENBLAS_NUM_THREADS=1 on a quiet machine; times relative to
hmmlearn, the test suite's referee, stand in the same run.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.evaluation.style_machines.dances import dance_machine
from motionstyle.motion.motion import Motion
from motionstyle.shmm.gaussians import estimate, moments
from motionstyle.shmm.inference import expectations, pack
from motionstyle.shmm.machine import MachineSettings
from motionstyle.shmm.model import HiddenMarkovModel, normalised
from motionstyle.shmm.trajectory import PoseStates, most_likely_trajectory

Array = NDArray[np.float64]
BENCHMARK_COLUMNS = ("what", "size", "seconds", "hmmlearn_seconds", "ratio", "goal")
STATES, FRAMES, DIMENSIONS, REPEATS = 75, 6000, 10, 5
LENGTHS = (1000, 3000, 10_000, 30_000, 100_000)
POSE_STATES, POSE_COORDINATES = 75, 36


def best_time(run: Callable[[], object], repeats: int = REPEATS) -> float:
    """Return the least wall-clock time of some runs, s."""
    times = []
    for _ in range(repeats):
        begun = time.perf_counter()
        run()
        times.append(time.perf_counter() - begun)
    return min(times)


def problem() -> tuple[HiddenMarkovModel, Array]:
    """Return a dense model of 75 states and 6 000 frames of 10 features."""
    rng = np.random.default_rng(0)
    x = rng.normal(size=(FRAMES, DIMENSIONS)).cumsum(axis=0) * 0.1
    wide = np.broadcast_to(np.eye(DIMENSIONS) * 0.5, (STATES, DIMENSIONS, DIMENSIONS)).copy()
    transitions = normalised(rng.gamma(0.2, size=(STATES, STATES)) + 1e-6)
    start = np.full(STATES, 1 / STATES)
    return HiddenMarkovModel(start, transitions, x[:: FRAMES // STATES][:STATES], wide), x


def em_step(model: HiddenMarkovModel, sequences: Sequence[Array]) -> HiddenMarkovModel:
    """Return the model after one ordinary EM step with full covariances."""
    packed = pack(sequences)
    found = expectations(model, packed)
    sums = moments(found.occupancy, packed).pooled()
    floor = np.full(model.dimensions, 1e-9)
    best = estimate(sums, packed.centre, floor, model)
    return HiddenMarkovModel(
        normalised(found.occupancy[:, 0].sum(axis=0)),
        normalised(found.transitions.sum(axis=0)),
        best.means,
        best.covariances,
    )


def hmmlearn_step(model: HiddenMarkovModel, sequences: Sequence[Array]) -> float:
    """Return the time of the same step in hmmlearn, s; nan where it is not installed."""
    if find_spec("hmmlearn") is None:
        return float("nan")
    hmm = import_module("hmmlearn.hmm")
    joined, lengths = np.concatenate(list(sequences)), [len(s) for s in sequences]

    def run() -> None:
        referee = hmm.GaussianHMM(
            STATES, "full", implementation="scaling", n_iter=1, init_params="", tol=-np.inf
        )
        referee.startprob_, referee.transmat_ = model.start, model.transitions
        referee.means_, referee.covars_ = model.means, model.covariances
        referee.fit(joined, lengths)

    return best_time(run)


def benchmark_rows(dances: Sequence[Motion], dance: Mapping[str, Any]) -> list[dict[str, object]]:
    """Return one row a measurement."""
    model, x = problem()
    rows: list[dict[str, object]] = []
    for parts in (1, 4):
        sequences = np.split(x, parts)
        ours = best_time(lambda sequences=sequences: em_step(model, sequences))
        theirs = hmmlearn_step(model, sequences)
        size = f"{STATES} states x {FRAMES} frames x {DIMENSIONS}, {parts} sequence(s)"
        rows.append(
            {
                "what": "EM step",
                "size": size,
                "seconds": ours,
                "hmmlearn_seconds": theirs,
                "ratio": theirs / ours,
                "goal": "ratio 10, gate 1",
            }
        )
    if dances:
        settings = MachineSettings.from_config(dance)
        begun = time.process_time()
        _, row = dance_machine(dances, settings, {})
        cpu = time.process_time() - begun
        size = f"{row['states_start']} states x {row['frames']} frames, {row['steps']} steps"
        goal = "20, goal 5"
        rows.append({"what": "dance model", "size": size, "seconds": row["seconds"], "goal": goal})
        rows.append({"what": "dance model, CPU", "size": size, "seconds": cpu, "goal": goal})
    rng = np.random.default_rng(1)
    roots = rng.normal(size=(POSE_STATES, 2 * POSE_COORDINATES, 2 * POSE_COORDINATES))
    covariances = roots @ np.swapaxes(roots, 1, 2) + 0.5 * np.eye(2 * POSE_COORDINATES)
    states = PoseStates(rng.normal(size=(POSE_STATES, 2 * POSE_COORDINATES)), covariances)
    for length in LENGTHS:
        occupancy = np.eye(POSE_STATES)[np.arange(length) // 4 % POSE_STATES]
        seconds = best_time(lambda o=occupancy: most_likely_trajectory(o, states), 1)
        size = f"{length} frames x {POSE_COORDINATES}"
        per_frame = {"ratio": seconds / length * 1e6, "goal": "ratio (µs per frame) constant"}
        rows.append({"what": "synthesis", "size": size, "seconds": seconds, **per_frame})
    return rows
