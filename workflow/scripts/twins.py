"""Make a motion with a random style and recover it from elsewhere, or record why not."""

from pathlib import Path

from motionstyle.dynamics.compiled import load_compiled
from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.spacetime.twins import TEST, twin_rows
from motionstyle.files import write_json
from motionstyle.jobs import job
from motionstyle.motion.storage import load_motion, save_failure, save_motion
from motionstyle.spacetime.made_styles import random_style
from motionstyle.spacetime.solver_point import SolverSettings
from motionstyle.spacetime.style import load_style, save_style
from motionstyle.spacetime.synthesis_plan import example_window, load_plan
from motionstyle.spacetime.synthesis_sheet import read_row

with job(snakemake.log[0]):
    inputs, output, twins = snakemake.input, snakemake.output, snakemake.params.twins
    seed = int(snakemake.wildcards.seed)
    row = read_row(snakemake.params.sheet, twins["problem"])
    style = random_style(load_style(Path(inputs.style)), seed)
    save_style(Path(output.style), style)
    try:
        example = example_window(load_motion(inputs.example), row)
        plan = load_plan(row, example, inputs.table, inputs.status)
        functions = load_compiled(inputs.code, inputs.second_order)
        settings = SolverSettings(iterations=twins["iterations"])
        motion, rows = twin_rows(row, plan, style, functions, twins["starts"], settings)
    except MotionStyleError as error:
        print(f"failed: {error}")
        save_failure(output.motion, f"{row.id}_twin{seed}", "planted", str(error))
        failed = {"test": TEST, "part": 1, "problem": row.id, "seed": seed}
        rows = [{**failed, "status": "failed", "reason": str(error)}]
    else:
        save_motion(output.motion, motion)
    write_json(Path(output.rows), {"rows": rows})
