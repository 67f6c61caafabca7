"""The solver's innermost loops in C (`kernels.c`), compiled on first use, and how to call them."""

from __future__ import annotations

import ctypes
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.layout import CONTACT_POINTS, COORDINATES
from motionstyle.cache import cache_folder
from motionstyle.dynamics.codegen import compile_source, find_compiler

Array = NDArray[np.float64]
Whole = NDArray[np.intp]
SIZE, FORCES = len(COORDINATES), 4 * len(CONTACT_POINTS)
HIGH, WIDE = -(-SIZE // 4) * 4, -(-SIZE // 8) * 8  # of a block's memory: whole groups and vectors
FLAGS = (
    *("-O3", "-march=native", "-fno-math-errno", "-Wno-psabi", "-fPIC", "-shared"),
    *(f"-DN={SIZE}", f"-DMOST={FORCES}", f"-DHIGH={HIGH}", f"-DWIDE={WIDE}"),
)


@lru_cache(maxsize=1)
def compiled_kernels() -> ctypes.CDLL | None:
    """Return the compiled loops, built on first use, or None where there is no compiler.

    Raises
    ------
    MotionStyleError
        If there is a compiler and it fails.
    """
    compiler = find_compiler()
    if compiler is None:
        return None
    source = Path(__file__).with_suffix(".c").read_text(encoding="utf-8")
    return ctypes.CDLL(
        str(compile_source(source, FLAGS, compiler, cache_folder(), lambda _line: None))
    )


def scatter(numbers: Array, places: Whole, to: Array) -> None:
    """Put the first numbers of (F, n) to places of each frame's matrix of `to`.

    places : (m ≤ n,), in the matrix laid end to end. to : (F, rows, columns).
    """
    library = compiled_kernels()
    if library is None:
        to.reshape(len(to), -1)[:, places] = numbers[:, : len(places)]
    else:
        size = to.shape[1] * to.shape[2]
        sizes = plain(len(to), len(places), numbers.shape[1], size)
        library.scatter(*sizes, *plain(places, numbers, to))


def plain(*values: Array | Whole | float | int) -> list[ctypes._SimpleCData]:
    """Return arguments as C takes them.

    Raises
    ------
    ValueError
        If an array does not lie in memory without gaps.
    """
    found = []
    for value in values:
        if isinstance(value, np.ndarray):
            if not (value.flags.c_contiguous and value.dtype in (np.float64, np.intp)):
                raise ValueError("arrays for C must be contiguous, of 8-byte numbers")
            found.append(ctypes.c_void_p(value.ctypes.data))
        elif isinstance(value, float):
            found.append(ctypes.c_double(value))
        else:
            found.append(ctypes.c_ssize_t(value))
    return found
