"""The program of one adaptation task (paper §4.2; specification §7).

Unknowns: six pelvis coordinates a frame and the standardised components of each leg segment. The
angles of the legs in each frame are unknowns too and tied to the components by linear equations,
y = ȳ + U Λ^(1/2) a resampled to the segment's own frames; so every other term touches few
unknowns. Minimised is P + C + Q of the paper in units of allowed errors; S ≥ 0 and V are
constraints. Trunk, head and arms keep the example's angles.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csc_matrix, vstack

from motionstyle.body.ranges import joint_ranges
from motionstyle.similarity.adapt_style import leg_style_block, whole_body_style_block
from motionstyle.similarity.adapt_terms import (
    MOVED,
    WIDTH,
    component_block,
    frame_block,
    initial_frames,
    smooth_block,
    torque_block,
)
from motionstyle.similarity.alignment import SIDE_OF_SET, Segment
from motionstyle.similarity.blocks import Program, assemble
from motionstyle.similarity.features import (
    LEG_DOF,
    SAMPLES,
    from_samples,
    leg_vector,
    to_samples,
)
from motionstyle.similarity.footholds import Example, Footholds
from motionstyle.similarity.leg_space import LegSpace
from motionstyle.similarity.models import StyleModel

Array = NDArray[np.float64]
_COLUMN = {"l": 6, "r": 6 + LEG_DOF}


@dataclass(frozen=True)
class LegPiece:
    """A leg segment, or what the window's border leaves of one, in frames of the window.

    `judged` tells whole segments, which the style terms see, from pieces, which they do not.
    """

    segment: Segment
    judged: bool


@dataclass(frozen=True)
class AdaptProblem:
    """A program with its start, bounds and the places of its variables.

    `pieces` are the leg pieces in the order of their components; `scores` name the style scores,
    one slack variable each.
    """

    program: Program
    start: Array
    lower: Array
    upper: Array
    pieces: tuple[LegPiece, ...]
    scores: tuple[str, ...]
    frames: int


def leg_pieces(example: Example) -> list[LegPiece]:
    """Return whole leg segments and the pieces before the first and after the last of each leg."""
    last = example.motion.frames - 1
    pieces = []
    for name in SIDE_OF_SET:
        own = [s for s in example.segments if s.set == name]
        if not own:
            pieces.append(LegPiece(Segment(name, 0, last, "piece"), judged=False))
            continue
        if own[0].first > 0:
            pieces.append(LegPiece(Segment(name, 0, own[0].first, "piece"), judged=False))
        previous = own[0].first
        for segment in own:
            if segment.first > previous:  # a segment too short to be kept lies between
                gap = Segment(name, previous, segment.first, "piece")
                pieces.append(LegPiece(gap, judged=False))
            pieces.append(LegPiece(segment, judged=True))
            previous = segment.last
        if previous < last:
            pieces.append(LegPiece(Segment(name, previous, last, "piece"), judged=False))
    return pieces


def build_problem(
    example: Example,
    holds: Footholds,
    spaces: Mapping[str, LegSpace],
    models: Mapping[str, StyleModel] | None,
    settings: Mapping[str, Any],
    components: int,
    features: int,
    marked: NDArray[np.bool_],
) -> AdaptProblem:
    """Return the program of a task; without models the style terms S and P are left out."""
    frames = example.motion.frames
    pieces = leg_pieces(example)
    sizes = [min(components, spaces[p.segment.set].size) for p in pieces]
    starts = frames * WIDTH + np.concatenate([[0], np.cumsum(sizes)]).astype(int)
    judged = [k for k, p in enumerate(pieces) if p.judged]
    whole = [s for s in example.segments if s.set == "whole_body"]
    scores = [f"whole_body {k}" for k in range(len(whole))] if models else []
    scores += [f"{pieces[k].segment.set} {k}" for k in judged] if models else []
    # the features of judged leg segments as their frames show them, one set of variables each
    shown = int(starts[-1]) + features * np.arange(len(judged) + 1 if models else 1)
    count = int(shown[-1]) + len(scores)
    blocks = [
        frame_block(example, holds, settings, marked),
        smooth_block(example, holds, settings),
        torque_block(example, holds, settings),
    ]
    components_start = [
        spaces[p.segment.set].standardise(leg_vector(example.motion, p.segment), size)
        for p, size in zip(pieces, sizes, strict=True)
    ]
    blocks.append(component_block(starts, components_start, settings))
    slack = int(shown[-1]) + np.arange(len(scores))
    if models:
        blocks.append(
            whole_body_style_block(
                example, holds, models["whole_body"], whole, slack[: len(whole)], settings
            )
        )
        for name in SIDE_OF_SET:
            own = [n for n, k in enumerate(judged) if pieces[k].segment.set == name]
            if not own:
                continue
            index = np.array([[*range(shown[n], shown[n + 1]), slack[len(whole) + n]] for n in own])
            halves = np.array([components_start[judged[n]][:features] for n in own])
            blocks.append(leg_style_block(name, models[name], index, halves, settings))
    equations = _subspace_equations(pieces, sizes, starts, spaces, count)
    if models:
        seen = [pieces[k].segment for k in judged]
        more = _feature_equations(seen, shown, spaces, features, count)
        equations = (
            vstack([equations[0], more[0]], format="csc"),
            np.append(*[e[1] for e in (equations, more)]),
        )
    linear, value = equations
    price = np.zeros(count)
    price[slack] = settings["slack_price"]
    program = assemble(count, blocks, linear, value, price, settings["caution"])
    begin = np.concatenate(
        [
            initial_frames(example, holds).ravel(),
            *components_start,
            *([components_start[k][:features] for k in judged] if models else []),
            np.zeros(len(scores)),
        ]
    )
    lower, upper = _bounds(example, count, slack, settings)
    return AdaptProblem(program, begin, lower, upper, tuple(pieces), tuple(scores), frames)


def _subspace_equations(
    pieces: Sequence[LegPiece],
    sizes: Sequence[int],
    starts: NDArray[np.int64],
    spaces: Mapping[str, LegSpace],
    count: int,
) -> tuple[csc_matrix, Array]:
    """Return A, b of A x = b: each frame's leg angles are those of its segments (C0 included)."""
    rows, columns, values, right = [], [], [], []
    number = 0
    for piece, size, start in zip(pieces, sizes, starts, strict=False):
        segment, space = piece.segment, spaces[piece.segment.set]
        frames = np.arange(segment.first, segment.last + 1)
        back = from_samples(len(frames))
        column = _COLUMN[SIDE_OF_SET[segment.set]]
        axes = (space.axes[:, :size] * space.deviations[:size]).reshape(LEG_DOF, SAMPLES, size)
        mean = space.mean.reshape(LEG_DOF, SAMPLES)
        for joint in range(LEG_DOF):
            matrix = back @ axes[joint]
            own = number + np.arange(len(frames))
            rows += [own, np.repeat(own, size)]
            columns += [frames * WIDTH + column + joint, np.tile(start + np.arange(size), len(own))]
            values += [np.ones(len(own)), -matrix.ravel()]
            right.append(back @ mean[joint])
            number += len(frames)
    matrix = coo_matrix(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), (number, count)
    )
    return matrix.tocsc(), np.concatenate(right)


