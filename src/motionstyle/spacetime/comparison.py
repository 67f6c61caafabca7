"""Hold solver designs against each other on the same problems from the same starts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError
from motionstyle.motion.difference import joint_rms_deg
from motionstyle.motion.motion import Motion
from motionstyle.spacetime.continuation import solve_spacetime
from motionstyle.spacetime.ipopt_referee import IpoptReferee
from motionstyle.spacetime.solver_point import SolverSettings
from motionstyle.spacetime.spacetime_problem import Evaluator, SpacetimeProblem
from motionstyle.spacetime.starts import perturbed

Array = NDArray[np.float64]
SAME_BASIN = 0.01  # share of E within which two optima count as one
COLUMNS = (
    *("problem", "task", "frames", "design", "start", "status", "E", "above_best_pct"),
    "within_1_pct",
    *("optimality", "foot_error_mm", "root_share_of_E_pct", "iterations", "seconds"),
    *("ms_per_iteration", "joint_rms_from_best_deg"),
)


def starts_of(motion: Motion, names: Sequence[str]) -> dict[str, Motion]:
    """Return starts by name: `paper` (§7), or `perturbed_N` (10° rms, smooth, seed N)."""
    found = {}
    for name in names:
        kind, _, seed = name.partition("_")
        if name == "paper":
            found[name] = motion
        elif kind == "perturbed" and seed.isdigit():
            found[name] = perturbed(motion, int(seed))
        else:
            raise MotionStyleError(f"start '{name}' is unknown; use paper or perturbed_1, _2, …")
    return found


def compare_designs(
    problem: SpacetimeProblem,
    starts: Mapping[str, Motion],
    designs: Mapping[str, Sequence[str]],
    iterations: int,
    seconds: float = SolverSettings.seconds,
    log: Callable[[str], None] = print,
) -> dict[str, list[dict[str, Any]]]:
    """Return `rows`, one per design and start, measured by the best E of all, and `traces`.

    Parameters
    ----------
    designs : starts by design: `structured` is our interior-point method, through gentler
        springs first; `ipopt` solves the lifted problem at once.
    iterations, seconds : limits of one solve.

    A row is `within_1_pct` if its solve converged and its E is at most 1 % above the best one.
    """
    evaluator = Evaluator(problem)
    rows, traces, coordinates = [], [], []
    for design, names in designs.items():
        for name in names:
            controls = problem.basis().fit(starts[name].coordinates)
            if design == "structured":
                settings = SolverSettings(iterations=iterations, seconds=seconds)
                found = solve_spacetime(problem, controls, settings=settings)
                end, forces = found.point.controls, found.coefficients
                status, optimality = found.status, found.optimality
                steps = [{"seconds": t.seconds, "E": t.energy} for t in found.trace]
                traces.append({"design": design, "start": name, "status": status, "steps": steps})
            elif design == "ipopt":
                referee = IpoptReferee(evaluator, max_iter=iterations, max_wall_time=seconds)
                found = referee.solve(controls)
                end, forces = found.controls, found.coefficients
                converged = found.status == "Solve_Succeeded"
                status, optimality = "converged" if converged else found.status, found.optimality
            else:
                raise MotionStyleError(f"solver design '{design}' is unknown")
            values = evaluator.values(end, forces)
            feet = np.abs(values.foot_residuals) / np.sqrt(problem.settings.foot_weight)
            root = float((values.residuals[:, :6] ** 2).sum())
            rows.append(
                {
                    "design": design,
                    "start": name,
                    "status": status,
                    "E": values.energy,
                    "optimality": optimality,
                    "foot_error_mm": 1000 * float(feet.max()),
                    "root_share_of_E_pct": 100 * root / values.energy,
                    "iterations": found.iterations,
                    "seconds": found.seconds,
                    "ms_per_iteration": 1000 * found.seconds / max(1, found.iterations),
                    "frames": problem.frames,
                }
            )
            coordinates.append(values.coordinates)
            log(f"{design} from {name}: {status}, E {values.energy:.4f}, {found.seconds:.1f} s")
    converged = [row["E"] for row in rows if row["status"] == "converged"]
    best = min(converged or [row["E"] for row in rows])
    at = next(k for k, row in enumerate(rows) if row["E"] == best)
    for row, q in zip(rows, coordinates, strict=True):
        row["within_1_pct"] = row["status"] == "converged" and row["E"] <= (1 + SAME_BASIN) * best
        row["above_best_pct"] = 100 * (row["E"] / best - 1)
        row["joint_rms_from_best_deg"] = joint_rms_deg(q, coordinates[at])
    return {"rows": rows, "traces": traces}


def basin_share(rows: Sequence[Mapping[str, Any]]) -> float:
    """Return the share of converged solves whose E is within 1 % of their problem's best."""
    done = [row for row in rows if row["status"] == "converged"]
    near = [row for row in done if float(row["above_best_pct"]) <= 100 * SAME_BASIN]
    return len(near) / len(done) if done else float("nan")
