"""Draw synthesised motions as strips, each titled with its style."""

from pathlib import Path

from motionstyle.figures.strips import strip_figure
from motionstyle.figures.style import blank_figure, save
from motionstyle.jobs import job
from motionstyle.motion.storage import load_motion

with job(snakemake.log[0]):
    motions = [load_motion(file) for file in snakemake.input.motions]
    titles = [
        f"{m.id}: {m.provenance.get('style') or m.provenance.get('edit', '')}" for m in motions
    ]
    view = snakemake.params.view
    figure = (
        strip_figure(motions, titles, view=view, n=snakemake.params.number)
        if motions
        else blank_figure("no motion to show")
    )
    save(figure, Path(snakemake.output.svg).with_suffix(""))
