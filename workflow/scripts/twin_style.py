"""Draw one random style around the initial style of a motion."""

from pathlib import Path

from motionstyle.jobs import job
from motionstyle.spacetime.made_styles import random_style
from motionstyle.spacetime.style import load_style, save_style

with job(snakemake.log[0]):
    initial = load_style(Path(snakemake.input.style))
    save_style(Path(snakemake.output.style), random_style(initial, snakemake.params.seed))
