"""Export a motion as BVH."""

from motionstyle.jobs import job
from motionstyle.motion.bvh_export import write_bvh
from motionstyle.motion.storage import load_motion

with job(snakemake.log[0]):
    write_bvh(snakemake.output.bvh, load_motion(snakemake.input.motion))
