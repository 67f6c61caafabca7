"""Solve the problems whose optima are known in closed form."""

from pathlib import Path

from motionstyle.dynamics.compiled import load_compiled
from motionstyle.evaluation.spacetime.known_optima import COLUMNS, known_optima, known_optimum_row
from motionstyle.evaluation.spacetime.known_truth import optimum_row
from motionstyle.files import write_json
from motionstyle.jobs import job
from motionstyle.motion.storage import load_motion
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    inputs, params = snakemake.input, snakemake.params
    functions = load_compiled(inputs.code, inputs.second_order)
    problems = known_optima(load_motion(inputs.motion).body, functions)
    rows = [known_optimum_row(known, seed=1, log=print) for known in problems]
    write_table(snakemake.output.table, COLUMNS, [{"config": params.config, **row} for row in rows])
    write_json(Path(snakemake.output.rows), {"rows": [optimum_row(row) for row in rows]})