def _feature_equations(
    segments: Sequence[Segment],
    shown: NDArray[np.int64],
    spaces: Mapping[str, LegSpace],
    features: int,
    count: int,
) -> tuple[csc_matrix, Array]:
    """Return A, b of A x = b: a leg segment's features are those of its own frames, resampled."""
    rows, columns, values, right = [], [], [], []
    for number, segment in enumerate(segments):
        space, frames = spaces[segment.set], np.arange(segment.first, segment.last + 1)
        column = _COLUMN[SIDE_OF_SET[segment.set]]
        sampling = to_samples(len(frames))
        axes = (space.axes[:, :features] / space.deviations[:features]).reshape(
            LEG_DOF, SAMPLES, features
        )
        own = features * number + np.arange(features)
        rows.append(own)
        columns.append(shown[number] + np.arange(features))
        values.append(np.ones(features))
        for joint in range(LEG_DOF):
            matrix = axes[joint].T @ sampling
            rows.append(np.repeat(own, len(frames)))
            columns.append(np.tile(frames * WIDTH + column + joint, features))
            values.append(-matrix.ravel())
        right.append(-(space.mean @ space.axes[:, :features]) / space.deviations[:features])
    shape = (features * len(segments), count)
    triplet = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    return coo_matrix(triplet, shape).tocsc(), np.concatenate(right)


def _bounds(
    example: Example, count: int, slack: NDArray[np.int64], settings: Mapping[str, Any]
) -> tuple[Array, Array]:
    """Return bounds of all variables: joint ranges, widened to the example's own, and slack ≥ 0."""
    margin = np.radians(settings["range_margin_deg"])
    angles = example.motion.coordinates
    low, high = joint_ranges().T
    low = np.minimum(low, angles.min(axis=0) - margin)[MOVED]
    high = np.maximum(high, angles.max(axis=0) + margin)[MOVED]
    lower, upper = np.full(count, -np.inf), np.full(count, np.inf)
    size = example.motion.frames * WIDTH
    lower[:size] = np.tile(low, example.motion.frames)
    upper[:size] = np.tile(high, example.motion.frames)
    lower[slack] = 0.0
    return lower, upper
