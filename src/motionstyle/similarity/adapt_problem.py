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

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csc_matrix, vstack

from motionstyle.body.layout import COORDINATES, NODES
from motionstyle.body.ranges import joint_ranges
from motionstyle.similarity.alignment import SIDE_OF_SET, Segment
from motionstyle.similarity.blocks import Block, Program, assemble, block_function
from motionstyle.similarity.features import (
    LEG_COORDINATES,
    LEG_DOF,
    PART_NODES,
    POSTURES,
    SAMPLES,
    from_samples,
    leg_vector,
    posture_frames,
    to_samples,
    whole_body_vector,
)
from motionstyle.similarity.footholds import Example, Footholds
from motionstyle.similarity.leg_space import LegSpace
from motionstyle.similarity.models import StyleModel
from motionstyle.similarity.symbolic_body import symbolic_pose

Array = NDArray[np.float64]
GRAVITY = 9.81
MOVED = np.concatenate([np.arange(6), LEG_COORDINATES["l"], LEG_COORDINATES["r"]])
FIXED = np.setdiff1d(np.arange(len(COORDINATES)), MOVED)
WIDTH = len(MOVED)
_COLUMN = {"l": 6, "r": 6 + LEG_DOF}
CLEARANCE_M = 0.002


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


def _full(y: ca.SX, fixed: ca.SX) -> ca.SX:
    """Return all 35 coordinates from the moved (20) and the fixed ones (15)."""
    q = ca.SX.zeros(len(COORDINATES))
    q[MOVED.tolist()] = y
    q[FIXED.tolist()] = fixed
    return q


def _weights(settings: Mapping[str, Any]) -> tuple[float, float, float]:
    return tuple(
        float(np.sqrt(settings[f"{name}_weight"])) for name in ("style", "contact", "physics")
    )


def frame_block(
    example: Example, holds: Footholds, settings: Mapping[str, Any], marked: NDArray[np.bool_]
) -> Block:
    """Return C, the pull of the pelvis to its start, balance at marked frames, and clearance."""
    motion, frames = example.motion, example.motion.frames
    _, contact, physics = _weights(settings)
    y, p = ca.SX.sym("y", WIDTH), ca.SX.sym("p", len(FIXED) + 24 + 8 + 6 + 3)
    fixed, targets, on, pelvis, balance = ca.vertsplit(
        p, np.cumsum([0, len(FIXED), 24, 8, 6, 3]).tolist()
    )
    pose = symbolic_pose(motion.body, _full(y, fixed))
    misses = (ca.vec(pose.points) - targets) / settings["contact_m"]
    misses *= ca.vec(ca.repmat(on.T, 3, 1)) * contact
    pull = y[:6] - pelvis
    weights = ca.DM(motion.body.masses / motion.body.mass)
    centre = pose.coms @ weights
    lean = balance[2] * (centre[[0, 2]] - balance[:2]) / settings["balance_m"] * physics
    residuals = ca.vertcat(
        misses, pull[:3] / settings["pelvis_m"], pull[3:] / settings["pelvis_rad"], lean
    )
    clearance = (pose.points[1, :] - holds.surface.symbolic(pose.points)).T
    parameters = np.hstack(
        [
            motion.coordinates[:, FIXED],
            holds.targets.reshape(frames, 24),
            holds.bearing.astype(float),
            holds.pelvis,
            holds.centres[:, [0, 2]],
            marked[:, None].astype(float),
        ]
    )
    function = block_function("frame", y, p, residuals, clearance)
    index = np.arange(frames * WIDTH).reshape(frames, WIDTH)
    lower = np.full((frames, 8), -CLEARANCE_M)
    upper = np.full((frames, 8), np.inf)
    return Block("contact", function, index, parameters, lower, upper)


