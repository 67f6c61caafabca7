"""Hold the walks of the sheet against published ranges of gait."""

from motionstyle.evaluation.normative import (
    BAND_COLUMNS,
    GAIT_COLUMNS,
    band_table,
    gait_row,
    is_level_walk,
    read_normative,
)
from motionstyle.jobs import job
from motionstyle.motion.storage import load_available
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    motions = load_available(snakemake.input.motions, allow_none=True)
    normative, config = read_normative(snakemake.input.normative), snakemake.params.config
    rows = [gait_row(motion, normative, config) for motion in motions]
    walks = [motion for motion in motions if is_level_walk(motion, normative)]
    write_table(snakemake.output.gait, GAIT_COLUMNS, rows)
    write_table(snakemake.output.angles, BAND_COLUMNS, band_table(walks, normative, config))
