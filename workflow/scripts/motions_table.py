"""Write the index of all motions of the run."""

from motionstyle.jobs import job
from motionstyle.motion.index import MOTION_COLUMNS, index_motions
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    rows = index_motions(snakemake.input.motions, snakemake.params.config)
    write_table(snakemake.output.table, MOTION_COLUMNS, rows)
