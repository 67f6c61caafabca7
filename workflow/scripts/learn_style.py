"""Learn the style of one motion by one algorithm, or record why it cannot be."""

from pathlib import Path

from motionstyle.evaluation.nio.learners import checked, learn_by_name
from motionstyle.evaluation.nio.records import learning_record, load_functions_of, load_learning
from motionstyle.files import read_json, write_json
from motionstyle.jobs import job
from motionstyle.nio.settings import read_nio_settings
from motionstyle.nio.styles_sheet import read_style_row
from motionstyle.spacetime.style import save_no_style, save_style

with job(snakemake.log[0]):
    inputs, params, wildcards = snakemake.input, snakemake.params, snakemake.wildcards
    row = read_style_row(params.sheet, wildcards.clip)
    settings = read_nio_settings(params.settings_file, inputs.schema)
    functions = load_functions_of(inputs.code, inputs.second_order)
    budget = len(read_json(Path(inputs.budget))["rows"]) if inputs.get("budget") else 12
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
                budget=max(1, budget),
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
