"""Draw energy over seconds from all starts, one panel a problem."""

from pathlib import Path

from motionstyle.figures.solvers import solver_figure
from motionstyle.figures.style import save
from motionstyle.files import read_json
from motionstyle.jobs import job

with job(snakemake.log[0]):
    problems = [read_json(Path(file)) for file in snakemake.input.rows]
    save(solver_figure(problems), Path(snakemake.output.svg).with_suffix(""))
