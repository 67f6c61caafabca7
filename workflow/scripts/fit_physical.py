"""Fit one kinematic motion to Newton, or record why it cannot be."""

from pathlib import Path

from motionstyle.dynamics.codegen import load_functions
from motionstyle.dynamics.functions import dynamics_functions
from motionstyle.errors import MotionStyleError
from motionstyle.files import write_json
from motionstyle.jobs import job
from motionstyle.motion.storage import load_motion, save_failure, save_motion
from motionstyle.spacetime.physical import fit_physical, prepare, settings_from

with job(snakemake.log[0]):
    output, physical = snakemake.output, snakemake.params.physical
    id = snakemake.wildcards.clip
    try:
        motion = prepare(load_motion(snakemake.input.motion), physical)
        functions = load_functions(dynamics_functions, Path(snakemake.input.code))
        found = fit_physical(motion, functions, settings_from(physical))
    except MotionStyleError as error:
        print(f"failed: {error}")
        save_failure(output.motion, f"{id}_physical", "captured", str(error), example=id)
        write_json(output.report, {"id": id, "status": "failed", "reason": str(error)})
    else:
        save_motion(output.motion, found.motion)
        used = "nio" in motion.provenance["experiments"]
        write_json(output.report, {"id": id, "used_by_nio": used, **found.report})
