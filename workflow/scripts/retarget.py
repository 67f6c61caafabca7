"""Turn one clip into a kinematic motion, or record why it cannot be."""

from pathlib import Path

from motionstyle.errors import MotionStyleError
from motionstyle.files import write_json
from motionstyle.jobs import job
from motionstyle.mocap.datasets.sheet import MARKER_FILES, ClipRow
from motionstyle.mocap.markers.ingest import ingest_markers
from motionstyle.mocap.settings import RetargetSettings
from motionstyle.mocap.skeletons.ingest import ingest_clip, provenance
from motionstyle.motion.markers import save_markers
from motionstyle.motion.storage import save_failure, save_motion

with job(snakemake.log[0]):
    params, given, output = snakemake.params, snakemake.input, snakemake.output
    row = ClipRow(**params.row, experiments=params.experiments, note=None, row=0, folder=Path())
    if row.path.lower().endswith(MARKER_FILES):
        ingest = ingest_markers
        companions = {
            "static_file": next(iter(given.static), None),
            "forces_file": next(iter(given.forces), None),
        }
    else:
        ingest, companions = ingest_clip, {"skeleton_file": next(iter(given.skeleton_files), None)}
    try:
        found = ingest(
            row,
            given.clip,
            Path(given.map).parent,
            RetargetSettings.from_config(params.retarget, params.contacts),
            **companions,
            **params.body,
        )
    except MotionStyleError as error:
        print(f"failed: {error}")
        save_failure(output.motion, row.id, "captured", str(error), **provenance(row))
        save_markers(output.markers, None)
        write_json(output.quality, {"status": "failed", "reason": str(error)})
    else:
        save_motion(output.motion, found.motion)
        save_markers(output.markers, found.markers)
        write_json(
            output.quality,
            {"status": "ok", "report": found.report, "marker_rms_cm": found.marker_rms_cm},
        )
