"""Write the report page of this run."""

from pathlib import Path

import yaml

from motionstyle.evaluation.claims import evaluate_claims, load_claims
from motionstyle.jobs import job
from motionstyle.report.page import write_report

with job(snakemake.log[0]):
    captions = yaml.safe_load(Path(snakemake.input.captions).read_text(encoding="utf-8"))
    results = Path(snakemake.output.page).parent
    claims = load_claims(snakemake.input.claims, snakemake.input.schema)
    write_report(
        snakemake.output.page,
        evaluate_claims(claims, results),
        results_root=str(results),
        config_name=snakemake.params.config,
        data_kind=captions["data"].get(snakemake.params.data, captions["data"]["own"]),
        figures=[(f, captions["figures"][Path(f).stem]) for f in snakemake.input.figures],
    )
