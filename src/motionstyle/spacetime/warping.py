"""Motion warping, the baseline without dynamics of Liu et al. 2005, Fig. 7 (nio.md A8).

An example copied along new footprints is bent until its feet meet them: minimised over the control
points of cubic B-splines is Σ_t ‖q̈‖², "the smoothness of the motion", with the deviation from the
start as a regulariser, subject to the footprints, the ground and joint ranges, by damped
Gauss–Newton with stiff penalties. Smoothness and deviation together are a low-pass filter of the
motion: their weights are stated as its cut-off frequency.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.kinematics import (
    contact_points,
    coordinate_axes,
    forward_kinematics,
    point_jacobian,
)
from motionstyle.body.layout import CONTACT_POINT_NODES, COORDINATES
from motionstyle.errors import MotionStyleError
from motionstyle.motion.motion import Motion
from motionstyle.spacetime.foot_constraints import FootConstraints
from motionstyle.spacetime.splines import BandedSystem, SplineBasis

Array = NDArray[np.float64]
COUNT = len(COORDINATES)
_NODES = np.array(CONTACT_POINT_NODES)


@dataclass(frozen=True)
class WarpSettings:
    """Weights, each as the error it allows, and limits of the solver.

    smooth : whose q̈ is small: the "motion"'s, as in the paper, or the "displacement"'s from the
        start, as in the motion warping of Witkin and Popović 1995, which leaves the example's own
        footprints' motion as it is.
    cutoff_hz : movement faster than this is smoothed away (half of it at the cut-off itself).
    start_rad, start_m : deviation from the start, of joints and of the root's place.
    unobserved_rad : the same of joints that the example does not show, as toes often.
    foot_m : from footprints and ground. range_rad : excess over joint ranges.
    tolerance : relative fall of the cost at the end.
    """

    frames_per_knot: float = 2.0
    smooth: Literal["motion", "displacement"] = "motion"
    cutoff_hz: float = 6.0
    start_rad: float = 0.1
    start_m: float = 0.03
    unobserved_rad: float = 0.5
    foot_m: float = 3e-4
    range_rad: float = 0.002
    iterations: int = 200
    tolerance: float = 1e-5


@dataclass(frozen=True)
class Warp:
    """A warped motion and how the solver fared: status, iterations, seconds, cost."""

    motion: Motion
    report: dict[str, float | int | str]


@dataclass(frozen=True)
class _State:
    cost: float
    hessians: Array
    gradients: Array
    coordinates: Array


def warp(
    start: Motion,
    constraints: FootConstraints,
    ranges: Array,
    settings: WarpSettings | None = None,
    *,
    id: str | None = None,
    log: Callable[[str], None] = print,
) -> Warp:
    """Return the smoothest motion near a start whose feet keep to the constraints.

    Parameters
    ----------
    start : e.g. from `starts.copied_along`, of the body that is to move.
    ranges : lower and upper bounds of the coordinates, (35, 2), rad or m; may be infinite.
    id : of the new motion; the start's by default.

    Raises
    ------
    MotionStyleError
        If start and constraints differ in length, or are too short for splines.
    """
    settings = settings or WarpSettings()
    if constraints.frames != start.frames:
        raise MotionStyleError(
            f"motion {start.id}: {start.frames} frames, but constraints of {constraints.frames}"
        )
    if start.frames < 8:
        raise MotionStyleError(f"motion {start.id}: {start.frames} frames are too few, need 8")
    began = perf_counter()
    basis = SplineBasis.uniform(start.frames, start.rate_hz, settings.frames_per_knot)
    system = BandedSystem(basis, COUNT)
    controls = basis.fit(start.coordinates)

    own = basis.evaluate(controls)[2] if settings.smooth == "displacement" else 0.0

    def evaluated(at: Array) -> _State:
        q, _qd, qdd = basis.evaluate(at)
        return _evaluate(start, constraints, ranges, settings, q, qdd - own)

    state, damping, status, done = evaluated(controls), 1e-6, "not converged", 0
    while done < settings.iterations:
        done += 1
        band, gradient = system.assemble(state.hessians, state.gradients)
        scale = band[-1].mean()
        new = state
        while damping < 1e6:
            trial = controls + system.solve(band, gradient, np.full(band.shape[1], damping * scale))
            new = evaluated(trial)
            if new.cost <= state.cost:
                break
            damping *= 10
        if new.cost > state.cost:
            break
        fall = (state.cost - new.cost) / max(state.cost, 1e-12)
        controls, state, damping = trial, new, max(damping / 10, 1e-12)
        if fall < settings.tolerance:
            status = "converged"
            break
    log(f"warp {start.id}: {status} after {done} iterations, cost {state.cost:.6g}")
    motion = replace(
        start,
        id=id or start.id,
        coordinates=state.coordinates,
        contacts=constraints.held,
        contact_normals=constraints.normals,
        contact_forces=None,
        rebranched=(),
        provenance={**start.provenance, "variant": "warped", "solver_status": status},
    )
    seconds = perf_counter() - began
    report: dict[str, float | int | str] = {
        "status": status,
        "iterations": done,
        "seconds": seconds,
        "cost": state.cost,
    }
    return Warp(motion, report)


def _evaluate(
    start: Motion,
    feet: FootConstraints,
    ranges: Array,
    settings: WarpSettings,
    q: Array,
    qdd: Array,
) -> _State:
    """Return cost, Gauss–Newton Hessians (F, 105, 105) and gradients (F, 105) per frame."""
    allowed = np.where(start.observed, settings.start_rad, settings.unobserved_rad)
    allowed[:3] = settings.start_m
    deviation_weight = 1 / allowed**2
    smooth_weight = deviation_weight / (2 * np.pi * settings.cutoff_hz) ** 4
    away = q - start.coordinates
    below, above = np.minimum(q - ranges[:, 0], 0.0), np.maximum(q - ranges[:, 1], 0.0)
    range_weights = np.where((below < 0) | (above > 0), 1 / settings.range_rad**2, 0.0)
    misses, jacobian = _foot_misses(start, feet, q)
    foot_weight = 1 / settings.foot_m**2
    frames = len(q)
    hessians = np.zeros((frames, 3 * COUNT, 3 * COUNT))
    gradients = np.zeros((frames, 3 * COUNT))
    diagonal = np.arange(COUNT)
    hessians[:, :COUNT, :COUNT] = foot_weight * np.swapaxes(jacobian, 1, 2) @ jacobian
    hessians[:, diagonal, diagonal] += deviation_weight + range_weights
    hessians[:, 2 * COUNT + diagonal, 2 * COUNT + diagonal] = smooth_weight
    gradients[:, :COUNT] = deviation_weight * away + range_weights * (below + above)
    gradients[:, :COUNT] += foot_weight * np.einsum("frc,fr->fc", jacobian, misses)
    gradients[:, 2 * COUNT :] = smooth_weight * qdd
    cost = (deviation_weight * away**2).sum() + (smooth_weight * qdd**2).sum()
    cost += (range_weights * (below + above) ** 2).sum() + foot_weight * (misses**2).sum()
    return _State(float(cost), hessians, gradients, q)


def _foot_misses(start: Motion, feet: FootConstraints, q: Array) -> tuple[Array, Array]:
    """Return misses of held points, and depths of unheld ones, (F, 24), and slopes (F, 24, 35).

    Points held to a surface, and those that sink, miss along the normal only.
    """
    pose = forward_kinematics(start.body, q)
    points = contact_points(start.body, pose)
    slopes = point_jacobian(pose, coordinate_axes(pose, q), _NODES, points)
    heights = ((points - feet.ground) * feet.normals).sum(axis=-1)
    sunken = ~feet.held & (heights < feet.clearance)
    fixed = feet.held & ~feet.sliding
    depth = np.where(feet.held, heights, heights - feet.clearance)
    along = (feet.held & feet.sliding) | sunken
    misses = np.where(fixed[..., None], points - feet.targets, 0.0)
    misses[..., 0] = np.where(along, depth, misses[..., 0])
    normal_slopes = np.einsum("fpa,fpac->fpc", feet.normals, slopes)
    rows = np.where(fixed[..., None, None], slopes, 0.0)
    rows[:, :, 0] = np.where(along[..., None], normal_slopes, rows[:, :, 0])
    frames = len(q)
    return misses.reshape(frames, -1), rows.reshape(frames, -1, COUNT)
