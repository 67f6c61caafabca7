"""Validate one-class SVM and kernel PCA on the paper's set and on all pairs."""

import numpy as np

from motionstyle.files import atomic_write
from motionstyle.jobs import job
from motionstyle.similarity import study
from motionstyle.similarity.bank import load_bank
from motionstyle.tables import write_table

with job(snakemake.log[0]):
    bank = load_bank(snakemake.input.bank)
    found = study.run_study(bank, snakemake.params.settings, snakemake.params.config)
    write_table(snakemake.output.sets, study.SETS_COLUMNS, found.sets)
    write_table(snakemake.output.subspaces, study.SUBSPACE_COLUMNS, found.subspaces)
    write_table(snakemake.output.leakage, study.LEAKAGE_COLUMNS, found.leakage)
    write_table(snakemake.output.svm, study.SVM_COLUMNS, found.svm)
    with atomic_write(snakemake.output.held_out, "wb") as handle:
        np.savez(handle, **found.held_out)
