"""Learn dance models, dance new choreographies in several styles, and improve a novice."""

from motionstyle.evaluation.style_machines.runs import run_dances
from motionstyle.evaluation.style_machines.store import load_by_id, save_outcome
from motionstyle.jobs import job
from motionstyle.mocap.fitting.floor import StanceThresholds

with job(snakemake.log[0]):
    inputs, output, params = snakemake.input, snakemake.output, snakemake.params
    thresholds = StanceThresholds(**params.contacts)
    found = run_dances(params.plan, load_by_id(inputs.motions), thresholds, params.config)
    tables = {name: output[name] for name in ("dance_model", "novice")}
    save_outcome(
        found, tables=tables, motions=output.motions, rows=output.rows, arrays=output.arrays
    )
