"""Making planted motions: a clean cycle of a real clip, edited by known parameters.

The order: phases (cadence, phase noise) → coordinates of the upper body (swing gain, posture,
noise) → pelvis and feet (step length, lift) → pelvis lowered where a leg does not reach → legs in
closed form → toes. Stances stay where they are planted, whatever the parameters.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.kinematics import contact_points, forward_kinematics
from motionstyle.body.layout import CONTACT_POINTS, COORDINATE_INDEX, COORDINATES, NODE_INDEX
from motionstyle.body.ranges import joint_ranges
from motionstyle.body.rotations import exponential
from motionstyle.errors import MotionStyleError
from motionstyle.mocap.fitting.floor import runs
from motionstyle.mocap.fitting.retarget import lift_toes, make_continuous
from motionstyle.mocap.planted.cycle import SourceCycle, source_cycle, turned
from motionstyle.mocap.planted.legs import Leg, hip_positions, needed_drop, smooth_drop, solve_leg
from motionstyle.mocap.planted.recipe import LEG_NAMES, PlantedRecipe, posture_offsets
from motionstyle.motion.motion import Motion

Array = NDArray[np.float64]
LARGEST_DROP_M = 0.12
# The pelvis sinks rather than let a knee be straighter (deg): near straight a knee jerks.
LEAST_KNEE_DEG = 10.0
NOISE_BAND_HZ = (0.3, 2.5)  # of pose noise
WARP_BAND_HZ = (0.2, 1.2)  # of phase noise
NOISE_M_PER_RAD = 0.3
SLOWEST = 0.4  # of the mean pace, under phase noise
LEEWAY_DEG = {"leg": 15.0, "other": 5.0}  # beyond the base's own range and the joint's
TOE_LIFTED_M = 0.01
TOE_SLIP_M = 0.004  # a tip that has moved farther from where it stood no longer bears
ARM_NAMES = ("shoulder", "elbow")


def plant(base: Motion, recipe: PlantedRecipe) -> Motion:
    """Return the planted motion of a recipe; same base and recipe, same bits.

    Parameters
    ----------
    base : a captured motion on a level floor, of recipe.base.

    Raises
    ------
    MotionStyleError
        If the base does not fit the recipe, or a parameter asks for what the body cannot do:
        a leg that does not reach, a joint beyond its range, time running backwards.
    """
    if base.id != recipe.base:
        raise MotionStyleError(f"planted {recipe.id}: the base is {base.id}, not {recipe.base}")
    _check_seen(base, recipe)
    cycle = source_cycle(base, recipe.cycle_frames, recipe.source_window)
    random = np.random.default_rng(recipe.seed)
    phases = _phases(cycle, recipe, base.rate_hz, random)
    q = cycle.sample(cycle.coordinates, phases)
    q[:, 0] = cycle.sample(cycle.coordinates[:, 0], phases, cycle.travel) * recipe.stride
    arms = [i for i, name in enumerate(COORDINATES) if name.startswith(ARM_NAMES)]
    mean = cycle.coordinates[cycle.one_cycle][:, arms].mean(axis=0)
    q[:, arms] = mean + recipe.swing_gain.get("arms", 1.0) * (q[:, arms] - mean)
    q += posture_offsets(recipe)
    noise = _smooth_noise(random, (len(q), 35 + 6), base.rate_hz, NOISE_BAND_HZ)
    noise *= np.radians(recipe.pose_noise_deg)
    legs = np.array([name.startswith(LEG_NAMES) for name in COORDINATES])
    noisy = base.observed & ~legs
    noisy[:3] = False
    q[:, noisy] += noise[:, :35][:, noisy]
    q[:, :3] += NOISE_M_PER_RAD * noise[:, :3]
    bearing = cycle.bearing_at(phases)
    ankles, feet = _feet(cycle, phases, recipe, NOISE_M_PER_RAD * noise[:, 35:].reshape(-1, 2, 3))
    q = _with_legs(base, recipe, q, ankles, feet)
    ground = np.zeros((len(q), len(CONTACT_POINTS)))
    q = _facing_x(base, lift_toes(base.body, q, ground))
    q, rebranched = make_continuous(q)
    _check_ranges(base, recipe, q)
    contacts = _with_toes(base, q, bearing)
    return Motion(
        id=recipe.id,
        kind="planted",
        rate_hz=base.rate_hz,
        coordinates=q,
        body=base.body,
        contacts=contacts,
        contact_normals=np.broadcast_to([0.0, 1.0, 0.0], (*contacts.shape, 3)).copy(),
        observed=base.observed,
        rebranched=rebranched,
        provenance=_provenance(base, cycle, recipe),
    )


def _phases(
    cycle: SourceCycle, recipe: PlantedRecipe, rate_hz: float, random: np.random.Generator
) -> Array:
    """Return the phase of every frame, in cycles."""
    pace = recipe.cadence / cycle.duration_s
    count = int(np.floor(recipe.cycles / pace * rate_hz + 1e-6)) + 1
    even = pace * np.arange(count) / rate_hz
    warp = _smooth_noise(random, (count, 1), rate_hz, WARP_BAND_HZ)[:, 0] * recipe.phase_noise
    if not cycle.loops:  # both ends of a clip stay
        warp = warp * np.minimum(1.0, 4 * np.minimum(even, 1 - even))
    phases = cycle.start_phase + even + warp
    if np.diff(phases).min() < SLOWEST * pace / rate_hz:
        raise MotionStyleError(
            f"planted {recipe.id}: phase_noise {recipe.phase_noise:g} slows the motion below "
            f"{SLOWEST:g} of its pace; choose a smaller one"
        )
    return phases if cycle.loops else np.clip(phases, 0.0, 1.0)


def _smooth_noise(
    random: np.random.Generator, shape: tuple[int, int], rate_hz: float, band_hz: tuple[float, ...]
) -> Array:
    """Return noise (F, C) of mean 0 and rms 1 within a band of frequencies."""
    seconds = shape[0] / rate_hz
    low, high = (max(1, round(f * seconds)) for f in band_hz)
    harmonics = np.arange(low, max(high, low + 1) + 1)
    angles = 2 * np.pi * np.outer(np.arange(shape[0]) / shape[0], harmonics)
    waves = np.concatenate([np.cos(angles), np.sin(angles)], axis=1)
    noise = waves @ random.standard_normal((waves.shape[1], shape[1]))
    return noise / np.sqrt((noise**2).mean(axis=0))


def _feet(
    cycle: SourceCycle, phases: Array, recipe: PlantedRecipe, noise: Array
) -> tuple[Array, Array]:
    """Return the ankles' paths (F, 2, 3) and the feet's rotations (F, 2, 3, 3)."""
    ankles = cycle.sample(cycle.ankles, phases)
    plants = cycle.sample(cycle.plants, phases, cycle.travel)
    ankles[..., 0] = cycle.sample(cycle.ankles[..., 0], phases, cycle.travel)
    ankles[..., 0] += (recipe.stride - 1) * plants
    lifts = np.maximum(cycle.sample(cycle.lifts, phases), 0.0)
    ankles[..., 1] += (recipe.swing_gain.get("legs", 1.0) - 1) * lifts
    most = max(float(cycle.lifts.max()), 1e-6)
    share = np.minimum(2 * lifts / most, 1.0)  # noise comes and goes with the foot's lift
    ankles += (share**2 * (3 - 2 * share))[..., None] * noise
    return ankles, exponential(cycle.sample(cycle.feet, phases))


def _with_legs(base: Motion, recipe: PlantedRecipe, q: Array, ankles: Array, feet: Array) -> Array:
    """Return coordinates whose legs reach the feet, the pelvis lowered where it must be."""
    q = np.array(q)
    turns = exponential(q[:, 3:6])
    legs = [Leg.of(base.body, side) for side in "rl"]
    straightest = min(
        float(base.coordinates[:, COORDINATE_INDEX[f"knee_flexion_{s}"]].min()) for s in "rl"
    )
    least = max(straightest, np.radians(LEAST_KNEE_DEG))
    needed = [
        needed_drop(leg, hip_positions(leg, q[:, :3], turns), ankles[:, k], least)
        for k, leg in enumerate(legs)
    ]
    most = float(np.max(needed))
    if most > LARGEST_DROP_M:
        blamed = _blamed_for_legs(recipe)
        how = "whatever the pelvis does" if np.isinf(most) else f"without sinking {most:.2f} m"
        raise MotionStyleError(
            f"planted {recipe.id}: {blamed} is infeasible: a leg does not reach its foot {how} "
            f"(at most {LARGEST_DROP_M:g} m); choose a value nearer to 1"
        )
    q[:, 1] -= smooth_drop(np.max(needed, axis=0), base.rate_hz)
    for k, leg in enumerate(legs):
        q[:, leg.columns] = solve_leg(leg, q[:, :3], turns, ankles[:, k], feet[:, k])
        q[:, COORDINATE_INDEX[f"toes_extension_{leg.side}"]] = 0.0
    return q


def _blamed_for_legs(recipe: PlantedRecipe) -> str:
    gain = recipe.swing_gain.get("legs", 1.0)
    if abs(np.log(gain)) > abs(np.log(recipe.step_length)):
        return f"swing_gain legs {gain:g}"
    if recipe.step_length == 1 and recipe.pose_noise_deg > 0:
        return f"pose_noise_deg {recipe.pose_noise_deg:g}"
    return f"step_length {recipe.step_length:g}"


def _facing_x(base: Motion, q: Array) -> Array:
    """Return the motion over the origin and facing +x (by the line of the hips) at first."""
    pose = forward_kinematics(base.body, q[:1])
    hips = [pose.positions[0, NODE_INDEX[f"thigh_{side}"]] for side in "rl"]
    right = hips[0] - hips[1]
    q = turned(q, -float(np.arctan2(right[0], right[2])))
    q[:, [0, 2]] -= q[0, [0, 2]]
    return q


def _with_toes(base: Motion, q: Array, bearing: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the contacts: toes bear while the base's do and the tip stays down in its place."""
    points = contact_points(base.body, forward_kinematics(base.body, q))
    result = np.array(bearing)
    for side in "rl":
        tip = CONTACT_POINTS.index(f"toe_{side}")
        result[:, tip] &= points[:, tip, 1] < TOE_LIFTED_M
        for first, last in runs(result[:, tip]):
            path = points[first : last + 1, tip][:, [0, 2]]
            away = np.linalg.norm(path - np.median(path, axis=0), axis=1)
            result[first : last + 1, tip] = False
            stays = max(runs(away < TOE_SLIP_M), key=lambda r: r[1] - r[0], default=(0, -1))
            result[first + stays[0] : first + stays[1] + 1, tip] = True
    return result


