"""Learn known stylistic models again."""

from motionstyle.evaluation.style_machines.runs import COLUMNS, run_twins
from motionstyle.jobs import job
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    rows = run_twins(snakemake.params.plan, snakemake.params.config)
    write_table(snakemake.output.table, COLUMNS["shmm_twin"], rows)
