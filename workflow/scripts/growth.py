"""Time the solver on a walk of one length, or record why not."""

from pathlib import Path

from motionstyle.dynamics.compiled import load_compiled
from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.spacetime.growth import growth_row
from motionstyle.files import write_json
from motionstyle.jobs import job
from motionstyle.motion.storage import load_motion
from motionstyle.spacetime.solver_point import SolverSettings
from motionstyle.spacetime.synthesis import initial_style_of

with job(snakemake.log[0]):
    inputs, study = snakemake.input, snakemake.params.study
    frames = int(snakemake.wildcards.frames)
    try:
        stretch = load_motion(inputs.motion).window(study["first_frame"], study["last_frame"])
        functions = load_compiled(inputs.code, inputs.second_order)
        style = initial_style_of(stretch, functions)
        whole = frames <= study["to_the_end"]
        iterations = SolverSettings.iterations if whole else study["iterations"]
        row = growth_row(stretch, style, functions, frames, iterations)
    except MotionStyleError as error:
        print(f"failed: {error}")
        row = {"motion": study["clip"], "frames": frames, "status": "failed"}
        row["reason"] = str(error)
    write_json(Path(snakemake.output.rows), {"rows": [row]})
