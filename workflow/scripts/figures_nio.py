"""Draw what NIO learns and how: springs and shoe, the segment, learning, likelihood, styles."""

from pathlib import Path

import numpy as np

from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.nio.likelihood import (
    BOWLS,
    LIMITS,
    TEMPERATURES,
    likelihood_curves,
)
from motionstyle.evaluation.nio.style_parameters import load_styles
from motionstyle.figures.nio import (
    learning_figure,
    likelihood_figure,
    segment_figure,
    spring_figure,
)
from motionstyle.figures.style import blank_figure, save
from motionstyle.figures.styles import style_compared_figure, style_sides_figure
from motionstyle.files import read_json
from motionstyle.jobs import job
from motionstyle.nio.styles_sheet import read_styles
from motionstyle.spacetime.style import load_style
from motionstyle.tables import read_table

with job(snakemake.log[0]):
    inputs, params = snakemake.input, snakemake.params
    styles = load_styles(inputs.styles, params.keys_of)
    first = styles.get((params.first, "ours"))
    none = "no style was learnt, see the log of learning"
    x = np.linspace(*LIMITS, 400)
    energies = {name: {"x": x, "E": energy(x)} for name, energy in BOWLS.items()}
    segments = read_json(Path(inputs.segment))["segments"]
    rows = {row.id: row for row in read_styles(params.sheet)}
    pairs = [
        (id, style, rows[id].against, styles[(rows[id].against, "ours")])
        for (id, algorithm), style in styles.items()
        if algorithm == "ours" and (rows[id].against, "ours") in styles
    ]
    figures = {
        "nio_learning": learning_figure(read_table(inputs.table), params.shown),
        "nio_likelihood": likelihood_figure(likelihood_curves(), TEMPERATURES, energies),
        "nio_springs": blank_figure(none),
        "nio_segment": blank_figure(none),
        "style_sides": blank_figure(none),
        "style_compared": style_compared_figure(pairs),
    }
    if first is not None:
        title = f"{params.first}, learnt by our algorithm"
        figures["nio_springs"] = spring_figure(first, title)
        try:
            initial = load_style(Path(inputs.initial))
        except MotionStyleError as error:
            print(f"no start: {error}")
        else:
            figures["style_sides"] = style_sides_figure(first, initial, title)
    if segments:
        figures["nio_segment"] = segment_figure(segments, params.first)
    for name, figure in figures.items():
        save(figure, Path(snakemake.output[f"{name}_svg"]).with_suffix(""))
