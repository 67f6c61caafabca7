"""Judge every made motion of the run against its example."""

from motionstyle.jobs import job
from motionstyle.motion.storage import load_motion, read_sidecar
from motionstyle.similarity.bank import load_bank
from motionstyle.similarity.judge import COLUMNS, failed_row, judge_motions
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    made = {path: read_sidecar(path) for path in snakemake.input.motions}
    wanted = {str(sidecar["provenance"].get("example")) for sidecar in made.values()}
    examples = {}
    for path in snakemake.input.examples if made else []:
        sidecar = read_sidecar(path)
        if sidecar["status"] == "ok" and sidecar["id"] in wanted:
            examples[sidecar["id"]] = load_motion(path)
    bank = load_bank(snakemake.input.bank)
    ready = [load_motion(path) for path, sidecar in made.items() if sidecar["status"] == "ok"]
    settings, config = snakemake.params.settings, snakemake.params.config
    rows = judge_motions(ready, examples, bank, settings, config)
    rows += [failed_row(s, config) for s in made.values() if s["status"] != "ok"]
    write_table(snakemake.output.table, COLUMNS, rows)
