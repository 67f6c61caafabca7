"""Gather the rows of all tests whose answer was known beforehand."""

from motionstyle.evaluation.spacetime.known_truth import KNOWN_TRUTH_COLUMNS, known_truth_rows
from motionstyle.jobs import job
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    rows = known_truth_rows(snakemake.input.rows, snakemake.params.config)
    write_table(snakemake.output.table, KNOWN_TRUTH_COLUMNS, rows)
