"""Experiments on dances: the dance model, choreographies in several styles, and a novice."""

from __future__ import annotations

import itertools
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.style_machines.synthesis import (
    finished,
    synthesis_row,
)
from motionstyle.mocap.fitting.floor import StanceThresholds
from motionstyle.motion.motion import Motion
from motionstyle.shmm.choreography import joined, moves_of, primitives, random_walk
from motionstyle.shmm.features import pose_channels
from motionstyle.shmm.inference import expectations, pack
from motionstyle.shmm.machine import (
    MachineSettings,
    MotionMachine,
    learn_machine,
    motion_from,
    prepared,
)
from motionstyle.shmm.model import count_parameters
from motionstyle.shmm.poses import (
    StyledPoses,
    path_occupancy,
    styled_means,
    styled_poses,
    synthesise,
)
from motionstyle.shmm.style_space import analyse
from motionstyle.shmm.training import floor_of

Array = NDArray[np.float64]
DANCE_COLUMNS = (
    *("config", "data", "model", "motions", "frames", "rate_hz", "states_start", "states_end"),
    *("parameters", "transitions", "occupancy_entropy_bit", "log_likelihood_nat_per_frame"),
    *("steps", "seconds", "dof", "explained_3_dof"),
)
NOVICE_COLUMNS = (
    *("config", "data", "novice", "simulated", "held_out", "expert", "seed", "frames"),
    *("jerk_ratio", "loglik_gain_nat_per_frame", "error_to_original_ratio"),
    *("novice_error_deg", "improved_error_deg", "style_shift"),
)
STYLES = 5
STAYS_IN_STYLE = 60  # of the choreography of the teaser
MOVES, STAYS_OF_MOVE = 4, 9
WALK_STAYS = 70
EXTRAPOLATED = (1.5, -0.5)  # the paper's 3/2 ballet − 1/2 languid


def occupancy_entropy_bit(occupancy: Sequence[Array]) -> float:
    """Return the mean entropy of γ over frames, bit; near zero when states are certain."""
    gamma = np.concatenate(list(occupancy))
    with np.errstate(divide="ignore", invalid="ignore"):
        terms = np.where(gamma > 0, gamma * np.log2(gamma), 0.0)
    return float(-terms.sum(axis=1).mean() + 0.0)


