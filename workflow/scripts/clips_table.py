"""Gather one row per clip of the sheet."""

from motionstyle.evaluation.clips import CLIP_COLUMNS, clip_row, failed_clip_row
from motionstyle.files import read_json
from motionstyle.jobs import job
from motionstyle.motion.storage import load_motion, sidecar_path
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    rows = []
    for quality_file, motion_file in zip(
        snakemake.input.quality, snakemake.input.motions, strict=True
    ):
        quality = read_json(quality_file)
        if quality["status"] == "ok":
            motion = load_motion(motion_file)
            rows.append(clip_row(motion, quality["report"], snakemake.params.config))
        else:
            sidecar = read_json(sidecar_path(motion_file))
            rows.append(failed_clip_row(sidecar, quality["reason"], snakemake.params.config))
    write_table(snakemake.output.table, CLIP_COLUMNS, rows)
