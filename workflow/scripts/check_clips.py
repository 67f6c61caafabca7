"""End the run with an error if a clip could not be used, after all else is written."""

from motionstyle.errors import MotionStyleError
from motionstyle.files import atomic_write
from motionstyle.jobs import job
from motionstyle.tables import read_table

with job(snakemake.log[0]):
    rows = read_table(snakemake.input.clips)
    failed = [f"{row['id']}: {row['reason']}" for row in rows if row["status"] != "ok"]
    if failed and not snakemake.params.allow:
        raise MotionStyleError(
            f"{len(failed)} of {len(rows)} clips failed; all else is done. Mend them or their rows "
            "in the sheet, or set allow_failed_clips: true.\n  " + "\n  ".join(failed)
        )
    with atomic_write(snakemake.output.stamp) as handle:
        handle.write(f"{len(rows) - len(failed)} of {len(rows)} clips are motions\n")
