"""Draw energy along the straight way from the captured motion to the optimum."""

from pathlib import Path

from motionstyle.figures.landscape import landscape_figure
from motionstyle.figures.style import blank_figure, save
from motionstyle.files import read_json
from motionstyle.jobs import job

with job(snakemake.log[0]):
    found = read_json(Path(snakemake.input.rows))
    row = found["rows"][0]
    if found["landscape"]:
        figure = landscape_figure(found["landscape"], f"{row['motion']} ({row['status']})")
    else:
        figure = blank_figure("no landscape: the learning problem was not solved, see the log")
    save(figure, Path(snakemake.output.svg).with_suffix(""))
