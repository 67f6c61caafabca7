"""Hold the walks of the sheet against published ranges of gait."""

from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.normative import (
    BAND_COLUMNS,
    GAIT_COLUMNS,
    band_table,
    gait_row,
    read_normative,
)
from motionstyle.jobs import job
from motionstyle.motion.storage import load_motion
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    motions = []
    for path in snakemake.input.motions:
        try:
            motions.append(load_motion(path))
        except MotionStyleError as error:  # its row with the reason is in clips.csv
            print(f"left out: {error}")
    normative, config = read_normative(snakemake.input.normative), snakemake.params.config
    write_table(snakemake.output.gait, GAIT_COLUMNS, [gait_row(m, normative, config) for m in motions])
    write_table(snakemake.output.bands, BAND_COLUMNS, band_table(motions, normative, config))
