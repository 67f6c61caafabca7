"""Write the left-right mirrored copy of a motion."""

from motionstyle.jobs import job
from motionstyle.motion.mirror import mirror_motion
from motionstyle.motion.storage import load_motion, save_motion

with job(snakemake.log[0]):
    save_motion(snakemake.output.motion, mirror_motion(load_motion(snakemake.input.motion)))
