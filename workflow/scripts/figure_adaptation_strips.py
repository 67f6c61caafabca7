"""Draw a strip of every adapted motion."""

from pathlib import Path

from motionstyle.figures.adaptation import adaptation_strips_figure
from motionstyle.figures.style import save
from motionstyle.jobs import job
from motionstyle.motion.storage import load_available
from motionstyle.tables import read_table

with job(snakemake.log[0]):
    motions = {m.id: m for m in load_available(snakemake.input.motions, allow_none=True)}
    figure = adaptation_strips_figure(motions, read_table(snakemake.input.table))
    save(figure, Path(snakemake.output.svg).with_suffix(""))
