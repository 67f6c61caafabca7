"""Gather one row per physical motion."""

from motionstyle.evaluation.physical import PHYSICAL_COLUMNS, physical_row
from motionstyle.files import read_json
from motionstyle.jobs import job
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    rows = [physical_row(read_json(f), snakemake.params.config) for f in snakemake.input.reports]
    write_table(snakemake.output.table, PHYSICAL_COLUMNS, rows)
