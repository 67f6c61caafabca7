"""Measure one synthesis and its baselines: rows of the table of syntheses."""

from motionstyle.evaluation.synthesis_rows import synthesis_rows
from motionstyle.files import read_json, write_json
from motionstyle.jobs import job
from motionstyle.motion.storage import load_available, load_motion
from motionstyle.spacetime.synthesis_plan import example_window, load_plan
from motionstyle.spacetime.synthesis_sheet import read_row

with job(snakemake.log[0]):
    inputs = snakemake.input
    row = read_row(snakemake.params.sheet, snakemake.wildcards.synthesis)
    reports = {
        "nio": read_json(inputs.nio_report),
        "warp": read_json(inputs.warp_report),
    }
    made = {}
    plan = captured = None
    own = next(iter(load_available([inputs.own], allow_none=True)), None)
    others = load_available(inputs.others, allow_none=True)
    if read_json(inputs.status)["status"] == "ok":
        example = example_window(load_motion(inputs.example), row)
        plan = load_plan(row, example, inputs.table, inputs.status)
        for kind in ("nio", "warp", "copied"):
            for motion in load_available([inputs[kind]], allow_none=True):
                made[kind] = motion
        captured = example if row.footprint_clip else None
        if "source" in dict(inputs.items()):
            captured = load_motion(inputs.source)
    rows = synthesis_rows(
        row, plan, made, reports, snakemake.params.config, own=own, others=others, captured=captured
    )
    write_json(snakemake.output.rows, rows)
