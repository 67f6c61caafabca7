"""Judge every claim on the tables of this run."""

from pathlib import Path

from motionstyle.evaluation.claims import evaluate_claims, load_claims, write_claims_csv
from motionstyle.jobs import job

with job(snakemake.log[0]):
    claims = load_claims(snakemake.input.claims, snakemake.input.schema)
    write_claims_csv(
        snakemake.output.table, evaluate_claims(claims, Path(snakemake.output.table).parents[1])
    )
