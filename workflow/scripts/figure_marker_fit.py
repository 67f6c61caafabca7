"""Draw how well measured and virtual markers fit, pooled over all clips."""

from pathlib import Path

from motionstyle.evaluation.marker_fit import pooled_distances
from motionstyle.figures.bodies import marker_fit_figure
from motionstyle.figures.style import save
from motionstyle.files import read_json
from motionstyle.jobs import job
from motionstyle.mocap.markers.markerset import read_marker_set

with job(snakemake.log[0]):
    sets = {str(m): read_marker_set(Path(m).parent, Path(m).stem) for m in snakemake.input.maps}
    used = [sets.get(name) for name in snakemake.params.sets]
    clips = zip(map(read_json, snakemake.input.quality), used, strict=True)
    figure = marker_fit_figure(pooled_distances(clips))
    save(figure, Path(snakemake.output.svg).with_suffix(""))
