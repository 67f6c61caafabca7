"""Find E along the way from X_T to X_S before and after learning, and time the gradient of G."""

from pathlib import Path

from motionstyle.dynamics.compiled import load_compiled
from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.nio.gradient_cost import gradient_cost
from motionstyle.evaluation.nio.records import load_learning
from motionstyle.evaluation.spacetime.landscape import landscape
from motionstyle.files import write_json
from motionstyle.jobs import job
from motionstyle.motion.storage import load_motion
from motionstyle.nio.styles_sheet import read_style_row
from motionstyle.spacetime.style import load_style

with job(snakemake.log[0]):
    inputs, params = snakemake.input, snakemake.params
    row = read_style_row(params.sheet, params.clip)
    functions = load_compiled(inputs.code, inputs.second_order)
    found = {"style": row.id, "segments": {}, "cost": []}
    try:
        learning = load_learning(row, inputs.motion, functions)
        styles = {"before": learning.start, "after": load_style(Path(inputs.style))}
        for name, style in styles.items():
            problem = learning.problem(style)
            optimum = problem.basis().fit(load_motion(inputs[name]).coordinates)
            found["segments"][name] = landscape(problem, learning.controls, optimum)
        if params.solves > 0:
            found["cost"] = gradient_cost(learning, styles["before"], params.solves)
    except (MotionStyleError, FloatingPointError) as error:
        print(f"failed: {error}")
        found["reason"] = str(error)
    write_json(Path(snakemake.output.found), found)
