"""Draw synthesised or warped motions as strips, with contact forces if known, one of each task."""

from pathlib import Path

from motionstyle.figures.strips import strip_figure
from motionstyle.figures.style import blank_figure, save
from motionstyle.jobs import job
from motionstyle.motion.storage import load_available

with job(snakemake.log[0]):
    motions = load_available(snakemake.input.motions, allow_none=True)
    titles = [
        f"{m.id}: {m.provenance['task'].replace('_', ' ')}, "
        + (f"style {m.provenance['style']} " if m.kind == "nio" else "warped example ")
        + f"({m.provenance['solver_status']})"
        for m in motions
    ]
    if motions:
        figure = strip_figure(motions, titles, view="travel", forces=True, paired=True)
    else:
        figure = blank_figure("no motion to show")
    save(figure, Path(snakemake.output.svg).with_suffix(""))
