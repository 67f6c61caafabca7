"""Fit the development clips under each variant of the settings, and hold forces against plates."""

from pathlib import Path

from motionstyle.dynamics.codegen import load_functions
from motionstyle.dynamics.functions import dynamics_functions
from motionstyle.evaluation.force_plates import FootForce
from motionstyle.evaluation.force_study import STUDY_COLUMNS, study_row, variants
from motionstyle.jobs import job
from motionstyle.mocap.markers.plate_feet import plates_by_foot
from motionstyle.mocap.settings import of_action
from motionstyle.motion.markers import load_markers
from motionstyle.motion.storage import load_motion
from motionstyle.spacetime.physical import fit_physical, prepare, prepare_markers
from motionstyle.spacetime.physical_problem import settings_from
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    given, params = snakemake.input, snakemake.params
    functions = load_functions(dynamics_functions, Path(given.code))
    rows = []
    for name, changes in variants(params.study):
        for k, id in enumerate(params.clips):
            kinematic = load_motion(given.motions[k])
            settings = {**params.physical, **changes}
            settings = of_action(settings, kinematic.provenance["action"])
            motion = prepare(kinematic, settings)
            markers = load_markers(given.markers[k])
            measured = changes.get("measured_markers", True)
            found = fit_physical(
                motion,
                functions,
                settings_from(settings),
                lambda _text: None,
                markers=prepare_markers(markers, motion) if measured else None,
            )
            changed = " ".join(f"{key}={value}" for key, value in changes.items())
            row = {"variant": name, "changed": changed, "id": id, **found.report}
            if found.motion is not None:
                feet = plates_by_foot(found.motion, given.forces[k], given.maps[k])
                plates = {
                    side[0]: FootForce(feet.times, force)
                    for side, force in zip(feet.names, feet.force, strict=True)
                }
                row |= study_row(found.motion, plates)
            print(f"{name}, {id}: vertical r {row.get('vertical_correlation', float('nan')):.3f}")
            rows.append({column: row.get(column, "") for column in STUDY_COLUMNS})
    write_table(snakemake.output.table, STUDY_COLUMNS, rows)
