"""Export a physical motion's joint moments and ground reactions for OpenSim."""

from pathlib import Path

from motionstyle.dynamics.codegen import load_functions
from motionstyle.dynamics.functions import dynamics_functions
from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.joint_loads import joint_loads
from motionstyle.jobs import job
from motionstyle.motion.opensim_export import (
    ground_reactions,
    write_external_loads,
    write_no_motion,
    write_storage,
)
from motionstyle.motion.storage import load_motion

with job(snakemake.log[0]):
    output = snakemake.output
    write_external_loads(output.loads, Path(output.forces).name)
    try:
        motion = load_motion(snakemake.input.motion)
    except MotionStyleError as error:
        if not snakemake.params.allow_failed:
            raise
        print(f"failed: {error}")
        for file in (output.moments, output.forces):
            write_no_motion(file, str(error))
    else:
        forces, times = ground_reactions(motion), motion.times
        functions = load_functions(dynamics_functions, Path(snakemake.input.code))
        moments = joint_loads(motion, functions).columns()
        write_storage(output.moments, motion.id, times, moments, in_degrees=False)
        write_storage(output.forces, motion.id, times, forces, in_degrees=False)
