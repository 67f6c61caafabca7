"""Time style machines against their goals, in one run."""

from motionstyle.evaluation.style_machines.benchmark import BENCHMARK_COLUMNS, benchmark_rows
from motionstyle.evaluation.style_machines.store import load_by_id
from motionstyle.jobs import job
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    dances = list(load_by_id(snakemake.input.motions).values())
    rows = benchmark_rows(dances, snakemake.params.plan["dance"])
    write_table(snakemake.output.table, BENCHMARK_COLUMNS, rows)
