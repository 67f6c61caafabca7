"""Draw leakage and SVM score against planted changes."""

from pathlib import Path

from motionstyle.figures.similarity import dose_figure
from motionstyle.figures.style import save
from motionstyle.jobs import job
from motionstyle.tables import read_table

with job(snakemake.log[0]):
    figure = dose_figure(read_table(snakemake.input.points))
    save(figure, Path(snakemake.output.svg).with_suffix(""))
