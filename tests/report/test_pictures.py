"""Published pictures are smaller and look the same."""

import io

import numpy as np
from PIL import Image

from motionstyle.report.pictures import small_png


def test_a_line_drawing_keeps_its_size_and_nearly_its_colours(tmp_path):
    pixels = np.full((80, 120, 3), 255, dtype=np.uint8)
    pixels[20:60, 40:44] = (0, 114, 178)
    pixels[30:34] = (213, 94, 0)
    Image.fromarray(pixels).save(tmp_path / "drawing.png")
    found = small_png(tmp_path / "drawing.png")
    with Image.open(io.BytesIO(found)) as small:
        assert small.size == (120, 80)
        again = np.asarray(small.convert("RGB")).astype(int)
    assert np.abs(again - pixels).max() <= 8
    assert found == small_png(tmp_path / "drawing.png")
