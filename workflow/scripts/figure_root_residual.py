"""Draw the force at the pelvis before and after the physics fit."""

from pathlib import Path

import pandas as pd

from motionstyle.figures.residuals import residual_figure
from motionstyle.figures.style import save
from motionstyle.jobs import job

with job(snakemake.log[0]):
    table = pd.read_csv(snakemake.input.table, dtype=str, keep_default_na=False)
    figure = residual_figure(table.to_dict("records"))
    save(figure, Path(snakemake.output.svg).with_suffix(""))
