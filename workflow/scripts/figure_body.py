"""Draw and list the body of one motion."""

from pathlib import Path

from motionstyle.evaluation.bodies import BODY_COLUMNS, body_table
from motionstyle.figures.bodies import body_figure
from motionstyle.figures.style import blank_figure, save
from motionstyle.jobs import job
from motionstyle.motion.storage import load_available
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    motions = load_available(snakemake.input.motions, allow_none=True)[:1]
    config = snakemake.params.config
    rows = [row for motion in motions for row in body_table(motion, config)]
    write_table(snakemake.output.table, BODY_COLUMNS, rows)
    figure = body_figure(motions[0].body) if motions else blank_figure("no motion to show")
    save(figure, Path(snakemake.output.svg).with_suffix(""))
