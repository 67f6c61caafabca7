"""Draw the body of one motion."""

from pathlib import Path

from motionstyle.figures.bodies import body_figure
from motionstyle.figures.style import save
from motionstyle.jobs import job
from motionstyle.motion.storage import load_motion

with job(snakemake.log[0]):
    save(
        body_figure(load_motion(snakemake.input.motion).body),
        Path(snakemake.output.svg).with_suffix(""),
    )
