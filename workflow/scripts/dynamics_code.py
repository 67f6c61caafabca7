"""Compile the dynamics once for all jobs, or note that there is no compiler."""

from pathlib import Path

from motionstyle.dynamics.codegen import compile_library
from motionstyle.dynamics.functions import dynamics_functions
from motionstyle.jobs import job
from motionstyle.mocap.datasets.doors import cache_folder

with job(snakemake.log[0]):
    compile_library(
        dynamics_functions(), Path(snakemake.output.library), Path(cache_folder()), print
    )
