"""Solve one problem by every design from every start, or record why it cannot be."""

from pathlib import Path

from motionstyle.dynamics.compiled import load_compiled
from motionstyle.errors import MotionStyleError
from motionstyle.files import write_json
from motionstyle.jobs import job
from motionstyle.motion.storage import load_motion
from motionstyle.spacetime.comparison import compare_designs, starts_of
from motionstyle.spacetime.style import load_style
from motionstyle.spacetime.synthesis import spacetime_problem
from motionstyle.spacetime.synthesis_plan import example_window, load_plan
from motionstyle.spacetime.synthesis_sheet import read_row

with job(snakemake.log[0]):
    inputs, comparison = snakemake.input, snakemake.params.comparison
    row = read_row(snakemake.params.sheet, snakemake.wildcards.synthesis)
    designs = {
        design: names
        for design, names in comparison["designs"].items()
        if design != "ipopt" or row.id in comparison["refereed"]
    }
    try:
        example = example_window(load_motion(inputs.example), row)
        plan = load_plan(row, example, inputs.table, inputs.status)
        functions = load_compiled(inputs.code, inputs.second_order)
        problem = spacetime_problem(row, plan, load_style(Path(inputs.style)), functions)
        starts = starts_of(plan.start, [name for names in designs.values() for name in names])
        limits = {name: comparison[name] for name in ("iterations", "seconds")}
        found = compare_designs(problem, starts, designs, **limits)
    except MotionStyleError as error:
        print(f"failed: {error}")
        found = {"rows": [{"design": "", "start": "", "status": "failed", "reason": str(error)}]}
        found["traces"] = []
    for one in found["rows"]:
        one.update(problem=row.id, task=row.task)
    write_json(Path(snakemake.output.rows), found)
