"""Is a clip plausible? Scale, up axis, frame rate, single-frame flips, frozen stretches."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from motionstyle.mocap.formats.clip import SkeletonClip
from motionstyle.mocap.formats.text import Problems
from motionstyle.mocap.skeletons.faults import (
    ClipWarning,
    find_flips,
    find_frozen,
    find_jumps,
    frame_list,
    repair_flips,
    runs,
)

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "inch": 0.0254, "cmu": 0.0254 / 0.45}
"""Metres per unit of the files at hand; `cmu` is the Acclaim length of 0.45 inch."""

_HEIGHT_M = (1.0, 2.3)
_LIMB_SPEED, _PELVIS_SPEED = 25.0, 13.0
_COMMON_RATES = (15, 16, 20, 24, 25, 30, 48, 50, 60, 90, 100, 120, 200, 240)
_GRAVITY = 9.81
_BLEND_S = 0.1
_LEG = re.compile("foot|toe|ankle|heel|shin|tibia|knee|lowleg|lowerleg", re.IGNORECASE)
_HEAD = re.compile("head|skull", re.IGNORECASE)
_NECK = re.compile("neck", re.IGNORECASE)


def check_clip(
    clip: SkeletonClip, *, unit_m: float = 1.0, lying: bool = False, repair: bool = False
) -> tuple[SkeletonClip, tuple[ClipWarning, ...]]:
    """Check a clip that was converted to metres and y up, and repair it on request.

    Refused are: numbers that are not finite; a body that is not 1.0 to 2.3 m long, measured
    along its bones from the end of a leg to the end of the head, which does not depend on
    the pose; a body that in most frames lies along or hangs down an axis other than +y and
    whose zero pose does not stand along +y either; a joint faster than 25 m/s or the pelvis
    faster than 13 m/s over more than 2 frames, and jumps in which the body falls as it would
    at another frame rate; single-frame flips (a joint turned by more than 120 degrees for one
    frame); 0.25 s or more of one and the same pose inside the clip, or a clip that never moves.

    Parameters
    ----------
    clip : in metres, y up.
    unit_m : metres per unit of the file that were applied, to name a better unit.
    lying : whether the body is meant to lie or crawl, so that its direction proves nothing.
    repair : interpolate single-frame flips and let frozen stretches pass; both come back as
        warnings.

    Returns
    -------
    tuple
        The clip, repaired if that was asked for and needed, and the warnings: `lying`, `jump`
        (a turn of more than 120 degrees, or a pelvis faster than 13 m/s, for a moment), `flip`
        (of fingers only), `frozen` (the first or last frames) and `repaired`.

    Raises
    ------
    MotionStyleError
        Lists everything that is refused, with joints and frames (counted from 0).
    """
    problems = Problems(clip.source)
    _check_finite(clip, problems)
    problems.stop()
    warnings: list[ClipWarning] = []
    _check_scale(clip, unit_m, problems)
    if not lying:
        _check_up(clip, problems, warnings)
    problems.stop()
    _check_speed(clip, problems, warnings)
    _check_fall(clip, problems)
    flips = find_flips(clip)
    if flips and repair:
        clip = repair_flips(clip, flips)
        found = ", ".join(f"{clip.joints[joint]} in frame {frame}" for frame, joint in flips)
        frames = tuple(sorted({frame for frame, _ in flips}))
        warnings.append(ClipWarning("repaired", f"{len(flips)} flips repaired: {found}", frames))
    else:
        for frame, joint in flips:
            text = f"joint '{clip.joints[joint]}' flips for one frame"
            if _is_finger(clip.joints[joint]):
                warnings.append(ClipWarning("flip", text, (frame,)))
            else:
                hint = "cut it out or ask for repair"
                problems.add(None, f"frame {frame}: {text} ({hint})")
    warnings.extend(find_jumps(clip, flips))
    for first, last in find_frozen(clip):
        text = f"frames {first} to {last} are one and the same pose"
        at_edge = first == 0 or last == clip.frames - 1
        if first == 0 and last == clip.frames - 1:
            problems.add(None, f"{text}: nothing moves in this clip")
        elif at_edge or repair:
            warnings.append(ClipWarning("frozen", text, tuple(range(first, last + 1))))
        else:
            problems.add(None, f"{text}: the recording stood still; cut it out")
    problems.stop()
    return clip, tuple(warnings)


def body_length(clip: SkeletonClip) -> float:
    """Return the length of the bones from a leg's end to the head's end, m.

    The median over the frames of the longest such path. Joints are told by their names; where
    these say nothing, 0.8 times the longest path between any two ends (an arm's and a leg's,
    as a rule) stands in, which is right within some 15 %.
    """
    legs, heads = _ends(clip, _LEG), _head_ends(clip)
    if legs and heads:
        return max(_path(clip, leg, head) for leg in legs for head in heads)
    ends = _ends(clip, re.compile(""))
    return 0.8 * max((_path(clip, one, two) for one in ends for two in ends), default=0.0)


def pelvis_joint(clip: SkeletonClip) -> int:
    """Return the joint where the chains of all legs and the head meet, the root if unclear."""
    chains = [_chain(clip, end) for end in (*_ends(clip, _LEG), *_head_ends(clip))]
    shared = set(chains[0]).intersection(*chains[1:]) if len(chains) > 2 else {0}
    return max(shared)


def _check_finite(clip: SkeletonClip, problems: Problems) -> None:
    """Note frames with numbers that are not finite, or a clip without frames."""
    if clip.frames == 0:
        problems.add(None, "the clip has no frames")
        return
    good = np.isfinite(clip.positions).all(2) & np.isfinite(clip.rotations).all((2, 3))
    for joint in np.flatnonzero(~good.all(0)):
        frames = np.flatnonzero(~good[:, joint])
        name = clip.joints[joint]
        problems.add(None, f"joint '{name}' is not finite in frames {frame_list(frames)}")


def _check_scale(clip: SkeletonClip, unit_m: float, problems: Problems) -> None:
    """Note an implausible body length and the units that would make it plausible."""
    length = body_length(clip)
    low, high = _HEIGHT_M
    if low <= length <= high:
        return
    raw = length / unit_m
    better = [name for name, factor in UNITS.items() if low <= raw * factor <= high]
    advice = (
        "; plausible as " + " or ".join(f"'{name}' ({raw * UNITS[name]:.2f} m)" for name in better)
        if better
        else "; no known unit makes it plausible"
    )
    problems.add(
        None,
        f"the body is {length:.3g} m long from foot to head, expected {low} to {high} m: "
        f"wrong unit{advice}",
    )


def _check_up(clip: SkeletonClip, problems: Problems, warnings: list[ClipWarning]) -> None:
    """Note a body that does not stand along +y, from feet to head."""
    legs, heads = _ends(clip, _LEG), _head_ends(clip)
    if not (legs and heads):
        return
    along = _directions(clip.positions[:, heads].mean(1) - clip.positions[:, legs].mean(1))
    median = np.median(along, axis=0)
    axis = int(np.abs(median).argmax())
    if abs(median[axis]) < 0.8 or (axis == 1 and median[1] > 0):
        return
    sign = "-" if median[axis] < 0 else "+"
    text = f"the body points along {sign}{'xyz'[axis]} from feet to head, not along +y"
    rest = clip.rest_positions()
    if _directions(rest[heads].mean(0) - rest[legs].mean(0))[1] > 0.7:
        warnings.append(ClipWarning("lying", f"{text}, in most frames", ()))
    else:
        problems.add(
            None, f"{text}, in most frames: wrong up axis? If it is meant to lie, say so (lying)"
        )


def _check_speed(clip: SkeletonClip, problems: Problems, warnings: list[ClipWarning]) -> None:
    """Note speeds no body reaches over more than 2 frames; warn of the pelvis' shorter jumps.

    Up to 0.1 s at either end of the clip only warns: many files blend in from a T-pose.
    """
    speed = np.linalg.norm(np.diff(clip.positions, axis=0), axis=2) * clip.rate_hz
    pelvis, steps = pelvis_joint(clip), clip.frames - 1
    limits = np.full(len(clip.joints), _LIMB_SPEED)
    limits[pelvis] = _PELVIS_SPEED
    short: set[int] = set()
    found: list[tuple[float, int, int, int]] = []
    for joint in range(len(clip.joints)):
        for first, last in runs(speed[:, joint] > limits[joint]):
            count = last - first + 1
            edge = first == 0 or last == steps - 1
            if count > 2 and not (edge and count <= _BLEND_S * clip.rate_hz):
                ratio = float(speed[first : last + 1, joint].min() / limits[joint])
                found.append((ratio, joint, first, last + 1))
            elif joint == pelvis or count > 2:
                short.update(range(first, last + 2))
    if found:
        ratio, joint, first, last = max(found)
        others = len({one[1] for one in found}) - 1
        slower = [rate for rate in _COMMON_RATES if rate < clip.rate_hz / ratio]
        problems.add(
            None,
            f"frames {first} to {last}: joint '{clip.joints[joint]}'"
            + (f" (and {others} more)" if others else "")
            + f" stays above {limits[joint]:g} m/s at {clip.rate_hz:g} Hz: a lower frame rate"
            + (f", at most {slower[-1]} Hz?" if slower else "?"),
        )
    if short:
        text = "the body jumps, faster than a body moves: a blend from another pose?"
        warnings.append(ClipWarning("jump", text, tuple(sorted(short))))


def _check_fall(clip: SkeletonClip, problems: Problems) -> None:
    """Note jumps whose fall would be free at another frame rate.

    A jump is a run of 6 frames or more with every leg off the floor, in which the pelvis rises
    by 0.1 m or more above the ends of the run along a parabola (within 2 %) and the lowest foot
    goes up and down with it: a step over a block does not.
    """
    legs = _ends(clip, _LEG)
    if not legs:
        return
    clearance = clip.positions[:, legs, 1].min(axis=1)
    clearance = clearance - np.percentile(clearance, 5)
    height = clip.positions[:, pelvis_joint(clip), 1]
    for first, last in runs(clearance > 0.05):
        count = last - first + 1
        if count < 6:
            continue
        time = (np.arange(count) - (count - 1) / 2) / clip.rate_hz
        fit = np.polyfit(time, height[first : last + 1], 2)
        foot = np.polyfit(time, clearance[first : last + 1], 2)
        rise, foot_rise = -fit[0] * time[-1] ** 2, -foot[0] * time[-1] ** 2
        off = np.sqrt(np.mean((np.polyval(fit, time) - height[first : last + 1]) ** 2))
        if rise < 0.1 or foot_rise < 0.5 * rise or off > 0.02 * rise:
            continue
        factor = float(np.sqrt(_GRAVITY / (-2 * fit[0])))
        if not 0.75 < factor < 4 / 3:
            rate = min(_COMMON_RATES, key=lambda one: abs(np.log(one / clip.rate_hz / factor)))
            problems.add(
                None,
                f"frames {first} to {last}: in this jump the body falls at {-2 * fit[0]:.2g} m/s² "
                f"at {clip.rate_hz:g} Hz, expected {_GRAVITY}: wrong frame rate, "
                f"perhaps {rate} Hz?",
            )
            return


def _is_finger(name: str) -> bool:
    """Whether a joint is one of the fingers, whose channels are often noise."""
    return (
        re.search("thumb|finger|index|mid[0-9]|middle|ring|pinky", name, re.IGNORECASE) is not None
    )


def _chain(clip: SkeletonClip, joint: int) -> list[int]:
    """Return a joint and its ancestors up to the root."""
    chain = [joint]
    while clip.parents[chain[-1]] >= 0:
        chain.append(int(clip.parents[chain[-1]]))
    return chain


def _ends(clip: SkeletonClip, name: re.Pattern[str]) -> list[int]:
    """Return the joints without children that hang on, or are, a joint of that name."""
    leaves = sorted(set(range(len(clip.joints))) - {int(parent) for parent in clip.parents})
    return [one for one in leaves if any(name.search(clip.joints[at]) for at in _chain(clip, one))]


def _head_ends(clip: SkeletonClip) -> list[int]:
    """Return the ends of the head, or of a neck without one."""
    return _ends(clip, _HEAD) or _ends(clip, _NECK)


def _path(clip: SkeletonClip, one: int, two: int) -> float:
    """Return the median length of the bones between two joints, m."""
    bones = set(_chain(clip, one)) ^ set(_chain(clip, two))
    step = max(1, clip.frames // 100)
    poses = clip.positions[::step]
    return sum(
        float(np.median(np.linalg.norm(poses[:, at] - poses[:, clip.parents[at]], axis=1)))
        for at in bones
    )


def _directions(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Scale vectors to unit length; a zero vector stays."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)
