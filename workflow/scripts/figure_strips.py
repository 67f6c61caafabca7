"""Draw motions as strips of stick figures."""

from pathlib import Path

from motionstyle.figures.strips import strip_figure
from motionstyle.figures.style import blank_figure, save
from motionstyle.jobs import job
from motionstyle.motion.storage import load_available

with job(snakemake.log[0]):
    motions = load_available(snakemake.input.motions, allow_none=True)
    figure = strip_figure(motions) if motions else blank_figure("no motion to show")
    save(figure, Path(snakemake.output.svg).with_suffix(""))
