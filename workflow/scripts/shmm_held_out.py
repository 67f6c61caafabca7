"""Try models on unseen takes, and find the styles of those."""

from motionstyle.evaluation.style_machines.runs import run_held_out
from motionstyle.evaluation.style_machines.store import load_by_id, save_outcome
from motionstyle.jobs import job

with job(snakemake.log[0]):
    inputs, params = snakemake.input, snakemake.params
    found = run_held_out(params.plan, load_by_id(inputs.motions), params.config)
    save_outcome(found, tables={"held_out": snakemake.output.held_out})
