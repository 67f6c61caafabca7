"""Draw gait cycles over the normative bands."""

from pathlib import Path

from motionstyle.evaluation.normative import read_normative
from motionstyle.figures.gait import gait_figure
from motionstyle.figures.style import save
from motionstyle.jobs import job
from motionstyle.motion.storage import load_available

with job(snakemake.log[0]):
    save(
        gait_figure(
            load_available(snakemake.input.motions), read_normative(snakemake.input.normative)
        ),
        Path(snakemake.output.svg).with_suffix(""),
    )
