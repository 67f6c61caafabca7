"""Joint moments of all physical motions, against published bands and against force plates."""

from pathlib import Path

from motionstyle.dynamics.codegen import load_functions
from motionstyle.dynamics.functions import dynamics_functions
from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.joint_loads import joint_loads
from motionstyle.evaluation.joint_moments import (
    JOINT_MOMENT_COLUMNS,
    PLATE_MOMENT_COLUMNS,
    cycle_curves,
    joint_moment_rows,
    measured_feet,
    measured_loads,
    plate_curves,
    plate_moment_rows,
)
from motionstyle.evaluation.normative import read_normative
from motionstyle.files import write_json
from motionstyle.jobs import job
from motionstyle.mocap.markers.plate_feet import plates_by_foot
from motionstyle.motion.storage import load_available
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    params, output = snakemake.params, snakemake.output
    normative = read_normative(snakemake.input.normative)
    functions = load_functions(dynamics_functions, Path(snakemake.input.code))
    moments, plates, cycles, stances = [], [], {}, {}
    for motion in load_available(snakemake.input.motions, allow_none=True):
        id = motion.provenance["example"]
        own, measured, feet = joint_loads(motion, functions), None, None
        try:
            if id in params.plates:
                feet = measured_feet(motion, plates_by_foot(motion, *params.plates[id]))
                measured = measured_loads(motion, functions, feet)
                plates += plate_moment_rows(motion, own, measured, feet, params.config)
                stances[id] = plate_curves(motion, own, measured, feet)
        except MotionStyleError as error:
            print(f"{id}: plates failed: {error}")
            row = {"id": id, "config": params.config, "status": "failed", "reason": str(error)}
            plates.append(row)
        moments += joint_moment_rows(motion, own, normative, params.config, measured, feet)
        cycles[id] = cycle_curves(motion, own, normative, measured, feet)
    write_table(output.moments, JOINT_MOMENT_COLUMNS, moments)
    write_table(output.plates, PLATE_MOMENT_COLUMNS, plates)
    write_json(output.curves, {"cycles": cycles, "stances": stances})
