"""From a row of the sheet to everything a solver needs: footprints, body, ranges, feet, start."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.body import Body
from motionstyle.errors import MotionStyleError
from motionstyle.files import read_json
from motionstyle.motion.motion import Motion
from motionstyle.motion.resample import resample
from motionstyle.spacetime.captured_footprints import footprints_of
from motionstyle.spacetime.edits import (
    Edits,
    edit_body,
    edit_constraints,
    edit_ranges,
    into_ranges,
)
from motionstyle.spacetime.foot_constraints import FootConstraints
from motionstyle.spacetime.footprint_checks import check_footprints
from motionstyle.spacetime.footprint_constraints import to_constraints
from motionstyle.spacetime.footprints import Footprint, read_footprints
from motionstyle.spacetime.relay import (
    Ramp,
    Route,
    Stairs,
    arc,
    relay,
    resoled,
    sharp_turn,
    straight,
)
from motionstyle.spacetime.starts import copied_along
from motionstyle.spacetime.synthesis_sheet import FootprintSource, SynthesisRow

Array = NDArray[np.float64]

RATE_HZ = 30.0  # of the paper; clips with force plates are fitted at 60


@dataclass(frozen=True)
class Plan:
    """What is to be solved, but for style and solver.

    Attributes
    ----------
    example : the window of the motion that is copied.
    footprints : checked. feet : the same, frame by frame.
    body : edited. ranges : of the 35 coordinates, (35, 2), rad.
    copied : the example copied along the footprints, with the edited body.
    start : the same inside the ranges, from where solvers start.
    """

    example: Motion
    footprints: tuple[Footprint, ...]
    feet: FootConstraints
    body: Body
    ranges: Array
    copied: Motion
    start: Motion


def example_window(motion: Motion, row: SynthesisRow) -> Motion:
    """Return the row's window of a motion, at the paper's rate where its own is finer.

    Raises
    ------
    MotionStyleError
        If the window reaches beyond the motion.
    """
    first = row.first_frame or 0
    last = motion.frames - 1 if row.last_frame is None else row.last_frame
    if last >= motion.frames:
        raise MotionStyleError(
            f"synthesis {row.id}: last_frame is {last}, but {motion.id} ends at frame "
            f"{motion.frames - 1}"
        )
    window = motion.window(first, last)
    return resample(window, RATE_HZ) if window.rate_hz > RATE_HZ else window


def planned_footprints(
    row: SynthesisRow, example: Motion, source: Motion | None = None
) -> tuple[tuple[Footprint, ...], int]:
    """Return the row's footprints, checked, and how many frames they take.

    Parameters
    ----------
    example : its window. source : the motion whose footprints are taken, where that is another.

    Raises
    ------
    MotionStyleError
        If the body cannot follow them; the message names the rows.
    """
    wanted = row.footprints
    body = edit_body(example.body, row.edits)
    rate = example.rate_hz
    frames = example.frames
    if wanted.kind == "file":
        file = row.folder / wanted.text("path")
        found = read_footprints(file)
        frames = max(round(one.t_off * rate) for one in found)
        if wanted.slide:
            found = tuple(replace(one, slide=True) for one in found)
        check_footprints(found, body, frames, rate, name=file.name)
        return found, frames
    if wanted.kind == "captured":
        origin = source or example
        if origin.rate_hz != rate:
            raise MotionStyleError(
                f"synthesis {row.id}: {origin.id} has {origin.rate_hz:g} frames per second, "
                f"{example.id} {rate:g}"
            )
        own = footprints_of(origin)
        found = resoled(own, origin.body, rate, body, slide=wanted.slide)
        frames = origin.frames
    else:
        time_scale = wanted.number("time_scale")
        surface = None
        if wanted.kind == "ramp":
            surface = Ramp(wanted.number("slope_deg"), wanted.number("level_m"))
        elif wanted.kind == "stairs":
            surface = Stairs(wanted.number("tread_m"), wanted.number("rise_m"))
        found = relay(
            footprints_of(example),
            example.body,
            rate,
            _route(wanted),
            surface=surface,
            time_scale=time_scale,
            slide=wanted.slide,
            other_body=body,
        )
        frames = round(example.frames * time_scale)
    check_footprints(found, body, frames, rate, name=f"footprints of {row.id}")
    return found, frames


def _route(wanted: FootprintSource) -> Route:
    if wanted.kind == "arc":
        radius, side = wanted.number("radius_m"), wanted.text("side")
        return arc(radius, side, wanted.number("lead_m"), wanted.number("step_scale"))
    if wanted.kind == "turn":
        radius, side = wanted.number("radius_m"), wanted.text("side")
        scale, angle = wanted.number("turn_step_scale"), wanted.number("angle_deg")
        return sharp_turn(radius, side, wanted.number("lead_m"), scale, angle)
    if wanted.kind == "stairs":
        return straight()
    return straight(wanted.number("step_scale"))


def make_plan(
    row: SynthesisRow, example: Motion, footprints: Sequence[Footprint], frames: int
) -> Plan:
    """Return everything but the style: edited body and ranges, feet, and the start of §7.

    Swinging feet keep above clean ground, even where the captured ones sink into it: only for
    learning must the captured motion itself be feasible (`captured_constraints`).

    Parameters
    ----------
    example : its window, see `example_window`. footprints, frames : of `planned_footprints`.
    """
    edits: Edits = row.edits
    body = edit_body(example.body, edits)
    ranges = edit_ranges(example, edits)
    feet = to_constraints(footprints, body, frames, example.rate_hz)
    feet = edit_constraints(feet, edits)
    copied = copied_along(
        example, footprints, frames, example.rate_hz, id=f"{row.id}_copied", body=body
    )
    provenance = {
        **copied.provenance,
        "synthesis": row.id,
        "task": row.task,
        "style": row.style,
        "mood": row.mood,
    }
    copied = replace(copied, provenance=provenance)
    start = replace(copied, id=row.id, coordinates=into_ranges(copied.coordinates, ranges))
    return Plan(example, tuple(footprints), feet, body, ranges, copied, start)


def load_plan(row: SynthesisRow, example: Motion, table: str | Path, status: str | Path) -> Plan:
    """Return the plan of footprints that lie in files: their table, and whether they can be.

    Raises
    ------
    MotionStyleError
        If the footprints have failed their check, with its reason.
    """
    known = read_json(status)
    if known["status"] != "ok":
        raise MotionStyleError(known["reason"])
    return make_plan(row, example, read_footprints(table), int(known["frames"]))
