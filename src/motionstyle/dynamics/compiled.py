"""The compiled functions of both orders, as every solver of spacetime problems needs them."""

from __future__ import annotations

from pathlib import Path

from motionstyle.dynamics.codegen import FrameFunction, load_functions
from motionstyle.dynamics.functions import dynamics_functions
from motionstyle.dynamics.second_order import second_order_functions


def load_compiled(code: str | Path, second_order: str | Path) -> dict[str, FrameFunction]:
    """Return first and second derivatives' functions from the files of the rule `dynamics_code`."""
    functions = load_functions(dynamics_functions, Path(code))
    return functions | load_functions(second_order_functions, Path(second_order))