def smooth_block(example: Example, holds: Footholds, settings: Mapping[str, Any]) -> Block:
    """Return how the second difference of each moved coordinate departs from the start's.

    It keeps what no other term sees smooth, and equal velocities at segment borders (C1).
    """
    frames = example.motion.frames
    z, p = ca.SX.sym("z", 3 * WIDTH), ca.SX.sym("p", WIDTH)
    bend = z[:WIDTH] - 2 * z[WIDTH : 2 * WIDTH] + z[2 * WIDTH :] - p
    unit = np.concatenate([np.full(3, settings["smooth_m"]), np.full(17, settings["smooth_rad"])])
    function = block_function("smooth", z, p, bend / unit, ca.SX(0, 1))
    begin = initial_frames(example, holds)
    parameters = begin[:-2] - 2 * begin[1:-1] + begin[2:]
    index = np.arange(frames * WIDTH).reshape(frames, WIDTH)
    index = np.hstack([index[:-2], index[1:-1], index[2:]])
    empty = np.zeros((frames - 2, 0))
    return Block("smoothness", function, index, parameters, empty, empty)


def torque_block(example: Example, holds: Footholds, settings: Mapping[str, Any]) -> Block:
    """Return Q₁: the horizontal moment about the centre of support beyond m g · half a foot.

    Segments count as point masses at their centres; in flight the moment is about the body's
    centre of mass and without gravity.
    """
    body, frames = example.motion.body, example.motion.frames
    physics = _weights(settings)[2]
    z = ca.SX.sym("z", 3 * WIDTH)
    p = ca.SX.sym("p", 3 * len(FIXED) + 4)
    parts = ca.vertsplit(p, [0, *(len(FIXED) * k for k in (1, 2, 3)), 3 * len(FIXED) + 4])
    poses = [
        symbolic_pose(body, _full(z[k * WIDTH : (k + 1) * WIDTH], parts[k])).coms for k in range(3)
    ]
    rate = example.motion.rate_hz
    acceleration = (poses[0] - 2 * poses[1] + poses[2]) * rate**2
    support, flight = parts[3][:3], parts[3][3]
    centre = poses[1] @ ca.DM(body.masses / body.mass)
    about = flight * centre + (1 - flight) * support
    total = ca.SX.zeros(3)
    for i in range(len(NODES)):
        load = acceleration[:, i] + (1 - flight) * ca.DM([0, GRAVITY, 0])
        total += body.masses[i] * ca.cross(poses[1][:, i] - about, load)
    points = body.geometry.contact_points
    foot = abs(points[0, 0] - (body.joint_offsets[NODES.index("toes_r"), 0] + points[3, 0]))
    largest = body.mass * GRAVITY * foot / 2
    # the hinge max(0, ‖τ‖ − τ_max) as a vector along τ, rounded over a quarter of τ_max, so that
    # Gauss and Newton's Hessian holds on both sides of the kink
    level = total[[0, 2]] / largest
    size = ca.sqrt(ca.sumsqr(level) + 1e-4)
    excess = (size - 1 + ca.sqrt((size - 1) ** 2 + 0.06)) / 2
    residual = excess / size * level / settings["torque_share"] * physics
    function = block_function("torque", z, p, residual, ca.SX(0, 1))
    fixed = example.motion.coordinates[:, FIXED]
    parameters = np.hstack(
        [fixed[:-2], fixed[1:-1], fixed[2:], holds.centres[1:-1], holds.flight[1:-1, None]]
    )
    index = np.arange(frames * WIDTH).reshape(frames, WIDTH)
    index = np.hstack([index[:-2], index[1:-1], index[2:]])
    empty = np.zeros((frames - 2, 0))
    return Block("torque", function, index, parameters, empty, empty)


def _kernel(model: StyleModel, features: ca.MX, gamma: float) -> ca.MX:
    """Return k of raw features (n) and all training patterns, (I)."""
    scaled = (features - ca.DM(model.scaling.mean)) / ca.DM(model.scaling.deviation)
    patterns = ca.DM(model.patterns)
    squared = ca.sum2(patterns**2) + ca.sumsqr(scaled) - 2 * patterns @ scaled
    return ca.exp(-gamma * squared)


