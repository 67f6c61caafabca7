"""Draw the variance held by the leg subspaces."""

from pathlib import Path

from motionstyle.figures.similarity import subspaces_figure
from motionstyle.figures.style import save
from motionstyle.jobs import job
from motionstyle.tables import read_table

with job(snakemake.log[0]):
    figure = subspaces_figure(read_table(snakemake.input.table))
    save(figure, Path(snakemake.output.svg).with_suffix(""))
