"""Draw how much of a style a motion shows: singular values at twins."""

from pathlib import Path

from motionstyle.figures.nio import identifiability_figure
from motionstyle.figures.style import save
from motionstyle.files import read_json
from motionstyle.jobs import job

with job(snakemake.log[0]):
    found = [read_json(Path(file)) for file in snakemake.input.rows]
    figure = identifiability_figure(found)
    save(figure, Path(snakemake.output.svg).with_suffix(""))
