"""Put numbers on the schematic figures, and try seeds and schedules."""

from motionstyle.evaluation.style_machines.runs import run_checks
from motionstyle.evaluation.style_machines.store import load_by_id, save_outcome
from motionstyle.jobs import job

with job(snakemake.log[0]):
    inputs, output, params = snakemake.input, snakemake.output, snakemake.params
    found = run_checks(params.plan, load_by_id(inputs.motions), params.config)
    tables = {name: output[name] for name in ("shmm_figure_checks", "shmm_sensitivity")}
    save_outcome(found, tables=tables, arrays=output.arrays)
