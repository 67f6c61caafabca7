"""Gather the rows of all adaptation tasks."""

from motionstyle.files import read_json
from motionstyle.jobs import job
from motionstyle.similarity.adaptation import ADAPTATION_COLUMNS
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    rows = [row for report in snakemake.input.reports for row in read_json(report)]
    write_table(snakemake.output.table, ADAPTATION_COLUMNS, rows)
