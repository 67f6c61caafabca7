"""Learn style machines of walks and runs, and style them."""

from motionstyle.evaluation.style_machines.runs import run_gaits
from motionstyle.evaluation.style_machines.store import load_by_id, save_outcome
from motionstyle.jobs import job
from motionstyle.mocap.fitting.floor import StanceThresholds

with job(snakemake.log[0]):
    inputs, output, params = snakemake.input, snakemake.output, snakemake.params
    found = run_gaits(
        params.plan,
        load_by_id(inputs.motions),
        params.pool,
        StanceThresholds(**params.contacts),
        params.config,
    )
    tables = {name: output[name] for name in ("explained_variance", "style_dof")}
    save_outcome(
        found, tables=tables, motions=output.motions, rows=output.rows, arrays=output.arrays
    )
