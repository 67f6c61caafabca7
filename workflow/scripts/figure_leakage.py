"""Draw the relative leakage of held-out patterns, and against kernel width."""

from pathlib import Path

import numpy as np

from motionstyle.figures.similarity import leakage_figure
from motionstyle.figures.style import save
from motionstyle.jobs import job
from motionstyle.tables import read_table

with job(snakemake.log[0]):
    with np.load(snakemake.input.held_out, allow_pickle=False) as stored:
        held_out = {name: stored[name] for name in stored.files}
    figure = leakage_figure(read_table(snakemake.input.table), held_out)
    save(figure, Path(snakemake.output.svg).with_suffix(""))
