"""Time the generated dynamics against pinocchio, where it is installed."""

from pathlib import Path

from motionstyle.dynamics.benchmark import BENCHMARK_COLUMNS, benchmark_dynamics
from motionstyle.dynamics.codegen import load_functions
from motionstyle.dynamics.functions import dynamics_functions
from motionstyle.jobs import job
from motionstyle.motion.storage import load_available
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    body = load_available(snakemake.input.motions)[0].body
    both = [load_functions(dynamics_functions, code) for code in (Path(snakemake.input.code), None)]
    rows = benchmark_dynamics(body, *both, **snakemake.params.sizes)
    for row in rows:
        print(row)
    write_table(snakemake.output.table, BENCHMARK_COLUMNS, rows)
