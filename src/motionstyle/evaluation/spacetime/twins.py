"""Known truth, part 1: motions made with known styles, recovered from elsewhere.

X* is the synthesis of a problem with a random style θ*. It stands in for a captured motion: the
same problem is solved with θ* from smooth perturbations of X* and from the paper's start (§7),
X* copied along its own footprints with its root on the spline. A solver that finds one optimum
gives X* back.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from motionstyle.dynamics.codegen import FrameFunction
from motionstyle.errors import MotionStyleError
from motionstyle.motion.difference import joint_rms_deg
from motionstyle.motion.motion import Motion
from motionstyle.spacetime.edits import into_ranges
from motionstyle.spacetime.solver_point import SolverSettings
from motionstyle.spacetime.starts import copied_along, perturbed
from motionstyle.spacetime.style import Style
from motionstyle.spacetime.synthesis import synthesise
from motionstyle.spacetime.synthesis_plan import Plan
from motionstyle.spacetime.synthesis_sheet import SynthesisRow

# Perturbed starts are the ledger's; what else recovers X* is named apart.
TEST, TEST_PAPER = "twin_motion", "twin_motion_paper_start"


def start_near(target: Motion, plan: Plan, name: str) -> Motion:
    """Return a start by name: `perturbed_N` (10° rms, smooth, seed N), or `paper` (§7).

    Raises
    ------
    MotionStyleError
        If the name is neither.
    """
    kind, _, seed = name.partition("_")
    if name == "paper":
        start = copied_along(
            replace(target, rebranched=()), plan.footprints, target.frames, target.rate_hz,
            id=f"{target.id}_paper", body=plan.body, on_the_way=True,
        )  # fmt: skip
    elif kind == "perturbed" and seed.isdigit():
        start = perturbed(target, int(seed))
    else:
        raise MotionStyleError(f"start '{name}' is unknown; use paper or perturbed_1, _2, …")
    return replace(start, coordinates=into_ranges(start.coordinates, plan.ranges))


def twin_rows(
    row: SynthesisRow,
    plan: Plan,
    style: Style,
    functions: Mapping[str, FrameFunction],
    starts: Sequence[str],
    settings: SolverSettings,
    log: Callable[[str], None] = print,
) -> tuple[Motion, list[dict[str, Any]]]:
    """Return X* of a style θ* and one row per start of `tables/known_truth.csv`.

    `E_gap_to_best_pct` is above the best E of X* and all recoveries.

    Raises
    ------
    MotionStyleError
        If the solver breaks down before there is an X*.
    """
    made = synthesise(row, plan, style, functions, settings=settings, log=log)
    if made.motion is None:
        raise MotionStyleError(f"twin of {row.id}: no X*, {made.report['reason']}")
    target, seed = made.motion, style.about.get("seed")
    rows = []
    for name in starts:
        start = start_near(target, plan, name)
        found = synthesise(row, plan, style, functions, settings=settings, start=start, log=log)
        rows.append(
            {
                "test": TEST_PAPER if name == "paper" else TEST,
                "part": 1,
                "problem": row.id,
                "seed": seed,
                "start": name,
                "start_rms_deg": joint_rms_deg(start.coordinates, target.coordinates),
                "target_status": made.report["status"],
                "target_E": made.report["E"],
                **{k: found.report.get(k) for k in ("status", "E", "optimality", "iterations")},
                "seconds": found.report["seconds"],
                "joint_rms_deg": (
                    joint_rms_deg(found.motion.coordinates, target.coordinates)
                    if found.motion
                    else None
                ),
            }
        )
        log(f"{row.id} θ*{seed} from {name}: {rows[-1]['status']}, {rows[-1]['joint_rms_deg']}")
    energies = [made.report["E"], *(one["E"] for one in rows if one["E"] is not None)]
    for one in rows:
        if one["E"] is not None:
            one["E_gap_to_best_pct"] = 100 * (one["E"] / min(energies) - 1)
    provenance = {**target.provenance, "planted": f"synthesised with θ* of seed {seed}"}
    target = replace(target, id=f"{row.id}_twin{seed}", kind="planted", provenance=provenance)
    return target, rows
