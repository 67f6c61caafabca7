"""Hold syntheses on ramps against those on the level."""

from pathlib import Path

from motionstyle.dynamics.codegen import load_functions
from motionstyle.dynamics.functions import dynamics_functions
from motionstyle.evaluation.ramps import RAMP_COLUMNS, ramp_row
from motionstyle.jobs import job
from motionstyle.motion.storage import load_available, read_sidecar
from motionstyle.spacetime.synthesis import net_torques
from motionstyle.spacetime.synthesis_sheet import read_syntheses
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    params = snakemake.params
    functions = load_functions(dynamics_functions, Path(snakemake.input.code))
    sheet = {row.id: row for row in read_syntheses(params.sheet)}
    rows = []
    for number, (ramp, level) in enumerate(params.pairs):
        for kind in ("nio", "warp"):
            files = snakemake.input[kind][2 * number : 2 * number + 2]
            found = load_available(files, allow_none=True)
            slope = sheet[ramp].footprints.number("slope_deg")
            states = [read_sidecar(f)["provenance"].get("solver_status", "failed") for f in files]
            status = next((state for state in states if state != "converged"), "converged")
            row = {
                "config": params.config,
                "id": ramp,
                "level_id": level,
                "kind": kind,
                "status": status,
                "mood": sheet[ramp].mood,
                "direction": "up" if slope > 0 else "down",
                "slope_deg": slope,
            }
            if status == "converged":  # the claims are about optima; other rows stay empty
                row["subject"] = found[0].provenance.get("subject")
                row |= ramp_row(*found, slope, lambda m: net_torques(m, functions)[2])
            rows.append(row)
    write_table(snakemake.output.table, RAMP_COLUMNS, rows)
