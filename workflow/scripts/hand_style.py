"""Make the style that a table states, for the body of one physical motion."""

from pathlib import Path

from motionstyle.jobs import job
from motionstyle.motion.storage import load_motion
from motionstyle.spacetime.made_styles import hand_style
from motionstyle.spacetime.style import save_style

with job(snakemake.log[0]):
    style = hand_style(snakemake.input.table, load_motion(snakemake.input.motion))
    save_style(Path(snakemake.output.style), style)
