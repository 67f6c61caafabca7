"""Draw joint moments over the cycle against bands, and over time against force plates."""

from pathlib import Path

from motionstyle.evaluation.normative import read_normative
from motionstyle.figures.moments import joint_moment_figure, plate_moment_figure
from motionstyle.figures.style import blank_figure, save
from motionstyle.files import read_json
from motionstyle.jobs import job

with job(snakemake.log[0]):
    found = read_json(snakemake.input.curves)
    if snakemake.params.show == "cycles":
        figure = joint_moment_figure(found["cycles"], read_normative(snakemake.input.normative))
    elif found["stances"]:
        figure = plate_moment_figure(found["stances"])
    else:
        figure = blank_figure("no force plates in this run")
    save(figure, Path(snakemake.output.svg).with_suffix(""))
