"""Draw how far each virtual marker lies from the fitted body."""

from pathlib import Path

from motionstyle.figures.bodies import marker_figure
from motionstyle.figures.style import blank_figure, save
from motionstyle.files import read_json
from motionstyle.jobs import job

with job(snakemake.log[0]):
    quality = {Path(file).stem: read_json(file) for file in snakemake.input.quality}
    rms = {id: found["marker_rms_cm"] for id, found in quality.items() if found["status"] == "ok"}
    figure = marker_figure(rms) if rms else blank_figure("no motion to show")
    save(figure, Path(snakemake.output.svg).with_suffix(""))
