"""Export a motion's joint angles for OpenSim."""

from motionstyle.errors import MotionStyleError
from motionstyle.jobs import job
from motionstyle.motion.opensim_export import opensim_angles, write_no_motion, write_storage
from motionstyle.motion.storage import load_motion

with job(snakemake.log[0]):
    file = snakemake.output.angles
    try:
        motion = load_motion(snakemake.input.motion)
    except MotionStyleError as error:
        if not snakemake.params.allow_failed:
            raise
        print(f"failed: {error}")
        write_no_motion(file, str(error))
    else:
        columns = opensim_angles(motion)
        write_storage(file, motion.id, motion.times, columns, in_degrees=True)
