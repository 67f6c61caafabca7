"""Copy an example along new footprints, and warp the copy until its feet meet them."""

from motionstyle.errors import MotionStyleError
from motionstyle.files import write_json
from motionstyle.jobs import job
from motionstyle.motion.storage import load_motion, save_failure, save_motion
from motionstyle.spacetime.synthesis_plan import example_window, load_plan
from motionstyle.spacetime.synthesis_sheet import read_row
from motionstyle.spacetime.warping import warp

with job(snakemake.log[0]):
    output, inputs = snakemake.output, snakemake.input
    row = read_row(snakemake.params.sheet, snakemake.wildcards.synthesis)
    try:
        example = example_window(load_motion(inputs.example), row)
        plan = load_plan(row, example, inputs.table, inputs.status)
        found = warp(plan.start, plan.feet, plan.ranges)
    except MotionStyleError as error:
        print(f"failed: {error}")
        save_failure(output.warped, row.id, "warp", str(error), example=row.example)
        save_failure(output.copied, f"{row.id}_copied", "warp", str(error), example=row.example)
        write_json(output.report, {"status": "failed", "reason": str(error)})
    else:
        save_motion(output.warped, found.motion)
        save_motion(output.copied, plan.copied)
        write_json(output.report, found.report)
