"""Copy the figures and tables of a full run to results/published, with what made them."""

from pathlib import Path

from motionstyle.errors import MotionStyleError
from motionstyle.files import atomic_write, file_sha256, write_json
from motionstyle.jobs import job
from motionstyle.mocap.datasets.doors import read_datasets
from motionstyle.report.pictures import small_png

with job(snakemake.log[0]):
    params = snakemake.params
    if params.config != "full":
        raise MotionStyleError(
            f"publish is made from the full run, this is '{params.config}': "
            "snakemake publish --cores 2 --configfile config/full.yaml"
        )
    folder = Path(params.folder)
    made = {}
    for group in ("tables", "figures"):
        for file in map(Path, getattr(snakemake.input, group)):
            copy = folder / group / file.name
            content = small_png(file) if file.suffix == ".png" else file.read_bytes()
            with atomic_write(copy, "wb") as handle:
                handle.write(content)
            made[f"{group}/{file.name}"] = file_sha256(copy)
    datasets = read_datasets(snakemake.input.datasets)
    write_json(
        folder / "provenance.json",
        {
            "command": "snakemake publish --cores 2 --configfile config/full.yaml",
            "files": made,
            "clips": {path: datasets[dataset, path].sha256 for dataset, path in params.used},
            "licences": {datasets[key].dataset: datasets[key].licence for key in params.used},
        },
    )
