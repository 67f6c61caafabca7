"""Write the left-right mirrored copy of a motion, or that there is none to mirror."""

from pathlib import Path

from motionstyle.jobs import job
from motionstyle.motion.mirror import mirror_motion
from motionstyle.motion.storage import load_motion, read_sidecar, save_failure, save_motion

with job(snakemake.log[0]):
    source, target = snakemake.input.motion, snakemake.output.motion
    sidecar = read_sidecar(source)
    if sidecar["status"] == "ok":
        save_motion(target, mirror_motion(load_motion(source)))
    else:
        reason = f"nothing to mirror: {sidecar['reason']}"
        save_failure(target, Path(target).stem, "captured", reason, **sidecar["provenance"])
