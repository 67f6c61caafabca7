"""From symbols to fast functions: generated C, compiled once, or CasADi's virtual machine.

The compiled library is kept in the user's cache under a digest of the generated code, the
compiler and its flags, so that it is built once a machine. Each function can be called on many
frames: a C loop takes as many at once as the processor's vectors hold (`dynamics.lanes`).
"""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from hashlib import sha256
from pathlib import Path

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from motionstyle.dynamics.lanes import in_lanes
from motionstyle.errors import MotionStyleError
from motionstyle.files import atomic_write, read_json, write_json

Array = NDArray[np.float64]
# Higher levels make the compiler take minutes; what counts is that eight frames go at once.
FLAGS = ("-O1", "-march=native", "-fno-math-errno", "-Wno-psabi", "-fPIC", "-shared")


def find_compiler() -> str | None:
    """Return the C compiler of this machine ($CC, cc or gcc), or None."""
    wanted = os.environ.get("CC")
    return next((c for c in (wanted, "cc", "gcc") if c and shutil.which(c)), None)


def generate_source(functions: Sequence[ca.Function]) -> str:
    """Return one C file with all functions and a loop over frames for each, lanes at a time."""
    with tempfile.TemporaryDirectory() as folder:
        generator = ca.CodeGenerator("functions.c", {"with_header": False})
        for function in functions:
            generator.add(function)
        generator.generate(folder + os.sep)
        source = (Path(folder) / "functions.c").read_text(encoding="utf-8")
    return in_lanes(source, [function.name() for function in functions])


def compile_library(
    functions: Sequence[ca.Function],
    destination: Path,
    cache: Path,
    log: Callable[[str], None],
) -> None:
    """Write `destination`, a JSON file that says where the compiled functions are, if anywhere.

    Parameters
    ----------
    functions : to be compiled. cache : folder that keeps libraries by digest.
    log : told whether a library was found, built, or is done without.

    Raises
    ------
    MotionStyleError
        If there is a compiler and it fails.
    """
    compiler = find_compiler()
    if compiler is None:
        log("no C compiler found: the virtual machine serves, some 20 times slower")
        write_json(destination, {"library": None, "compiler": None, "functions": {}})
        return
    library = compile_source(generate_source(functions), FLAGS, compiler, cache, log)
    signatures = {function.name(): asdict(Signature.of(function)) for function in functions}
    write_json(
        destination, {"library": str(library), "compiler": compiler, "functions": signatures}
    )


def compile_source(
    source: str, flags: Sequence[str], compiler: str, cache: Path, log: Callable[[str], None]
) -> Path:
    """Return the shared library made of C, from the cache if it was built there before.

    Raises
    ------
    MotionStyleError
        If the compiler fails.
    """
    version = subprocess.run(
        [compiler, "-march=native", "-Q", "--help=target", "--version"],
        capture_output=True, text=True, check=False,
    ).stdout  # fmt: skip
    digest = sha256("\0".join([source, version, *flags]).encode()).hexdigest()
    library = cache / "code" / f"{digest[:32]}.so"
    if library.exists():
        log(f"compiled before: {library.name}")
        return library
    log(f"compiling {len(source) / 1e6:.2g} MB of C with {compiler} {' '.join(flags)}")
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
    return library


@dataclass(frozen=True)
class Signature:
    """What a caller must know of a function: sizes of its arguments and results.

    inputs : nonzeros of each argument. rows, columns : of the nonzeros of each result.
    """

    name: str
    inputs: list[int]
    rows: list[list[int]]
    columns: list[list[int]]

    @staticmethod
    def of(function: ca.Function) -> Signature:
        """Return the signature of a CasADi function."""
        triplets = [function.sparsity_out(k).get_triplet() for k in range(function.n_out())]
        return Signature(
            str(function.name()),
            [function.nnz_in(i) for i in range(function.n_in())],
            [list(rows) for rows, _columns in triplets],
            [list(columns) for _rows, columns in triplets],
        )


@dataclass(frozen=True)
class FrameFunction:
    """A function of one frame that is called on many; arrays come back as (F, nonzeros).

    loop : the compiled loop over frames, or None. lanes : frames it takes at once. function : for
    the virtual machine, where there is no loop.
    """

    signature: Signature
    loop: Callable[..., int] | None
    lanes: int = 1
    function: ca.Function | None = None

    @property
    def name(self) -> str:
        """Name of the function."""
        return self.signature.name

    def pattern(self, output: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return rows and columns of an output's nonzeros, in the order they come back."""
        rows, columns = self.signature.rows[output], self.signature.columns[output]
        return np.array(rows, dtype=np.int64), np.array(columns, dtype=np.int64)

    def __call__(self, *arguments: Array) -> list[Array]:
        """Evaluate on arguments (F, n) or, the same for all frames, (n,)."""
        arrays = [np.ascontiguousarray(a, dtype=np.float64) for a in arguments]
        frames = next(len(a) for a in arrays if a.ndim == 2)
        for i, (array, size) in enumerate(zip(arrays, self.signature.inputs, strict=True)):
            if array.shape not in {(size,), (frames, size)}:
                wanted = f"({frames}, {size})"
                raise ValueError(f"{self.name}: argument {i} is {array.shape}, expected {wanted}")
        results = [np.zeros((frames, len(rows))) for rows in self.signature.rows]
        if self.loop is None:
            self._interpret(arrays, results, frames)
        else:
            self._run(arrays, results, frames)
        return results

    def _run(self, arrays: list[Array], results: list[Array], frames: int) -> None:
        def pointers(items: list[Array]) -> ctypes.Array:
            return (ctypes.c_void_p * len(items))(*(item.ctypes.data for item in items))

        def sizes(numbers: list[int]) -> ctypes.Array:
            return (ctypes.c_ssize_t * len(numbers))(*numbers)

        flag = self.loop(
            ctypes.c_ssize_t(frames),
            pointers(arrays),
            sizes([item.shape[1] if item.ndim == 2 else 0 for item in arrays]),
            sizes(self.signature.inputs),
            pointers(results),
            sizes([len(rows) for rows in self.signature.rows]),
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
    build: Callable[[], Sequence[ca.Function]], description: Path | None
) -> dict[str, FrameFunction]:
    """Return the functions by name, compiled if `description` names a library that exists.

    Parameters
    ----------
    build : returns the functions that were compiled; called only where there is no library,
        since the symbolic work takes seconds.
    description : what `compile_library` wrote, or None for the virtual machine.

    Raises
    ------
    MotionStyleError
        If another version of this package compiled them.
    """
    known = read_json(description) if description else {"library": None}
    where = known["library"]
    if where and Path(where).exists():
        library = ctypes.CDLL(where)
        if not all(hasattr(library, f"{name}_in_lanes") for name in known["functions"]):
            raise MotionStyleError(
                f"{description} names functions that another version compiled; delete it, so that "
                "the rule dynamics_code makes it anew"
            )
        return {
            name: FrameFunction(
                Signature(**fields), getattr(library, f"{name}_in_lanes"), library.lanes_count()
            )
            for name, fields in known["functions"].items()
        }
    return {f.name(): FrameFunction(Signature.of(f), None, function=f) for f in build()}
