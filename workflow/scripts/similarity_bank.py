"""Cut all clips of the stage into segments and align them."""

from pathlib import Path

from motionstyle.jobs import job
from motionstyle.motion.storage import load_available
from motionstyle.similarity.bank import ALIGNMENT_COLUMNS, build_bank, save_bank
from motionstyle.similarity.events import read_events
from motionstyle.similarity.settings import event_rules
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    settings = snakemake.params.settings
    folder = Path(snakemake.input.settings).parent
    given = read_events(folder / settings["events"]) if settings["events"] else None
    motions = load_available(snakemake.input.motions)
    bank, rows = build_bank(motions, event_rules(settings), settings["sets"]["types"], given)
    save_bank(snakemake.output.bank, bank)
    write_table(snakemake.output.alignments, ALIGNMENT_COLUMNS, rows)
