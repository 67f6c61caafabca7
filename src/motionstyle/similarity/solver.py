"""The one door to nonlinear programs: solve, check the status, and say what failed and where.

CasADi returns a point whether or not the solver succeeded; nothing here takes it unchecked.
"""

from __future__ import annotations

from dataclasses import dataclass
from time import process_time

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError
from motionstyle.similarity.blocks import Program

Array = NDArray[np.float64]
SOLVED = {"Solve_Succeeded": "converged", "Solved_To_Acceptable_Level": "acceptable"}
FEASIBLE = 1e-4


@dataclass(frozen=True)
class Solution:
    """The solver's last point and what is known of it.

    Attributes
    ----------
    x : variables. status : `converged`, `acceptable`, or the solver's own word for its failure.
    iterations, seconds : spent, the latter of the processor, whatever else the machine does.
    violation : largest violation of a constraint.
    worst : the block that constraint is of. diagnosis : one sentence, empty if solved.
    costs : each block's share of the objective.
    """

    x: Array
    status: str
    iterations: int
    seconds: float
    violation: float
    worst: str
    diagnosis: str
    costs: dict[str, float]

    @property
    def solved(self) -> bool:
        """Whether the solver met its tolerances."""
        return self.status in SOLVED.values()


def solve(
    program: Program,
    start: Array,
    lower: Array,
    upper: Array,
    *,
    max_iterations: int,
    time_limit_s: float,
) -> Solution:
    """Solve a program with IPOPT and return its last point with a checked status.

    Raises
    ------
    MotionStyleError
        If the start is not a number, or bounds contradict each other.
    """
    if not np.isfinite(start).all():
        place = int(np.argmin(np.isfinite(start)))
        raise MotionStyleError(f"the start of the program is not a number at variable {place}")
    if (lower > upper).any():
        raise MotionStyleError(
            f"bounds of variable {int(np.argmax(lower > upper))} contradict each other"
        )
    options = {
        "ipopt": {
            "print_level": 0,
            "sb": "yes",
            "max_iter": max_iterations,
            "max_wall_time": float(time_limit_s),
            # The objective is counted in squared standard deviations, thousands are usual. One
            # unit of the scaled gradient left is a foot that is 0.4 mm from its best place
            # (contact weight 10, 2 mm), far below what is measured.
            "obj_scaling_factor": 1e-3,
            "tol": 1e-1,
            "constr_viol_tol": 1e-6,
            "acceptable_tol": 1.0,
            "acceptable_constr_viol_tol": 1e-5,
            "acceptable_compl_inf_tol": 1e-2,
            "acceptable_iter": 3,
            "acceptable_obj_change_tol": 1e-3,
            "linear_solver": "mumps",
            "mu_strategy": "adaptive",
            "nlp_scaling_method": "none",
            "bound_relax_factor": 0.0,
        },
        "print_time": False,
        **program.options,
    }
    began = process_time()
    solver = ca.nlpsol("adaptation", "ipopt", program.nlp, options)
    found = solver(x0=start, lbx=lower, ubx=upper, lbg=program.lower, ubg=program.upper)
    seconds = process_time() - began
    stats = solver.stats()
    x, g = np.array(found["x"]).ravel(), np.array(found["g"]).ravel()
    raw = str(stats["return_status"])
    status = SOLVED.get(raw, raw)
    excess = np.maximum(program.lower - g, g - program.upper)
    excess = np.where(np.isfinite(excess), excess, np.inf)
    row = int(np.argmax(excess)) if len(excess) else 0
    violation = max(0.0, float(excess[row])) if len(excess) else 0.0
    worst = program.constraint_names[row] if len(excess) else ""
    if status in SOLVED.values() and not (np.isfinite(x).all() and violation < FEASIBLE):
        status = "Claimed_Success_But_Infeasible"
    costs = dict.fromkeys(program.term_names, 0.0)
    if np.isfinite(x).all():
        values = np.array(program.terms(x)).ravel()
        for name, value in zip(program.term_names, values, strict=True):
            costs[name] += float(value)
    diagnosis = ""
    if status not in SOLVED.values():
        largest = max(costs, key=lambda name: costs[name]) if costs else "nothing"
        diagnosis = (
            f"IPOPT ended with {raw} after {stats['iter_count']} iterations; the largest violation "
            f"({violation:.2g}) is of '{worst}', the largest cost is '{largest}'"
        )
    return Solution(
        x, status, int(stats["iter_count"]), seconds, violation, worst, diagnosis, costs
    )
