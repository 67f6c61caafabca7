"""The force at the pelvis of every clip, before and after the physics fit."""

from pathlib import Path

from motionstyle.dynamics.codegen import load_functions
from motionstyle.dynamics.functions import dynamics_functions
from motionstyle.evaluation.root_residual import ROOT_RESIDUAL_COLUMNS, root_residual_row
from motionstyle.files import read_json
from motionstyle.jobs import job
from motionstyle.motion.storage import load_motion
from motionstyle.spacetime.physical import prepare
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    given, params = snakemake.input, snakemake.params
    functions = load_functions(dynamics_functions, Path(given.code))
    rows = []
    for before, after, file in zip(given.kinematic, given.physical, given.reports, strict=True):
        id, report = Path(before).stem, read_json(file)
        if report["status"] == "failed":
            row = {"id": id, "config": params.config}
            rows.append({**row, "status": "failed", "reason": report["reason"]})
            continue
        settings = params.settings[id]
        kinematic = prepare(load_motion(before), settings)
        pair, friction = (kinematic, load_motion(after)), settings["friction"]
        status = report["status"]
        rows.append(root_residual_row(*pair, functions, friction, status, params.config))
    write_table(snakemake.output.table, ROOT_RESIDUAL_COLUMNS, rows)
