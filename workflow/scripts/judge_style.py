"""Solve for the motion of one style with its captured contacts to convergence, and measure it."""

from pathlib import Path

from motionstyle.dynamics.compiled import load_compiled
from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.nio.kinds import judge_kind
from motionstyle.evaluation.nio.records import judging_record, load_learning
from motionstyle.files import write_json
from motionstyle.jobs import job
from motionstyle.motion.storage import save_failure, save_motion
from motionstyle.nio.styles_sheet import read_style_row
from motionstyle.spacetime.style import load_style
from motionstyle.tables import plain

with job(snakemake.log[0]):
    inputs, output, wildcards = snakemake.input, snakemake.output, snakemake.wildcards
    row = read_style_row(snakemake.params.sheet, wildcards.clip)
    functions = load_compiled(inputs.code, inputs.second_order)
    learning = None
    try:
        learning = load_learning(row, inputs.motion, functions)
        learnt = load_style(Path(inputs.style)) if inputs.get("style") else None
        found = judge_kind(wildcards.kind, learning, learnt, snakemake.params.perturbed)
    except (MotionStyleError, FloatingPointError) as error:
        print(f"failed: {error}")
        save_failure(output.motion, f"{row.clip}_{wildcards.kind}", "nio", str(error))
        save_failure(output.target, f"{row.clip}_target", "nio", str(error))
        record = judging_record(row, wildcards.kind, learning)
        write_json(Path(output.rows), {**record, "status": "failed", "reason": str(error)})
    else:
        save_motion(output.motion, found.motion)
        save_motion(output.target, learning.target)
        record = judging_record(row, wildcards.kind, learning)
        rows = [plain(one) for one in found.rows]
        write_json(Path(output.rows), {**record, "status": "done", "rows": rows})
