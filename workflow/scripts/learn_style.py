"""Learn the style of one motion by one algorithm, or record why it cannot be."""

from pathlib import Path

from motionstyle.configuration import read_settings
from motionstyle.dynamics.compiled import load_compiled
from motionstyle.evaluation.nio.learners import checked, learn_by_name
from motionstyle.evaluation.nio.records import learning_record, load_learning
from motionstyle.files import read_json, write_json
from motionstyle.jobs import job
from motionstyle.nio.styles_sheet import read_style_row
from motionstyle.spacetime.style import save_no_style, save_style

FEWEST_SOLVES = 12  # of learners whose budget is not another one's

with job(snakemake.log[0]):
    inputs, params, wildcards = snakemake.input, snakemake.params, snakemake.wildcards
    row = read_style_row(params.sheet, wildcards.clip)
    settings = read_settings(params.settings_file, inputs.schema)
    functions = load_compiled(inputs.code, inputs.second_order)
    printed = read_json(Path(inputs.budget))["rows"] if inputs.get("budget") else []
    budget = printed[-1]["inner_solves"] if printed else FEWEST_SOLVES
    kept = {}

    def work():
        learning = load_learning(row, inputs.motion, functions)
        kept["initial"] = learning.start
        learnt = checked(
            learn_by_name(
                wildcards.algorithm,
                learning,
                settings,
                schedule=params.schedule,
                paper_iterations=params.paper_iterations,
                budget=budget,
            )
        )
        kept["style"] = learnt.style
        return learnt.rows

    record = learning_record(row, wildcards.algorithm, work)
    write_json(Path(snakemake.output.rows), record)
    for name, path in (("style", snakemake.output.style), ("initial", snakemake.output.initial)):
        if name in kept:
            save_style(Path(path), kept[name])
        else:
            save_no_style(Path(path), record["reason"])
