"""Learn a known style back from the motion made with it, or record why not."""

from pathlib import Path

from motionstyle.configuration import read_settings
from motionstyle.dynamics.compiled import load_compiled
from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.nio.learners import learn_by_name
from motionstyle.evaluation.nio.records import load_learning
from motionstyle.evaluation.nio.twins import TEST, make_twin, twin_row
from motionstyle.files import write_json
from motionstyle.jobs import job
from motionstyle.nio.styles_sheet import read_style_row
from motionstyle.tables import plain

with job(snakemake.log[0]):
    inputs, params = snakemake.input, snakemake.params
    seed, noise = int(snakemake.wildcards.seed), float(snakemake.wildcards.noise)
    row = read_style_row(params.sheet, params.clip)
    settings = read_settings(params.settings_file, inputs.schema)
    functions = load_compiled(inputs.code, inputs.second_order)
    spectrum = []

    def learner(learning):
        options = {"schedule": params.schedule, "paper_iterations": 1, "budget": 1}
        return learn_by_name("ours", learning, settings, **options)

    try:
        twin = make_twin(load_learning(row, inputs.motion, functions), functions, seed, noise)
        spectrum = twin.singular_values.tolist()
        found = twin_row(twin, seed, noise, learner, functions)
    except (MotionStyleError, FloatingPointError) as error:
        print(f"failed: {error}")
        found = {"test": TEST, "part": 2, "problem": row.id, "seed": seed, "noise": noise}
        found |= {"status": "failed", "reason": str(error)}
    write_json(Path(snakemake.output.rows), {"rows": [plain(found)], "singular_values": spectrum})