def model_expressions(model: StyleModel, features: ca.MX) -> tuple[ca.MX, ca.MX]:
    """Return f_s divided by |ρ|, and leak(p), of raw features (n), for CasADi."""
    svm = _kernel(model, features, model.svm_gamma)
    score = (ca.dot(ca.DM(model.alphas), svm) - model.rho) / abs(model.rho)
    kernel = _kernel(model, features, model.gamma)
    mean = ca.sum1(kernel) / len(model.patterns)
    centred = kernel - mean - ca.DM(model.column_means) + model.grand_mean
    leak = 1 - 2 * mean + model.grand_mean - ca.sumsqr(ca.DM(model.axes).T @ centred)
    return score, leak


def _own_part(joined: Array) -> Array:
    """Return the entries of a pair's features that belong to its first segment."""
    half = len(joined) // 2
    if half != 9 * POSTURES:
        return joined[:half]
    return joined.reshape(POSTURES, 2, 9)[:, 0].ravel()


def _style_functions(
    name: str,
    z: ca.MX,
    p: ca.MX,
    model: StyleModel,
    own: ca.MX,
    other: ca.MX,
    slack: ca.MX,
    settings: Mapping[str, Any],
) -> tuple[ca.Function, ca.Function]:
    """Return the block of one pair, residual √w_p d_s and constraint f_s + slack ≥ 0, twice.

    own, other : both halves of the features, functions of z and p. The second function is the
    Hessian of the block's Lagrangian, kept positive semidefinite: the convex part of f_s, and
    Gauss–Newton's for d_s and for the features as functions of z.
    """
    a, b = ca.MX.sym("a", own.shape[0]), ca.MX.sym("b", own.shape[0])
    score, leak = model_expressions(model, _joined(a, b))
    values = ca.Function("values", [a, b], [score, leak])
    found, spread = values(own, other)
    residual = spread / settings["leakage"] * _weights(settings)[0]
    block = block_function(name, z, p, residual, found + slack)
    lam, factor = ca.MX.sym("lam", 1), ca.MX.sym("factor")
    # of λ∇²f_s the part that is convex for λ ≤ 0, −2Γ Σ α k I in scaled features
    weights = _own_part(1 / model.scaling.deviation**2)
    total = ca.dot(ca.DM(model.alphas), _kernel(model, _joined(own, other), model.svm_gamma))
    stiff = 2 * model.svm_gamma / abs(model.rho) * total * ca.fmax(-lam, 0)
    slope, steep = ca.jacobian(own, z), ca.jacobian(residual, z)
    curved = slope.T @ (ca.repmat(ca.DM(weights), 1, z.shape[0]) * slope)
    hessian = stiff * curved + factor * steep.T @ steep
    return block, ca.Function(f"{name}_hessian", [z, p, lam, factor], [ca.densify(hessian)])


def _joined(own: ca.MX, other: ca.MX) -> ca.MX:
    """Return the features of a pair as `features.pair_vector` puts them together."""
    if own.shape[0] != 9 * POSTURES:
        return ca.vertcat(own, other)
    return ca.vec(ca.vertcat(ca.reshape(own, 9, POSTURES), ca.reshape(other, 9, POSTURES)))


def leg_style_block(
    name: str,
    model: StyleModel,
    index: NDArray[np.int64],
    halves: Array,
    settings: Mapping[str, Any],
) -> Block:
    """Return P and S of leg segments; z = 15 components of the new segment and its slack."""
    count = halves.shape[1]
    z, p = ca.MX.sym("z", count + 1), ca.MX.sym("p", count)
    functions = _style_functions(name, z, p, model, z[:count], p, z[count], settings)
    lower = np.zeros((len(index), 1))
    return Block(name, functions[0], index, halves, lower, lower + np.inf, functions[1])


