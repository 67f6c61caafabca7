"""Make the style that learning starts from, of one physical motion."""

from pathlib import Path

from motionstyle.dynamics.codegen import load_functions
from motionstyle.dynamics.functions import dynamics_functions
from motionstyle.jobs import job
from motionstyle.motion.storage import load_motion
from motionstyle.spacetime.style import save_style
from motionstyle.spacetime.synthesis import initial_style_of

with job(snakemake.log[0]):
    functions = load_functions(dynamics_functions, Path(snakemake.input.code))
    style = initial_style_of(load_motion(snakemake.input.motion), functions)
    save_style(Path(snakemake.output.style), style)
