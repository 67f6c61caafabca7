"""Hold a physical motion's contact forces against its force plates."""

from dataclasses import replace
from pathlib import Path

from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.force_plates import FootForce, force_curves, force_plate_rows
from motionstyle.files import read_json, write_json
from motionstyle.jobs import job
from motionstyle.mocap.ingest_markers import read_forces
from motionstyle.mocap.marker_paths import Placement
from motionstyle.mocap.markerset import read_marker_set
from motionstyle.mocap.plates import foot_forces
from motionstyle.motion.storage import load_motion, sidecar_path

with job(snakemake.log[0]):
    given, params, id = snakemake.input, snakemake.params, snakemake.wildcards.clip
    try:
        motion = load_motion(given.motion)
        map_file = Path(given.map)
        markers = read_marker_set(map_file.parent, map_file.stem)
        record = read_forces(given.forces[0], markers, params.up_axis)
        placed = Placement.from_json(motion.provenance["placement"]).forces(record)
        start = placed.start_s - motion.provenance.get("cut_start_s", 0.0)
        placed = replace(placed, start_s=start)
        feet = foot_forces(placed, markers.plates(given.forces[0]).feet, motion)
        plates = {side: FootForce(*found) for side, found in feet.items()}
        rows = force_plate_rows(motion, plates, params.config)
        curves = force_curves(motion, plates)
    except MotionStyleError as error:
        print(f"failed: {error}")
        known = read_json(sidecar_path(given.motion)).get("provenance", {})
        row = {"id": id, "dataset": known.get("dataset", ""), "config": params.config}
        rows, curves = [{**row, "status": "failed", "reason": str(error)}], []
    write_json(snakemake.output.rows, {"id": id, "rows": rows, "curves": curves})
