"""Write all parameters of all learnt styles, beside what they are compared with."""

from motionstyle.evaluation.nio.style_parameters import (
    PARAMETER_COLUMNS,
    load_styles,
    style_parameter_rows,
)
from motionstyle.jobs import job
from motionstyle.nio.styles_sheet import read_styles
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    inputs, params = snakemake.input, snakemake.params
    rows = [row for row in read_styles(params.sheet) if row.id in {id for id, _ in params.keys_of}]
    learnt = load_styles(inputs.styles, params.keys_of)
    initial = {id: style for (id, _), style in load_styles(inputs.initial, params.keys_of).items()}
    table = style_parameter_rows(rows, learnt, initial, params.config)
    write_table(snakemake.output.table, PARAMETER_COLUMNS, table)
