"""Draw the figures of style machines from their tables and arrays."""

from pathlib import Path

import pandas as pd

from motionstyle.evaluation.style_machines.store import load_arrays
from motionstyle.figures import style_machine_models as model_figures
from motionstyle.figures import style_machines as figures
from motionstyle.figures.style import save
from motionstyle.jobs import job

with job(snakemake.log[0]):
    inputs = snakemake.input
    tables = {Path(f).stem: pd.read_csv(f, encoding="utf-8") for f in inputs.tables}
    gaits, dances, driving, checks = (
        load_arrays(inputs[name]) for name in ("gaits", "dances", "driving", "checks")
    )
    numbers, models = tables["shmm_figure_checks"], tables["dance_model"]
    first = models.iloc[0].to_dict() if len(models) else None
    made = {
        "shmm_models": model_figures.models_figure(checks, numbers),
        "shmm_priors": model_figures.priors_figure(checks),
        "shmm_dof": figures.dof_figure(tables["explained_variance"]),
        "shmm_dance": model_figures.dance_figure(dances, first["model"] if first else "", first),
        "shmm_graphs": model_figures.graphs_figure(),
        "shmm_annealing": model_figures.annealing_figure(checks),
        "shmm_axes": figures.axes_figure(tables["style_dof"], gaits),
        "shmm_analogies": figures.analogies_figure(tables["analogies"]),
        "shmm_held_out": figures.held_out_figure(tables["held_out"]),
        "shmm_driving": figures.driving_figure(tables["path_map"], driving),
        "shmm_phases": figures.phases_figure(checks, numbers),
        "shmm_twin": figures.twin_figure(tables["shmm_twin"]),
        "shmm_novice": figures.novice_figure(tables["novice"]),
    }
    for file in snakemake.output.svg:
        save(made[Path(file).stem], Path(file).with_suffix(""))
