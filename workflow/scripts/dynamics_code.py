"""Compile the dynamics once for all jobs, or note that there is no compiler."""

from pathlib import Path

from motionstyle.cache import cache_folder
from motionstyle.dynamics.codegen import compile_library
from motionstyle.dynamics.functions import dynamics_functions
from motionstyle.dynamics.second_order import second_order_functions
from motionstyle.jobs import job

with job(snakemake.log[0]):
    output, cache = snakemake.output, Path(cache_folder())
    compile_library(dynamics_functions(), Path(output.library), cache, print)
    compile_library(second_order_functions(), Path(output.second_order), cache, print)
