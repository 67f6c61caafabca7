"""Hold leakage and SVM score against planted changes of known size."""

from motionstyle.jobs import job
from motionstyle.similarity.bank import load_bank
from motionstyle.similarity.dose import COLUMNS, POINT_COLUMNS, dose_rows
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    bank = load_bank(snakemake.input.bank)
    rows, points = dose_rows(bank, snakemake.params.settings, snakemake.params.config)
    write_table(snakemake.output.table, COLUMNS, rows)
    write_table(snakemake.output.points, POINT_COLUMNS, points)
