"""Drive dances by silhouettes and by noisy points."""

from motionstyle.evaluation.style_machines.runs import run_driving
from motionstyle.evaluation.style_machines.store import load_by_id, save_outcome
from motionstyle.jobs import job
from motionstyle.mocap.fitting.floor import StanceThresholds

with job(snakemake.log[0]):
    inputs, output, params = snakemake.input, snakemake.output, snakemake.params
    thresholds = StanceThresholds(**params.contacts)
    found = run_driving(params.plan, load_by_id(inputs.motions), thresholds, params.config)
    tables = {"path_map": output.path_map}
    save_outcome(found, tables=tables, motions=output.motions, arrays=output.arrays)
