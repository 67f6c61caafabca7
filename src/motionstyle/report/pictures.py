"""Pictures small enough to be kept in a repository."""

from __future__ import annotations

import io
from pathlib import Path

from PIL import Image

COLOURS = 64  # line drawings need no more, and take a quarter of the bytes


def small_png(file: str | Path) -> bytes:
    """Return a PNG file's picture with a palette of 64 colours, as the bytes of a PNG file."""
    with Image.open(file) as picture:
        small = io.BytesIO()
        picture.convert("RGB").quantize(COLOURS).save(small, "PNG", optimize=True)
    return small.getvalue()
