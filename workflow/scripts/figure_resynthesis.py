"""Draw a captured motion above its resyntheses by every style that was judged."""

from pathlib import Path

from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.nio.kinds import KINDS
from motionstyle.figures.strips import strip_figure
from motionstyle.figures.style import blank_figure, save
from motionstyle.files import read_json
from motionstyle.jobs import job
from motionstyle.motion.storage import load_motion

with job(snakemake.log[0]):
    inputs = snakemake.input
    motions, titles = [], []
    for file, rows, kind in zip(inputs.motions, inputs.rows, snakemake.params.kinds, strict=True):
        try:
            motion = load_motion(file)
        except MotionStyleError as error:
            print(f"left out: {error}")
            continue
        if not motions:
            motions.append(load_motion(Path(file).with_name(f"{Path(file).stem}_target.npz")))
            titles.append(f"{snakemake.params.style}: captured, made feasible")
        row = read_json(Path(rows))["rows"][0]
        motions.append(motion)
        title = KINDS[kind].title or kind.replace("_", " ")
        titles.append(f"{title}: {row['joint_rms_deg']:.1f}° ({row['status']})")
    if motions:
        figure = strip_figure(motions, titles, view="travel", forces=True, paired=True)
    else:
        figure = blank_figure("no style was judged, see the log")
    save(figure, Path(snakemake.output.svg).with_suffix(""))
