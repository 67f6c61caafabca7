"""Lay and check the footprints of one synthesis, or record why no body can follow them."""

from pathlib import Path

from motionstyle.errors import MotionStyleError
from motionstyle.figures.footprints import footprint_figure
from motionstyle.figures.style import blank_figure, save
from motionstyle.files import write_json
from motionstyle.jobs import job
from motionstyle.motion.storage import load_motion
from motionstyle.spacetime.edits import edit_body
from motionstyle.spacetime.footprints import write_footprints
from motionstyle.spacetime.synthesis_plan import example_window, planned_footprints
from motionstyle.spacetime.synthesis_sheet import read_row

with job(snakemake.log[0]):
    output, inputs = snakemake.output, snakemake.input
    row = read_row(snakemake.params.sheet, snakemake.wildcards.synthesis)
    try:
        example = example_window(load_motion(inputs.example), row)
        source = load_motion(inputs.source) if "source" in dict(inputs.items()) else None
        found, frames = planned_footprints(row, example, source)
    except MotionStyleError as error:
        print(f"failed: {error}")
        write_footprints(output.table, [])
        write_json(output.status, {"status": "failed", "reason": str(error)})
        figure = blank_figure(f"{row.id}: these footprints cannot be followed, see the log")
    else:
        write_footprints(output.table, found)
        write_json(output.status, {"status": "ok", "frames": frames, "rate_hz": example.rate_hz})
        body = edit_body(example.body, row.edits)
        figure = footprint_figure(found, body, frames, example.rate_hz, title=row.id)
    save(figure, Path(output.svg).with_suffix(""))