def whole_body_style_block(
    example: Example,
    holds: Footholds,
    model: StyleModel,
    segments: Sequence[Segment],
    slack: NDArray[np.int64],
    settings: Mapping[str, Any],
) -> Block:
    """Return P and S of whole-body segments; z = K postures, the middle's pelvis turn, slack."""
    body = example.motion.body
    y, f = ca.SX.sym("y", WIDTH), ca.SX.sym("f", len(FIXED))
    pose = symbolic_pose(body, _full(y, f))
    parts = [pose.coms @ ca.DM(own * body.masses / (own * body.masses).sum()) for own in PART_NODES]
    centre = pose.coms @ ca.DM(body.masses / body.mass)
    posture = ca.Function("posture", [y, f], [ca.horzcat(*parts), centre, pose.forward])
    size, extra = POSTURES * WIDTH, 54 + POSTURES
    z = ca.MX.sym("z", size + WIDTH + 1)
    p = ca.MX.sym("p", (POSTURES + 1) * len(FIXED) + extra)
    found = [
        posture(z[k * WIDTH : (k + 1) * WIDTH], p[k * len(FIXED) : (k + 1) * len(FIXED)])
        for k in range(POSTURES + 1)
    ]
    other, levels = p[(POSTURES + 1) * len(FIXED) : -POSTURES], p[-POSTURES:]
    forward = found[-1][2]
    length = ca.sqrt(forward[0] ** 2 + forward[2] ** 2)
    c, s = -forward[0] / length, -forward[2] / length
    first = found[0][1]
    own = []
    for k in range(POSTURES):
        origin = ca.vertcat(first[0], levels[k], first[2])
        local = (found[k][0] - ca.repmat(origin, 1, 3)) / body.leg_length
        x, up, side = local[0, :], local[1, :], local[2, :]
        own.append(ca.vec(ca.vertcat(c * x + s * side, up, c * side - s * x)))
    functions = _style_functions(
        "whole_body", z, p, model, ca.vertcat(*own), other, z[size + WIDTH], settings
    )
    indices, parameters = [], []
    fixed = example.motion.coordinates[:, FIXED]
    for segment, own_slack in zip(segments, slack, strict=True):
        frames = posture_frames(segment.first, segment.last)
        middle = middle_frame(segment)
        chosen = np.append(frames, middle)
        index = (chosen[:, None] * WIDTH + np.arange(WIDTH)).ravel()
        indices.append(np.append(index, own_slack))
        half = whole_body_vector(example.motion, segment)
        parameters.append(np.concatenate([fixed[chosen].ravel(), half, holds.support[frames]]))
    lower = np.zeros((len(indices), 1))
    return Block(
        "whole_body",
        functions[0],
        np.array(indices),
        np.array(parameters),
        lower,
        lower + np.inf,
        functions[1],
    )


def middle_frame(segment: Segment) -> int:
    """Return the frame whose heading turns a segment's features."""
    return (segment.first + segment.last) // 2


def initial_frames(example: Example, holds: Footholds) -> Array:
    """Return the start of the moved coordinates: the example's legs below the carried pelvis."""
    return np.hstack([holds.pelvis, example.motion.coordinates[:, MOVED[6:]]])


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
    blocks.append(_component_block(starts, components_start, settings))
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


def _component_block(
    starts: NDArray[np.int64], begin: Sequence[Array], settings: Mapping[str, Any]
) -> Block:
    """Return a weak pull of each component to the example's."""
    z, p = ca.SX.sym("z", 1), ca.SX.sym("p", 1)
    function = block_function("pull", z, p, (z - p) / settings["component"], ca.SX(0, 1))
    index = np.arange(starts[0], starts[-1])[:, None]
    empty = np.zeros((len(index), 0))
    return Block("components", function, index, np.concatenate(begin)[:, None], empty, empty)


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
