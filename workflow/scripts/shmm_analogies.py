"""Answer analogies whose answers were captured or planted."""

from motionstyle.evaluation.style_machines.runs import run_analogies
from motionstyle.evaluation.style_machines.store import load_by_id, save_outcome
from motionstyle.jobs import job

with job(snakemake.log[0]):
    inputs, params = snakemake.input, snakemake.params
    found = run_analogies(params.plan, load_by_id(inputs.motions), params.config)
    save_outcome(found, tables={"analogies": snakemake.output.analogies})
