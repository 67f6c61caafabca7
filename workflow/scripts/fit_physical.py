"""Fit one kinematic motion to Newton, or record why it cannot be."""

from pathlib import Path

from motionstyle.dynamics.codegen import load_functions
from motionstyle.dynamics.functions import dynamics_functions
from motionstyle.errors import MotionStyleError
from motionstyle.files import write_json
from motionstyle.jobs import job
from motionstyle.mocap.settings import of_action
from motionstyle.motion.markers import load_markers
from motionstyle.motion.storage import load_motion, save_failure, save_motion
from motionstyle.spacetime.physical import fit_physical, prepare, prepare_markers
from motionstyle.spacetime.physical_problem import settings_from

with job(snakemake.log[0]):
    given, output, physical = snakemake.input, snakemake.output, snakemake.params.physical
    id = snakemake.wildcards.clip
    try:
        motion = load_motion(given.motion)
        physical = of_action(physical, motion.provenance.get("action", ""))
        motion = prepare(motion, physical)
        markers = prepare_markers(load_markers(given.markers), motion)
        functions = load_functions(dynamics_functions, Path(given.code))
        found = fit_physical(motion, functions, settings_from(physical), markers=markers)
        if found.motion is None:
            raise MotionStyleError(f"the physics fit broke down: {found.report['reason']}")
    except MotionStyleError as error:
        print(f"failed: {error}")
        save_failure(output.motion, f"{id}_physical", "captured", str(error), example=id)
        write_json(output.report, {"id": id, "status": "failed", "reason": str(error)})
        write_json(output.diagnosis, {"id": id, "status": "failed", "reason": str(error)})
    else:
        save_motion(output.motion, found.motion)
        used = "nio" in motion.provenance["experiments"]
        write_json(output.report, {"id": id, "used_by_nio": used, **found.report})
        write_json(output.diagnosis, {"id": id, **found.diagnosis})
