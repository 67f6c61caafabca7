"""Draw estimated ground reaction forces over those of the plates."""

from pathlib import Path

from motionstyle.figures.forces import force_plate_figure
from motionstyle.figures.style import blank_figure, save
from motionstyle.files import read_json
from motionstyle.jobs import job

with job(snakemake.log[0]):
    found = [read_json(file) for file in snakemake.input.rows]
    curves = {one["id"]: one["curves"] for one in found if one["curves"]}
    figure = force_plate_figure(curves) if curves else blank_figure("no force plates in this run")
    save(figure, Path(snakemake.output.svg).with_suffix(""))
