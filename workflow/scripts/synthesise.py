"""Synthesise one motion of least energy, or record why it cannot be."""

from pathlib import Path

from motionstyle.dynamics.compiled import load_compiled
from motionstyle.errors import MotionStyleError
from motionstyle.files import write_json
from motionstyle.jobs import job
from motionstyle.motion.storage import load_motion, save_failure, save_motion
from motionstyle.spacetime.style import load_style
from motionstyle.spacetime.synthesis import synthesise
from motionstyle.spacetime.synthesis_plan import example_window, load_plan
from motionstyle.spacetime.synthesis_sheet import read_row

with job(snakemake.log[0]):
    output, inputs = snakemake.output, snakemake.input
    row = read_row(snakemake.params.sheet, snakemake.wildcards.synthesis)
    try:
        example = example_window(load_motion(inputs.example), row)
        plan = load_plan(row, example, inputs.table, inputs.status)
        functions = load_compiled(inputs.code, inputs.second_order)
        found = synthesise(row, plan, load_style(Path(inputs.style)), functions)
        if found.motion is None:
            raise MotionStyleError(f"the solver broke down: {found.report['reason']}")
    except MotionStyleError as error:
        print(f"failed: {error}")
        save_failure(output.motion, row.id, "nio", str(error), example=row.example)
        write_json(output.report, {"status": "failed", "reason": str(error)})
        write_json(output.diagnosis, {"status": "failed", "reason": str(error)})
    else:
        save_motion(output.motion, found.motion)
        write_json(output.report, {**found.report, "trace": found.trace})
        write_json(output.diagnosis, found.diagnosis)
