"""Gather the converged final solves of all styles and ablations."""

from pathlib import Path

from motionstyle.evaluation.nio.learning_table import RESYNTHESIS_COLUMNS, resynthesis_rows
from motionstyle.files import read_json
from motionstyle.jobs import job
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    judged = [read_json(Path(file)) for file in snakemake.input.judged]
    rows = resynthesis_rows(judged, snakemake.params.config)
    write_table(snakemake.output.table, RESYNTHESIS_COLUMNS, rows)
