"""Gather what each choice of the learning problem does."""

from pathlib import Path

from motionstyle.evaluation.spacetime.sensitivity import COLUMNS
from motionstyle.files import read_json
from motionstyle.jobs import job
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    rows = [row for file in snakemake.input.rows for row in read_json(Path(file))["rows"]]
    config = {"config": snakemake.params.config}
    write_table(snakemake.output.table, COLUMNS, [config | row for row in rows])
