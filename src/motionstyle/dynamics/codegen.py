"""From symbols to fast functions: generated C, compiled once, or CasADi's virtual machine.

The compiled library is kept in the user's cache under a digest of the generated code, the
compiler and its flags, so that it is built once a machine. Each function can be called on many
frames at once: a C loop walks the frames with one stride per argument.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError
from motionstyle.files import atomic_write, read_json, write_json

Array = NDArray[np.float64]
FLAGS = ("-O3", "-march=native", "-fno-math-errno", "-fPIC", "-shared")
_DRIVER = """
#include <stddef.h>
int {name}_frames(ptrdiff_t count, const double** arg, const ptrdiff_t* arg_step, double** res,
    const ptrdiff_t* res_step, casadi_int* iw, double* w) {{
  const double* a[{n_in}]; double* r[{n_out}];
  for (ptrdiff_t t = 0; t < count; ++t) {{
    for (int i = 0; i < {n_in}; ++i) a[i] = arg[i] + t * arg_step[i];
    for (int i = 0; i < {n_out}; ++i) r[i] = res[i] ? res[i] + t * res_step[i] : 0;
    int flag = {name}(a, r, iw, w, 0);
    if (flag) return flag;
  }}
  return 0;
}}
"""


def find_compiler() -> str | None:
    """Return the C compiler of this machine ($CC, cc or gcc), or None."""
    wanted = os.environ.get("CC")
    return next((c for c in (wanted, "cc", "gcc") if c and shutil.which(c)), None)


def generate_source(functions: Sequence[ca.Function]) -> str:
    """Return one C file with all functions and a loop over frames for each."""
    with tempfile.TemporaryDirectory() as folder:
        generator = ca.CodeGenerator("functions.c", {"with_header": False})
        for function in functions:
            generator.add(function)
        generator.generate(folder + os.sep)
        source = (Path(folder) / "functions.c").read_text(encoding="utf-8")
    drivers = [_DRIVER.format(name=f.name(), n_in=f.n_in(), n_out=f.n_out()) for f in functions]
    return source + "".join(drivers)


def compile_library(
    functions: Sequence[ca.Function],
    destination: Path,
    cache: Path,
    log: Callable[[str], None],
    flags: Sequence[str] = FLAGS,
) -> None:
    """Write `destination`, a JSON file that says where the compiled functions are, if anywhere.

    Parameters
    ----------
    functions : to be compiled. cache : folder that keeps libraries by digest.
    log : told whether a library was found, built, or is done without.
    flags : of the compiler.

    Raises
    ------
    MotionStyleError
        If there is a compiler and it fails.
    """
    source = generate_source(functions)
    compiler = find_compiler()
    if compiler is None:
        log("no C compiler found: the virtual machine serves, some 20 times slower")
        write_json(destination, {"library": None, "compiler": None})
        return
    version = subprocess.run(
        [compiler, "-march=native", "-Q", "--help=target", "--version"],
        capture_output=True, text=True, check=False,
    ).stdout  # fmt: skip
    digest = sha256("\0".join([source, version, *flags]).encode()).hexdigest()
    library = cache / "code" / f"{digest[:32]}.so"
    if library.exists():
        log(f"compiled before: {library.name}")
    else:
        log(f"compiling {len(source) / 1e6:.1f} MB of C with {compiler} {' '.join(flags)}")
        with tempfile.TemporaryDirectory() as folder:
            file, built = Path(folder) / "functions.c", Path(folder) / "functions.so"
            file.write_text(source, encoding="utf-8")
            done = subprocess.run(
                [compiler, *flags, str(file), "-o", str(built), "-lm"],
                capture_output=True, text=True, check=False,
            )  # fmt: skip
            if done.returncode:
                raise MotionStyleError(
                    f"the C compiler {compiler} failed ({done.stderr.strip()[-300:]}); mend it, or "
                    "run with CC= and no cc on the PATH to do without"
                )
            with atomic_write(library, "wb") as handle:
                handle.write(built.read_bytes())
        library.chmod(0o755)
        log(f"built {library.name}")
    write_json(destination, {"library": str(library), "compiler": compiler})


@dataclass(frozen=True)
class FrameFunction:
    """A function of one frame that is called on many.

    sparsities : of the outputs, as (rows, columns) of their nonzeros; arrays come back as
    (F, nonzeros).
    """

    function: ca.Function
    loop: Callable[..., int] | None

    @property
    def name(self) -> str:
        """Name of the function."""
        return str(self.function.name())

    def pattern(self, output: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return rows and columns of an output's nonzeros, in the order they come back."""
        sparsity = self.function.sparsity_out(output)
        rows, columns = sparsity.get_triplet()
        return np.array(rows, dtype=np.int64), np.array(columns, dtype=np.int64)

    def __call__(self, *arguments: Array) -> list[Array]:
        """Evaluate on arguments (F, n) or, the same for all frames, (n,)."""
        arrays = [np.ascontiguousarray(a, dtype=np.float64) for a in arguments]
        frames = next(len(a) for a in arrays if a.ndim == 2)
        sizes = [self.function.nnz_in(i) for i in range(self.function.n_in())]
        for i, (array, size) in enumerate(zip(arrays, sizes, strict=True)):
            if array.shape not in {(size,), (frames, size)}:
                wanted = f"({frames}, {size})"
                raise ValueError(f"{self.name}: argument {i} is {array.shape}, expected {wanted}")
        results = [
            np.zeros((frames, self.function.nnz_out(k))) for k in range(self.function.n_out())
        ]
        if self.loop is None:
            self._interpret(arrays, results, frames)
        else:
            self._run(arrays, results, frames)
        return results

    def _run(self, arrays: list[Array], results: list[Array], frames: int) -> None:
        def pointers(items: list[Array]) -> ctypes.Array:
            kind = ctypes.c_void_p * len(items)
            return kind(*(item.ctypes.data for item in items))

        def steps(items: list[Array]) -> ctypes.Array:
            kind = ctypes.c_ssize_t * len(items)
            return kind(*(item.shape[1] if item.ndim == 2 else 0 for item in items))

        integers = np.zeros(max(1, self.function.sz_iw()), dtype=np.int64)
        reals = np.zeros(max(1, self.function.sz_w()))
        flag = self.loop(
            ctypes.c_ssize_t(frames),
            pointers(arrays),
            steps(arrays),
            pointers(results),
            steps(results),
            ctypes.c_void_p(integers.ctypes.data),
            ctypes.c_void_p(reals.ctypes.data),
        )
        if flag:
            raise ArithmeticError(f"{self.name} failed with flag {flag}")

    def _interpret(self, arrays: list[Array], results: list[Array], frames: int) -> None:
        buffer, trigger = self.function.buffer()
        for t in range(frames):
            for i, array in enumerate(arrays):
                buffer.set_arg(i, memoryview(array if array.ndim == 1 else array[t]))
            for k, result in enumerate(results):
                buffer.set_res(k, memoryview(result[t]))
            trigger()


def load_functions(
    functions: Sequence[ca.Function], description: Path | None
) -> dict[str, FrameFunction]:
    """Return the functions by name, compiled if `description` names a library that exists.

    Parameters
    ----------
    functions : the same as were compiled.
    description : what `compile_library` wrote, or None for the virtual machine.
    """
    where = read_json(description)["library"] if description else None
    library = ctypes.CDLL(where) if where and Path(where).exists() else None
    found = {}
    for function in functions:
        loop = getattr(library, f"{function.name()}_frames") if library else None
        found[function.name()] = FrameFunction(function, loop)
    return found
