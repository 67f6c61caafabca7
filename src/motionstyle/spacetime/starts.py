"""Where a synthesis starts from: an example copied along new footprints, and perturbed motions.

Liu et al. 2005, §7 (nio.md A6): a spline through the horizontal footstep coordinates is the root's
way, its tangent the heading, and at each time joint angles and root height come from the frame
of the example whose footsteps are most alike: here the same feet on the ground, at the same
share of that interval. The root's place beside the spline is copied too, so that an example's own
footprints give the example back.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, make_interp_spline

from motionstyle.body.body import Body
from motionstyle.body.layout import CONTACT_POINTS, JOINT_COORDINATES
from motionstyle.body.rotations import exponential, logarithm, slerp, unroll
from motionstyle.errors import MotionStyleError
from motionstyle.motion.motion import Motion
from motionstyle.motion.resample import lowpass
from motionstyle.spacetime.captured_footprints import footprints_of
from motionstyle.spacetime.foot_constraints import FootConstraints
from motionstyle.spacetime.footprint_constraints import PrintPose, print_poses, to_constraints
from motionstyle.spacetime.footprints import Footprint, print_axes, sole_of

Array = NDArray[np.float64]

SLOWEST_MPS = 0.15  # below this the spline's tangent is no heading
PERTURBATION_HZ = 1.5
_FEET = [[k for k, name in enumerate(CONTACT_POINTS) if name.endswith(f"_{s}")] for s in "rl"]


@dataclass(frozen=True)
class RootWay:
    """Where footprints lead the root.

    places : on the surface, (F, 3), m. headings : rad, (F,). climbs : rise per forward metre, (F,).
    """

    places: Array
    headings: Array
    climbs: Array


def root_way(footprints: Sequence[Footprint], body: Body, frames: int, rate_hz: float) -> RootWay:
    """Return the way of the root: a spline midway between successive prints of the two feet.

    It passes each midpoint halfway between the middles of the two stances. Heading is the
    tangent, left positive, and where the way stands still the mean yaw of the prints.

    Raises
    ------
    MotionStyleError
        If there are fewer than two stances.
    """
    poses = print_poses(footprints, body, rate_hz)
    if len(poses) < 2:
        raise MotionStyleError(f"{len(poses)} stance gives the root no way; need two")
    middles, centres = _stance_middles(poses, frames), []
    for pose in poses:
        forward, _right = print_axes(pose.yaw, pose.normal)
        centres.append(pose.heel + sole_of(body, pose.foot).points["toe"][0] / 2 * forward)
    order = np.argsort(middles, kind="stable")
    times, places = np.array(middles)[order], np.array(centres)[order]
    times, places = (times[1:] + times[:-1]) / 2, (places[1:] + places[:-1]) / 2
    keep = np.concatenate([[True], np.diff(times) > 1.0])
    times, places = times[keep], places[keep]
    t = np.arange(frames, dtype=float)
    if len(times) == 1:
        step = (centres[order[-1]] - centres[order[0]]) / max(
            middles[order[-1]] - middles[order[0]], 1.0
        )
        way = places + (t - times[0])[:, None] * step
        rates = np.broadcast_to(step, way.shape)
    else:
        spline = CubicSpline(times, places, bc_type="natural")
        inside = np.clip(t, times[0], times[-1])
        rates = spline(inside, 1)  # straight on beyond the ends
        way = spline(inside) + (t - inside)[:, None] * rates
    headings = np.arctan2(-rates[:, 2], rates[:, 0])
    still = np.hypot(rates[:, 0], rates[:, 2]) * rate_hz < SLOWEST_MPS
    if still.any():
        yaws = np.unwrap([np.radians(poses[k].yaw) for k in order])
        at = np.array(middles)[order] + np.arange(len(order)) * 1e-6
        headings = np.where(still, np.interp(t, at, yaws), headings)
    climbs = rates[:, 1] / np.maximum(np.hypot(rates[:, 0], rates[:, 2]), 0.1 / rate_hz)
    return RootWay(way, np.unwrap(headings), climbs)


def _stance_middles(poses: Sequence[PrintPose], frames: int) -> list[float]:
    """Return the middle frames of stances; one cut off by an end is taken as long as usual."""
    whole = [p.stop - p.first for p in poses if p.first > 0 and p.stop < frames]
    usual = float(np.median(whole)) if whole else 0.0
    middles = []
    for pose in poses:
        half = max(usual, pose.stop - pose.first) / 2
        if pose.first <= 0 and pose.stop < frames:
            middles.append(pose.stop - half)
        elif pose.stop >= frames and pose.first > 0:
            middles.append(pose.first + half)
        else:
            middles.append((pose.first + pose.stop) / 2)
    return middles


def feet_down(constraints: FootConstraints) -> NDArray[np.int64]:
    """Return which feet stand in each frame, (F,): 1 right, 2 left, 3 both, 0 none."""
    return _feet(constraints.held)


def _feet(contacts: NDArray[np.bool_]) -> NDArray[np.int64]:
    right, left = (contacts[:, columns].any(axis=1) for columns in _FEET)
    return right + 2 * left.astype(np.int64)


def _intervals(feet: NDArray[np.int64]) -> list[tuple[int, int, int]]:
    """Return (feet, first, stop) of each stretch of frames with the same feet down."""
    edges = np.concatenate([[0], np.flatnonzero(np.diff(feet)) + 1, [len(feet)]])
    return [(int(feet[a]), int(a), int(b)) for a, b in itertools.pairwise(edges)]


def matching_frames(example: NDArray[np.int64], wanted: NDArray[np.int64]) -> Array:
    """Return for each wanted frame the (fractional) frame of the example to copy, (F,).

    Both are feet on the ground per frame, see `feet_down`. Of the example's intervals with the
    same feet the one that follows the last copied interval is taken, else the one that follows
    it after the fewest others, from the beginning again if need be; within it, the same share of
    time. Feet the example never puts down together are copied from the time's own share.
    """
    source, target = _intervals(example), _intervals(wanted)
    frames = np.empty(len(wanted))
    pace = _pace(source, target)
    last = -1
    for kind, first, stop in target:
        same = [k for k, (other, _a, _b) in enumerate(source) if other == kind]
        if not same:
            share = np.arange(first, stop) / max(len(wanted) - 1, 1)
            frames[first:stop] = share * (len(example) - 1)
            continue
        whole = [k for k in same if 0 < k < len(source) - 1] or same
        if last < 0:  # the start of a movement is most like the start of the example
            chosen = same[0]
        else:
            # an interval cut off by the example's end only where the wanted one is as well
            candidates = same if stop == len(wanted) or last + 1 in same else whole
            chosen = min(candidates, key=lambda k: (k - last - 1) % len(source))
        _kind, a, b = source[chosen]
        frames[first:stop] = _same_share((first, stop, len(wanted)), (a, b, len(example)), pace)
        last = chosen
    return frames


def _pace(source: list[tuple[int, int, int]], target: list[tuple[int, int, int]]) -> float:
    """Return frames of the example per wanted frame, from whole intervals with the same feet."""
    lengths = [
        {kind: [b - a for k, a, b in found[1:-1] if k == kind] for kind in range(4)}
        for found in (source, target)
    ]
    ratios = [
        float(np.mean(lengths[0][kind]) / np.mean(lengths[1][kind]))
        for kind in range(4)
        if lengths[0][kind] and lengths[1][kind]
    ]
    return float(np.median(ratios)) if ratios else 1.0


def _same_share(wanted: tuple[int, int, int], own: tuple[int, int, int], pace: float) -> Array:
    """Return frames of an interval at the same share of time as those of a wanted one.

    Both are first frame, end and length of all. Intervals cut off by both beginnings are set
    together by their ends, and those cut off by both ends by their beginnings.
    """
    (first, stop, frames), (a, b, length) = wanted, own
    index = np.arange(first, stop)
    if first == 0 and a == 0 and stop < frames and b < length:
        return np.maximum(b - (stop - index) * pace, a)
    if stop == frames and b == length and first > 0 and a > 0:
        return np.minimum(a + (index - first) * pace, b - 1)
    share = (index - first + 0.5) / (stop - first)
    return np.clip(a + share * (b - a) - 0.5, a, b - 1)


def copied_along(
    example: Motion,
    footprints: Sequence[Footprint],
    frames: int,
    rate_hz: float,
    *,
    id: str,
    body: Body | None = None,
    on_the_way: bool = False,
) -> Motion:
    """Return the example copied along new footprints: the start of §7, and a baseline by itself.

    Parameters
    ----------
    example : at `rate_hz`.
    footprints : checked ones.
    frames : of the new motion.
    id : of the new motion, kind `warp`.
    body : whose motion it is to be; the example's by default. Root heights scale with the legs.
    on_the_way : put the root on the spline itself, as the paper does, not beside it.
    """
    body = body or example.body
    constraints = to_constraints(footprints, body, frames, rate_hz)
    new = root_way(footprints, body, frames, rate_hz)
    own = root_way(footprints_of(example), example.body, example.frames, example.rate_hz)
    source = matching_frames(_feet(example.contacts), feet_down(constraints))
    angles = make_interp_spline(np.arange(example.frames), example.coordinates, k=3)(source)
    scale = body.leg_length / example.body.leg_length
    beside = _turned(example.coordinates[:, :3] - own.places, -own.headings)
    beside[:, 1] -= own.climbs * beside[:, 0]
    relative = _yaw_matrices(-own.headings) @ exponential(example.coordinates[:, 3:6])
    clock = np.arange(example.frames, dtype=float)
    beside = make_interp_spline(clock, beside, k=3)(source) * [1, scale, 1]
    if on_the_way:
        beside[:, [0, 2]] = 0.0
    relative = slerp(relative, clock, np.clip(source, 0, example.frames - 1))
    angles[:, :3] = new.places + _turned(beside, new.headings)
    angles[:, 1] += new.climbs * beside[:, 0]
    angles[:, 3:6], jumps = unroll(logarithm(_yaw_matrices(new.headings) @ relative))
    return Motion(
        id=id,
        kind="warp",
        rate_hz=rate_hz,
        coordinates=angles,
        body=body,
        contacts=constraints.held,
        contact_normals=constraints.normals,
        observed=example.observed,
        rebranched=tuple(jumps),
        provenance={**example.provenance, "example": example.id, "variant": "copied"},
    )


def _yaw_matrices(headings: Array) -> Array:
    return exponential(np.outer(headings, [0.0, 1.0, 0.0]))


def _turned(vectors: Array, headings: Array) -> Array:
    return np.einsum("fab,fb->fa", _yaw_matrices(headings), vectors)


def perturbed(motion: Motion, seed: int, rms_deg: float = 10.0) -> Motion:
    """Return the motion with smooth noise of some rms (deg) on its 29 joint coordinates.

    White noise low-passed at 1.5 Hz, the same for the same seed; the root is left alone.
    """
    count = JOINT_COORDINATES.stop - JOINT_COORDINATES.start
    padding = round(2 * motion.rate_hz)
    noise = np.random.default_rng(seed).standard_normal((motion.frames + 2 * padding, count))
    smooth = lowpass(noise, motion.rate_hz, PERTURBATION_HZ)[padding : padding + motion.frames]
    smooth *= np.radians(rms_deg) / np.sqrt((smooth**2).mean())
    coordinates = motion.coordinates.copy()
    coordinates[:, JOINT_COORDINATES] += smooth
    provenance = {**motion.provenance, "perturbed_deg": rms_deg, "seed": seed}
    return replace(
        motion, id=f"{motion.id}_seed{seed}", coordinates=coordinates, provenance=provenance
    )
