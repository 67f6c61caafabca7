"""Draw physical motions as stick figures with ground reaction forces."""

from pathlib import Path

from motionstyle.figures.force_strips import force_strip_figure
from motionstyle.figures.style import blank_figure, save
from motionstyle.files import read_json
from motionstyle.jobs import job
from motionstyle.motion.storage import load_available

with job(snakemake.log[0]):
    motions = load_available(snakemake.input.motions, allow_none=True)
    status = {Path(f).stem: read_json(f)["status"] for f in snakemake.input.reports}
    ids = [motion.provenance["example"] for motion in motions]
    titles = [id if status[id] == "converged" else f"{id} ({status[id]})" for id in ids]
    if motions:
        figure = force_strip_figure(motions, titles)
    else:
        figure = blank_figure("no physical motion to show")
    save(figure, Path(snakemake.output.svg).with_suffix(""))
