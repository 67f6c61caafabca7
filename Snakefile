"""Motion style: three papers replicated from motion capture to figures, tables and a ledger."""

from snakemake.utils import min_version

min_version("9.27")


configfile: workflow.source_path("config/config.yaml")


include: "workflow/rules/common.smk"
include: "workflow/rules/style_machines_common.smk"
include: "workflow/rules/style_machines.smk"
include: "workflow/rules/mocap.smk"
include: "workflow/rules/physics.smk"
include: "workflow/rules/moments.smk"
include: "workflow/rules/spacetime.smk"
include: "workflow/rules/solvers.smk"
include: "workflow/rules/nio_common.smk"
include: "workflow/rules/nio.smk"
include: "workflow/rules/twins.smk"
include: "workflow/rules/solver_studies.smk"
include: "workflow/rules/similarity.smk"
include: "workflow/rules/evaluation.smk"
include: "workflow/rules/report.smk"


rule all:
    default_target: True
    input:
        RESULTS / "status/clips.ok",
        RESULTS / "report.html",
        everything(),
