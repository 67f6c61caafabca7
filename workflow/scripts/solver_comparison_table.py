"""Gather the rows of all problems."""

from pathlib import Path

from motionstyle.files import read_json
from motionstyle.jobs import job
from motionstyle.spacetime.comparison import COLUMNS
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    rows = [row for file in snakemake.input.rows for row in read_json(Path(file))["rows"]]
    write_table(snakemake.output.table, [*COLUMNS, "reason"], rows)
