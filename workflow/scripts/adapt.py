"""Adapt one example to one task, with and without the style terms."""

from motionstyle.errors import MotionStyleError
from motionstyle.files import write_json
from motionstyle.jobs import job
from motionstyle.motion.storage import load_motion, save_failure, save_motion
from motionstyle.similarity.adaptation import adapt, failed_rows
from motionstyle.similarity.bank import load_bank
from motionstyle.similarity.tasks import Task
from motionstyle.tables import plain

with job(snakemake.log[0]):
    task = Task(**snakemake.params.task)
    config = snakemake.params.config
    try:
        motion = load_motion(snakemake.input.example)
        bank = load_bank(snakemake.input.bank)
        found = adapt(motion, task, bank, snakemake.params.settings, config)
        rows = [one.row for one in found.values()]
        motions = {name: found[name].motion for name in ("full", "without_style")}
    except MotionStyleError as error:
        rows = failed_rows(task, str(error), config)
        motions = {"full": None, "without_style": None}
    for name, path in (
        ("full", snakemake.output.full),
        ("without_style", snakemake.output.ablated),
    ):
        if motions[name] is not None:
            save_motion(path, motions[name])
            continue
        reason = next(str(r["reason"]) for r in rows if r["variant"] == name)
        print(f"{task.task}, {name}: {reason}")
        suffix = "" if name == "full" else f"_{name}"
        save_failure(path, task.task + suffix, "adapted", reason, example=task.example)
    write_json(snakemake.output.report, [plain(row) for row in rows])
