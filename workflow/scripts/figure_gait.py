"""Draw gait cycles over the normative bands."""

from pathlib import Path

from motionstyle.evaluation.normative import read_normative
from motionstyle.figures.gait import gait_figure
from motionstyle.figures.style import blank_figure, save
from motionstyle.jobs import job
from motionstyle.motion.storage import load_available

with job(snakemake.log[0]):
    motions = load_available(snakemake.input.motions, allow_none=True)
    normative = read_normative(snakemake.input.normative)
    figure = gait_figure(motions, normative) if motions else blank_figure("no motion to show")
    save(figure, Path(snakemake.output.svg).with_suffix(""))
