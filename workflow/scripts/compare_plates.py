"""Hold a physical motion's contact forces against its force plates."""

from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.force_plates import FootForce, force_curves, force_plate_rows
from motionstyle.files import read_json, write_json
from motionstyle.jobs import job
from motionstyle.mocap.markers.plate_feet import plates_by_foot
from motionstyle.motion.storage import load_motion, sidecar_path

with job(snakemake.log[0]):
    given, params, id = snakemake.input, snakemake.params, snakemake.wildcards.clip
    try:
        motion = load_motion(given.motion)
        feet = plates_by_foot(motion, given.forces[0], given.map)
        plates = {
            name[0]: FootForce(feet.times, force)
            for name, force in zip(feet.names, feet.force, strict=True)
        }
        rows = force_plate_rows(motion, plates, params.config)
        curves = force_curves(motion, plates)
    except MotionStyleError as error:
        print(f"failed: {error}")
        known = read_json(sidecar_path(given.motion)).get("provenance", {})
        row = {"id": id, "dataset": known.get("dataset", ""), "config": params.config}
        rows, curves = [{**row, "status": "failed", "reason": str(error)}], []
    write_json(snakemake.output.rows, {"id": id, "rows": rows, "curves": curves})
