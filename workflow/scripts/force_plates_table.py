"""Gather the comparison of all clips with their force plates."""

from motionstyle.evaluation.force_plates import FORCE_PLATE_COLUMNS
from motionstyle.files import read_json
from motionstyle.jobs import job
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    rows = [row for file in snakemake.input.rows for row in read_json(file)["rows"]]
    write_table(snakemake.output.table, FORCE_PLATE_COLUMNS, rows)
