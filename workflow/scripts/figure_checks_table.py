"""Write, in numbers, what the figures of NIO show."""

from pathlib import Path

from motionstyle.evaluation.nio.checks import (
    CHECK_COLUMNS,
    segment_checks,
    shoe_checks,
    spring_checks,
)
from motionstyle.evaluation.nio.likelihood import likelihood_checks
from motionstyle.evaluation.nio.style_parameters import load_styles
from motionstyle.files import read_json
from motionstyle.jobs import job
from motionstyle.tables import plain, write_table

with job(snakemake.log[0]):
    inputs, params = snakemake.input, snakemake.params
    rows = []
    for (id, algorithm), style in load_styles(inputs.styles, params.keys_of).items():
        found = [*spring_checks(style), *shoe_checks(style)]
        rows += [{"style": id, "algorithm": algorithm, **row} for row in found]
    segment = read_json(Path(inputs.segment))
    found = [*segment_checks(segment["segments"]), *segment["cost"]]
    rows += [{"style": segment["style"], "algorithm": "ours", **row} for row in found]
    rows += [{"data": "planted", **row} for row in likelihood_checks()]
    common = {"config": params.config, "data": "captured"}
    table = [plain({**common, **row}) for row in rows]
    write_table(snakemake.output.table, CHECK_COLUMNS, table)
