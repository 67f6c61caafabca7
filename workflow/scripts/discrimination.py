"""Hold both models against plain distances at three levels of likeness."""

from motionstyle.jobs import job
from motionstyle.similarity.bank import load_bank
from motionstyle.similarity.discrimination import COLUMNS, discrimination_rows
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    bank = load_bank(snakemake.input.bank)
    rows = discrimination_rows(bank, snakemake.params.settings, snakemake.params.config)
    write_table(snakemake.output.table, COLUMNS, rows)
