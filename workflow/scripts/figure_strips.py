"""Draw motions as strips of stick figures."""

from pathlib import Path

from motionstyle.figures.strips import strip_figure
from motionstyle.figures.style import save
from motionstyle.jobs import job
from motionstyle.motion.storage import load_available

with job(snakemake.log[0]):
    save(
        strip_figure(load_available(snakemake.input.motions)),
        Path(snakemake.output.svg).with_suffix(""),
    )