def dance_machine(
    motions: Sequence[Motion], settings: MachineSettings, facts: Mapping[str, object]
) -> tuple[MotionMachine, dict[str, object]]:
    """Learn a dance model, one specific model per dance, and return its row of `dance_model.csv`.

    A set with fewer frames in its longest dance than states starts with half as many states as
    that dance has frames, which the row shows.
    """
    longest = max(prepared(m, settings).frames for m in motions)
    states = min(settings.states, longest // 2)
    begun = time.perf_counter()
    machine = learn_machine(motions, [m.id for m in motions], replace(settings, states=states))
    seconds = time.perf_counter() - begun
    learnt = machine.machine
    frames = sum(len(g) for g in learnt.occupancy)
    shares = np.cumsum(machine.space.shares)
    return machine, {
        **facts,
        "motions": "+".join(machine.names),
        "frames": frames,
        "rate_hz": machine.rate_hz,
        "states_start": states,
        "states_end": learnt.states,
        "parameters": count_parameters(learnt.generic),
        "transitions": int((learnt.generic.transitions > 0).sum()),
        "occupancy_entropy_bit": occupancy_entropy_bit(learnt.occupancy),
        "log_likelihood_nat_per_frame": learnt.steps[-1].log_likelihood / frames,
        "steps": len(learnt.steps),
        "seconds": seconds,
        "dof": machine.space.dof,
        "explained_3_dof": float(shares[min(3, len(shares)) - 1]),
    }


def dance_styles(machine: MotionMachine) -> dict[str, Array]:
    """Return five styles of a dance model as weights of its specific models, (R,) each.

    Up to four are the dancers' own; mixtures and extrapolations, as in the paper, fill up to five.
    """
    count = len(machine.names)
    own = np.eye(count)
    styles = {machine.names[r]: own[r] for r in range(min(count, 4))}
    if count >= 2:
        (a, b), last = machine.names[:2], machine.names[-1]
        mixtures = {
            f"1.5 {a} - 0.5 {b}": EXTRAPOLATED[0] * own[0] + EXTRAPOLATED[1] * own[1],
            f"0.5 {a} + 0.5 {last}": 0.5 * own[0] + 0.5 * own[-1],
            f"1.5 {last} - 0.5 {a}": EXTRAPOLATED[0] * own[-1] + EXTRAPOLATED[1] * own[0],
        }
        for name, weights in mixtures.items():
            if len(styles) < STYLES:
                styles[name] = weights
    return styles


def recognised(
    machine: MotionMachine,
    motion: Motion,
    occupancy: Array,
    styles: Mapping[str, Array],
    asked: str,
) -> bool:
    """Whether a synthesised motion is likeliest, of all styles, under the one asked for.

    Judged on its joint angles with the state path it was made from, under each style's own
    emissions: a look-alike test, as a person compares five dancers.
    """
    channels = (pose_channels(motion) - machine.poses.centre) / machine.poses.spread
    joints = slice(0, 29)
    path = occupancy.argmax(axis=1)
    errors = {}
    for name, w in styles.items():
        goal = styled_means(machine.poses, w)[path][:, joints]
        errors[name] = float(((channels[: len(path), joints] - goal) ** 2).mean())
    return min(errors, key=lambda k: errors[k]) == asked


def _styled(
    machine: MotionMachine, states: Sequence[int], poses: StyledPoses, id: str
) -> tuple[Motion, Array]:
    occupancy = path_occupancy(states, np.maximum(poses.dwell, 1.0))
    return motion_from(id, synthesise(machine.poses, occupancy, poses), machine), occupancy


def dance_syntheses(
    machine: MotionMachine, thresholds: StanceThresholds, prefix: str, seed: int
) -> list[tuple[Motion, dict[str, object]]]:
    """Return the motions of F0 (one choreography), F6 (four moves) and E6 (random walks).

    F0 and F6 in five styles; E6 in three styles, and one cut-and-paste choreography.
    """
    transitions = machine.machine.generic.transitions
    paths = [gamma.argmax(axis=1) for gamma in machine.machine.occupancy]
    styles = dance_styles(machine)
    posed = {name: styled_poses(machine.poses, w) for name, w in styles.items()}
    choreography = moves_of(paths[0])[:STAYS_IN_STYLE]
    moves = primitives(paths, STAYS_OF_MOVE, MOVES)
    while len(moves) < MOVES:  # short dances repeat little: cut the first one into pieces
        start = len(moves) * STAYS_OF_MOVE
        moves.append(
            tuple(
                moves_of(paths[len(moves) % len(paths)])[start : start + STAYS_OF_MOVE] or moves[0]
            )
        )
    found: list[tuple[Motion, dict[str, object]]] = []

    def add(name: str, states: Sequence[int], style: str, experiment: str, content: str) -> None:
        motion, occupancy = _styled(machine, states, posed[style], f"{prefix}-{name}")
        known = recognised(machine, motion, occupancy, styles, style)
        done = finished(motion, thresholds)
        done = replace(
            done, provenance={"style": style, "example": machine.names[0], "edit": content}
        )
        facts = {"experiment": experiment, "role": "x", "style": style, "content": content}
        found.append((done, {**facts, "style_recognised": known}))

    for k, style in enumerate(styles):
        add(f"choreography-{k}", choreography, style, "sm-F0", "choreography")
        for m, move in enumerate(moves):
            add(f"move{m}-{k}", move, style, "sm-F6", f"move {m + 1}")
    start = int(np.argmax(np.bincount(paths[0], minlength=len(transitions))))
    walk = random_walk(transitions, start, WALK_STAYS, seed)
    for k, style in enumerate(list(styles)[-3:]):
        add(f"walk-{k}", walk, style, "sm-E6", "random walk")
    pasted = _pasted(transitions, moves)
    add("pasted", pasted, next(iter(styles)), "sm-E6", "cut and paste")
    return found


def _pasted(transitions: Array, moves: Sequence[tuple[int, ...]]) -> list[int]:
    """Return two moves joined by a path of the state graph, or one move where none are joined."""
    for first, second in itertools.permutations(moves, 2):
        try:
            return joined(transitions, [first, second])
        except MotionStyleError as error:
            print(error)
    return list(moves[0])


def dance_ids(prefix: str, models: int) -> list[str]:
    """Return the ids of `dance_syntheses` for a set of R models, known before they are made."""
    styles = STYLES if models >= 2 else 1
    names = []
    for k in range(styles):
        names += [f"choreography-{k}", *(f"move{m}-{k}" for m in range(MOVES))]
    names += [*(f"walk-{k}" for k in range(min(3, styles))), "pasted"]
    return [f"{prefix}-{name}" for name in names]


def dance_table_rows(
    made: Sequence[tuple[Motion, Mapping[str, object]]],
    training: Sequence[Motion],
    facts: Mapping[str, object],
) -> list[dict[str, object]]:
    """Return the rows of `shmm_syntheses.csv` of dances."""
    return [synthesis_row(m, training, {**facts, **own}, gait=False) for m, own in made]


# ------------------------------------------------------------------ the simulated novice


def simulated_novice(
    motion: Motion, *, seed: int, noise_deg: float, tempo: float, swaps: int
) -> tuple[Motion, NDArray[np.int64]]:
    """Return a performance with known faults, and which frame of the original each is.

    tempo : standard deviation of a smooth log-warp of time (about one fault a second). swaps :
    adjacent pieces of a second that come in the wrong order. noise_deg : of smooth noise of 3 Hz
    on all joints, with an eighth of it white, as an unsteady beginner has.
    """
    rng = np.random.default_rng(seed)
    n, rate = motion.frames, motion.rate_hz
    knots = max(3, int(n / rate) + 1)
    log_speed = np.interp(
        np.linspace(0, knots - 1, n), np.arange(knots), rng.normal(0, tempo, knots)
    )
    at = np.cumsum(np.exp(log_speed))
    at = (at - at[0]) / (at[-1] - at[0]) * (n - 1)
    source = np.round(at).astype(int)
    piece = max(2, int(0.5 * rate))
    for _ in range(swaps):
        if n < 4 * piece:
            break
        first = int(rng.integers(piece, n - 3 * piece + 1))
        a, b = (
            source[first : first + piece].copy(),
            source[first + piece : first + 2 * piece].copy(),
        )
        source[first : first + piece], source[first + piece : first + 2 * piece] = b, a
    coordinates = motion.coordinates[source].copy()
    count = max(4, int(n / rate * 6))
    wobble = rng.normal(0, np.radians(noise_deg), (count, coordinates.shape[1] - 6))
    times = np.linspace(0, count - 1, n)
    for column in range(wobble.shape[1]):
        coordinates[:, 6 + column] += np.interp(times, np.arange(count), wobble[:, column])
    coordinates[:, 6:] += rng.normal(0, np.radians(noise_deg) / 8, (n, wobble.shape[1]))
    provenance = {**motion.provenance, "simulated_novice": True, "planted": True}
    novice = replace(
        motion, id=f"{motion.id}-novice{seed}", coordinates=coordinates, provenance=provenance
    )
    return novice, source


def mean_jerk(motion: Motion) -> float:
    """Return the rms of the third difference of the joint angles, rad/s³."""
    return (
        float(np.sqrt((np.diff(motion.coordinates[:, 6:], 3, axis=0) ** 2).mean()))
        * motion.rate_hz**3
    )


def novice_rows(
    machine: MotionMachine,
    original: Motion,
    expert: str,
    faults: Mapping[str, object],
    facts: Mapping[str, object],
) -> tuple[list[dict[str, object]], list[tuple[Motion, Motion]]]:
    """Return rows and (novice, improved) pairs: a simulated novice resynthesised as an expert.

    The novice's γ, with the expert's pose states, gives the improved dance at the novice's own
    timing. Errors are against the clean original at the frames the novice shows.
    """
    rows, pairs = [], []
    own = machine.index(expert)
    model = machine.machine.specifics[own]
    packed = pack([machine.features.features(m) for m in machine.motions])
    floor = floor_of(packed, MachineSettings().training())
    seeds = faults["seeds"]
    poses = styled_poses(machine.poses, np.eye(len(machine.names))[own])
    options = {k: faults[k] for k in ("noise_deg", "tempo", "swaps")}
    for seed in seeds:  # type: ignore[union-attr]
        novice, source = simulated_novice(original, seed=int(seed), **options)  # type: ignore[arg-type]
        found = analyse(
            [machine.features.features(novice)], machine.machine, machine.space, floor=floor
        )
        channels = synthesise(machine.poses, found.occupancy[0], poses)
        improved = motion_from(f"{novice.id}-improved", channels, machine, simulated_novice=True)
        before = expectations(model, pack([machine.features.features(novice)]))
        after = expectations(model, pack([machine.features.features(improved)]))
        truth = original.coordinates[source][:, 6:]
        errors = [
            float(np.degrees(np.sqrt(((m.coordinates[:, 6:] - truth) ** 2).mean())))
            for m in (novice, improved)
        ]
        goal = machine.space.coordinates[own]
        rows.append(
            {
                **facts,
                "novice": novice.id,
                "simulated": True,
                "held_out": original.id,
                "expert": expert,
                "seed": seed,
                "frames": novice.frames,
                "jerk_ratio": mean_jerk(improved) / mean_jerk(novice),
                "loglik_gain_nat_per_frame": float(
                    (after.log_likelihood[0] - before.log_likelihood[0]) / novice.frames
                ),
                "error_to_original_ratio": errors[1] / errors[0],
                "novice_error_deg": errors[0],
                "improved_error_deg": errors[1],
                "style_shift": float(np.linalg.norm(found.v - goal)),
            }
        )
        pairs.append((novice, improved))
    return rows, pairs
