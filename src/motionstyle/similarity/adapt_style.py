"""The style terms of an adaptation, P and S: both models of the pairs (new, example) (§7)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from motionstyle.similarity.adapt_terms import (
    FIXED,
    WIDTH,
    full_coordinates,
    roots_of_weights,
)
from motionstyle.similarity.alignment import Segment
from motionstyle.similarity.blocks import Block, block_function
from motionstyle.similarity.features import (
    PART_NODES,
    POSTURES,
    posture_frames,
    whole_body_vector,
)
from motionstyle.similarity.footholds import Example, Footholds
from motionstyle.similarity.models import StyleModel
from motionstyle.similarity.symbolic_body import symbolic_pose

Array = NDArray[np.float64]


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
    residual = spread / settings["leakage"] * roots_of_weights(settings)[0]
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
    pose = symbolic_pose(body, full_coordinates(y, f))
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