def _check_seen(base: Motion, recipe: PlantedRecipe) -> None:
    hidden = np.flatnonzero((posture_offsets(recipe) != 0) & ~base.observed)
    if len(hidden):
        names = ", ".join(COORDINATES[i] for i in hidden)
        raise MotionStyleError(
            f"planted {recipe.id}: posture_offset_deg changes {names}, which {base.id} does not "
            "show, so nobody would learn or score it; choose a joint that is observed"
        )


def _check_ranges(base: Motion, recipe: PlantedRecipe, q: Array) -> None:
    bounds = joint_ranges()
    leg = np.array([name.startswith(LEG_NAMES) for name in COORDINATES])
    leeway = np.radians(np.where(leg, LEEWAY_DEG["leg"], LEEWAY_DEG["other"]))
    low = np.minimum(bounds[:, 0], base.coordinates.min(axis=0)) - leeway
    high = np.maximum(bounds[:, 1], base.coordinates.max(axis=0)) + leeway
    knees = [COORDINATE_INDEX[f"knee_flexion_{side}"] for side in "rl"]
    low[knees] = bounds[knees, 0]
    toes = [COORDINATE_INDEX[f"toes_extension_{side}"] for side in "rl"]
    high[toes] = np.radians(80)
    excess = np.maximum(low - q, q - high).max(axis=0)
    excess[:6] = -1.0
    worst = int(np.argmax(excess))
    if excess[worst] > 0:
        name, path = COORDINATES[worst], np.degrees(q[:, worst])
        value = path[int(np.argmax(np.abs(path)))]
        arm, offset = name.startswith(ARM_NAMES), posture_offsets(recipe)[worst]
        gain = recipe.swing_gain.get("arms", 1.0)
        blamed = f"posture_offset_deg {name} {np.degrees(offset):+g}"
        if leg[worst]:
            blamed = _blamed_for_legs(recipe)
        elif arm and gain != 1:
            blamed = f"swing_gain arms {gain:g}" + (f" with {blamed}" if offset else "")
        elif not offset:
            blamed = f"pose_noise_deg {recipe.pose_noise_deg:g}"
        raise MotionStyleError(
            f"planted {recipe.id}: {blamed} is infeasible: {name} would go to {value:.0f}°, "
            f"{np.degrees(excess[worst]):.0f}° beyond its range"
        )


def _provenance(base: Motion, cycle: SourceCycle, recipe: PlantedRecipe) -> dict[str, Any]:
    kept = ("dataset", "source", "subject", "action", "surface", "level")
    return {
        **{key: base.provenance[key] for key in kept if key in base.provenance},
        "style": recipe.style,
        "example": base.id,
        "edit": recipe.edit,
        "planted": True,
        "truth": recipe.truth,
        "seed": recipe.seed,
        "take": recipe.take,
        "title": f"{recipe.id} (planted)",
        "experiments": list(recipe.experiments),
        "start_phase": cycle.start_phase,
        "source_window": recipe.source_window,
        "source_frames": ",".join(str(f) for f in cycle.source_frames),
        "mirror_twin_after_frames": cycle.twins,
    }
