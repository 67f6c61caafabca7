"""Gather the rows of all synthesised motions."""

from motionstyle.evaluation.style_machines.synthesis import SYNTHESIS_COLUMNS
from motionstyle.files import read_json
from motionstyle.jobs import job
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    rows = [row for file in snakemake.input.rows for row in read_json(file)]
    write_table(snakemake.output.table, SYNTHESIS_COLUMNS, rows)
