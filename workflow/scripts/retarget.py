"""Turn one clip into a kinematic motion, or record why it cannot be."""

from pathlib import Path

from motionstyle.errors import MotionStyleError
from motionstyle.files import write_json
from motionstyle.jobs import job
from motionstyle.mocap.ingest import ingest_clip, provenance
from motionstyle.mocap.settings import RetargetSettings
from motionstyle.mocap.sheet import ClipRow
from motionstyle.motion.storage import save_failure, save_motion

with job(snakemake.log[0]):
    params, output = snakemake.params, snakemake.output
    row = ClipRow(**params.row, experiments=params.experiments, note=None, row=0, folder=Path())
    try:
        found = ingest_clip(
            row,
            snakemake.input.clip,
            Path(snakemake.input.map).parent,
            RetargetSettings.from_config(params.retarget, params.contacts),
            skeleton_file=next(iter(snakemake.input.skeleton_files), None),
            default_mass_kg=params.body["default_mass_kg"],
            default_sex=params.body["default_sex"],
        )
    except MotionStyleError as error:
        print(f"failed: {error}")
        save_failure(output.motion, row.id, "captured", str(error), **provenance(row))
        write_json(output.quality, {"status": "failed", "reason": str(error)})
    else:
        save_motion(output.motion, found.motion)
        write_json(
            output.quality,
            {"status": "ok", "report": found.report, "marker_rms_cm": found.marker_rms_cm},
        )
