"""`tables/style_parameters.csv`: every θ of every learnt style, beside others it is compared with.

Ratios are of the learnt values, run over walk and so on: infinite where only the other has none of
it, 1 where neither has. Those of rest angles would mean nothing and are differences in degrees
(columns `…_minus_…`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.nio.learning_table import STYLE_COLUMNS, style_cells
from motionstyle.nio.styles_sheet import StyleRow
from motionstyle.spacetime.style import JOINTS_29, SHOE_UNITS, UNITS, Style, load_style

# Names of nio.md, by those of a style's file.
SYMBOLS = {
    "preference": "alpha",
    "stiffness_above": "k_s1",
    "stiffness_below": "k_s2",
    "damping": "k_d",
    "rest_angle": "q_bar",
    "shoe_stiffness": "k_shoe",
    "shoe_rest_length": "h_bar",
}
COMPARISONS = ("run_over_walk", "sad_over_neutral", "happy_over_neutral", "angry_over_neutral")
DIFFERENCES = tuple(name.replace("over", "minus") + "_deg" for name in COMPARISONS)
PARAMETER_COLUMNS = (
    *("config", *STYLE_COLUMNS, "algorithm", "parameter", "joint", "side", "unit"),
    *("initial", "learnt", "change", "against", "against_learnt", *COMPARISONS, *DIFFERENCES),
)


def comparison(row: StyleRow, other: StyleRow) -> str | None:
    """Return the column that a style is compared with another one in, if there is one."""
    if row.action != other.action:
        name = f"{row.action}_over_{other.action}"
    else:
        name = f"{row.mood}_over_{other.mood}"
    return name if name in COMPARISONS else None


def style_parameter_rows(
    rows: Sequence[StyleRow],
    learnt: Mapping[tuple[str, str], Style],
    initial: Mapping[str, Style],
    config: str,
) -> list[dict[str, Any]]:
    """Return 147 rows per learnt style.

    Parameters
    ----------
    learnt : styles by id and algorithm. initial : where learning started from, by id.
    """
    by_id = {row.id: row for row in rows}
    found: list[dict[str, Any]] = []
    for (id, algorithm), style in learnt.items():
        row = by_id[id]
        other = learnt.get((row.against, algorithm)) if row.against else None
        column = comparison(row, by_id[row.against]) if row.against else None
        common = {
            "config": config,
            **style_cells(row),
            "algorithm": algorithm,
            "against": row.against if other is not None else None,
        }
        values, first = style.vector(), initial[id].vector()
        others = None if other is None else other.vector()
        for k, cells in enumerate(parameter_cells()):
            one = {**common, **cells, "initial": first[k], "learnt": values[k]}
            one["change"] = values[k] - first[k]
            if others is not None:
                one["against_learnt"] = others[k]
                if column is not None and cells["parameter"] == "q_bar":
                    difference = column.replace("over", "minus") + "_deg"
                    one[difference] = float(np.degrees(values[k] - others[k]))
                elif column is not None:
                    one[column] = _ratio(values[k], others[k])
            found.append(one)
    return found


def _ratio(own: float, other: float) -> float:
    if other > 0:
        return own / other
    return 1.0 if own == other else np.inf


def parameter_cells() -> list[dict[str, str]]:
    """Return parameter, joint, side and unit of the 147 numbers, in their order."""
    cells = []
    for kind, unit in UNITS.items():
        for joint in JOINTS_29:
            stem, _, side = joint.rpartition("_")
            sided = side in ("l", "r")
            cells.append(
                {
                    "parameter": SYMBOLS[kind],
                    "joint": stem if sided else joint,
                    "side": side if sided else "",
                    "unit": unit,
                }
            )
    cells += [{"parameter": SYMBOLS[k], "joint": "", "side": "", "unit": u}
              for k, u in SHOE_UNITS.items()]  # fmt: skip
    return cells


def load_styles(
    files: Sequence[str | Path], keys: Sequence[tuple[str, str]]
) -> dict[tuple[str, str], Style]:
    """Return the styles of files by their keys; those that were not learnt are left out."""
    found = {}
    for file, (id, algorithm) in zip(files, keys, strict=True):
        try:
            found[(id, algorithm)] = load_style(Path(file))
        except MotionStyleError as error:
            print(f"left out: {error}")
    return found
