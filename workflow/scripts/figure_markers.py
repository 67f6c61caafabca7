"""Draw how far each virtual marker lies from the fitted body."""

from pathlib import Path

from motionstyle.figures.bodies import marker_figure
from motionstyle.figures.style import save
from motionstyle.files import read_json
from motionstyle.jobs import job

with job(snakemake.log[0]):
    quality = {Path(file).stem: read_json(file) for file in snakemake.input.quality}
    save(
        marker_figure({id: q["marker_rms_cm"] for id, q in quality.items() if q["status"] == "ok"}),
        Path(snakemake.output.svg).with_suffix(""),
    )
