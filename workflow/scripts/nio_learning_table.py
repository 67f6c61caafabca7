"""Gather every step of every learning, and the converged final solves."""

from pathlib import Path

from motionstyle.evaluation.nio.learning_table import LEARNING_COLUMNS, learning_rows
from motionstyle.files import read_json
from motionstyle.jobs import job
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    learnt = [read_json(Path(file)) for file in snakemake.input.learnt]
    judged = [read_json(Path(file)) for file in snakemake.input.judged]
    rows = learning_rows(learnt, judged, snakemake.params.config)
    write_table(snakemake.output.table, LEARNING_COLUMNS, rows)
