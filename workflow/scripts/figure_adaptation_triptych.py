"""Draw the task that stands for the paper's Fig. 1: example, adapted, adapted without style."""

from pathlib import Path

from motionstyle.figures.adaptation import triptych_figure
from motionstyle.figures.style import blank_figure, save
from motionstyle.jobs import job
from motionstyle.motion.storage import load_available
from motionstyle.similarity.footholds import cut_example
from motionstyle.similarity.settings import event_rules
from motionstyle.similarity.tasks import Task
from motionstyle.tables import read_table

with job(snakemake.log[0]):
    settings = snakemake.params.settings
    tasks = [Task(**task) for task in snakemake.params.tasks]
    task = next((t for t in tasks if t.figure == "ss-F1"), tasks[0])
    rows = [r for r in read_table(snakemake.input.table) if r["task"] == task.task]
    motions = {m.id: m for m in load_available(snakemake.input.motions, allow_none=True)}
    names = (task.task, f"{task.task}_without_style")
    if all(name in motions for name in names):
        found = {m.id: m for m in load_available(snakemake.input.examples)}
        rate = settings["adaptation"]["rate_hz"]
        example = cut_example(found[task.example], task, event_rules(settings), rate)
        figure = triptych_figure(
            example.motion,
            *(motions[name] for name in names),
            {r["variant"]: r for r in rows},
            task.task,
        )
    else:
        figure = blank_figure(f"task {task.task} was not solved; see adaptations.csv")
    save(figure, Path(snakemake.output.svg).with_suffix(""))
