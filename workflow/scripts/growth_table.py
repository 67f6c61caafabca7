"""Gather how the solver grows with the length of the motion."""

from pathlib import Path

from motionstyle.evaluation.spacetime.growth import COLUMNS, with_exponents
from motionstyle.files import read_json
from motionstyle.jobs import job
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    rows = [row for file in snakemake.input.rows for row in read_json(Path(file))["rows"]]
    config = {"config": snakemake.params.config}
    write_table(snakemake.output.table, COLUMNS, [config | row for row in with_exponents(rows)])
