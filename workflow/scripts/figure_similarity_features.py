"""Draw how a pair of whole-body segments is described."""

from pathlib import Path

from motionstyle.figures.similarity import features_figure
from motionstyle.figures.style import save
from motionstyle.jobs import job
from motionstyle.motion.storage import load_available
from motionstyle.similarity.settings import event_rules

with job(snakemake.log[0]):
    types = snakemake.params.settings["sets"]["types"]
    motions = load_available(snakemake.input.motions)
    shown = next((m for m in motions if m.provenance.get("action") in types), motions[0])
    figure = features_figure(shown, event_rules(snakemake.params.settings))
    save(figure, Path(snakemake.output.svg).with_suffix(""))
