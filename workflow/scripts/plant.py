"""Make all planted variants of the embedded motions."""

from pathlib import Path

from motionstyle.errors import MotionStyleError
from motionstyle.jobs import job
from motionstyle.mocap.planted.planting import plant
from motionstyle.mocap.planted.variants import read_planted
from motionstyle.motion.storage import load_motion, save_failure, save_motion

with job(snakemake.log[0]):
    recipes = {recipe.id: recipe for recipe in read_planted(snakemake.input.catalogue)}
    files = {Path(file).stem: file for file in snakemake.input.motions}
    for path in snakemake.output.motions:
        recipe = recipes[Path(path).stem]
        try:
            save_motion(path, plant(load_motion(files[recipe.base]), recipe))
        except MotionStyleError as error:
            print(f"{recipe.id} failed: {error}")
            save_failure(path, recipe.id, "planted", str(error), example=recipe.base, planted=True)
