"""Fetch one file of a dataset from the cache, a mirror folder or upstream."""

from motionstyle.cache import cache_folder
from motionstyle.jobs import job
from motionstyle.mocap.datasets.doors import DatasetFile, fetch_file

with job(snakemake.log[0]):
    fetch_file(
        DatasetFile(**snakemake.params.entry),
        snakemake.output.file,
        cache_dir=cache_folder(),
        mirrors=snakemake.params.mirrors,
        root=snakemake.params.root,
        log=print,
    )
