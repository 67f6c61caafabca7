"""Solve the learning problem of one motion under one choice of the problem."""

from pathlib import Path

from motionstyle.dynamics.compiled import load_compiled
from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.spacetime.landscape import landscape
from motionstyle.evaluation.spacetime.sensitivity import BASE, solve_choice
from motionstyle.files import write_json
from motionstyle.jobs import job
from motionstyle.motion.storage import load_motion
from motionstyle.nio.learning_problem import learning_problem
from motionstyle.spacetime.solver_point import SolverSettings

with job(snakemake.log[0]):
    inputs, study = snakemake.input, snakemake.params.study
    choice = snakemake.wildcards.choice
    found = {"landscape": {}}
    try:
        motion = load_motion(inputs.motion).window(study["first_frame"], study["last_frame"])
        functions = load_compiled(inputs.code, inputs.second_order)
        learning = learning_problem(motion, functions)
        settings = SolverSettings(iterations=study["iterations"])
        solved = solve_choice(learning, choice, settings)
    except MotionStyleError as error:
        print(f"failed: {error}")
        failed = {"motion": study["clip"], "choice": choice, "status": "failed"}
        found["rows"] = [{**failed, "reason": str(error)}]
    else:
        found["rows"] = [solved.row]
        if choice == BASE:
            found["landscape"] = landscape(solved.problem, solved.target, solved.optimum)
    write_json(Path(snakemake.output.rows), found)
