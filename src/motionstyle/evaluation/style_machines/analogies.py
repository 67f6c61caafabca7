"""Analogies with a captured answer: A walk : A run :: B walk : X, X held against B's run.

The style machine is learnt from the walks and runs of all styles but for B's run, so that the
answer is never seen. Baselines: A's run itself, B's walk at A's run cadence, and linear mixing of
the mean cycles after time alignment.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.gait import foot_stances
from motionstyle.evaluation.style_machines.cycles import (
    MeanCycle,
    best_shift,
    gait_numbers,
    mean_cycle,
    pose_distance_deg,
    repeated,
)
from motionstyle.motion.motion import Motion
from motionstyle.shmm.features import coordinates_of
from motionstyle.shmm.machine import (
    MachineSettings,
    MotionMachine,
    learn_machine,
    motion_from,
    prepared,
)
from motionstyle.shmm.poses import restyled
from motionstyle.shmm.style_space import style_space

Array = NDArray[np.float64]
METHODS = ("style_machine", "source_run", "walk_at_run_cadence", "linear_mixing")
LEAST_CONTACTS = 4
BASELINE_CYCLES = 4
ANALOGY_COLUMNS = (
    *("config", "data", "set", "take", "source_style", "target_style", "pair", "method", "status"),
    *("reason", "pose_distance_deg", "beats_all_baselines"),
    *("speed_mps", "speed_error_mps", "cadence", "cadence_error", "arm_swing_deg"),
    *("arm_swing_error_deg", "trunk_lean_deg", "trunk_lean_error_deg"),
)


@dataclass(frozen=True)
class Gaits:
    """Walks and runs of one take by style, at a common rate."""

    walks: Mapping[str, Motion]
    runs: Mapping[str, Motion]


def usable_styles(gaits: Gaits) -> tuple[list[str], dict[str, str]]:
    """Return the styles whose walk and run have four contacts and a cycle, and why others fail."""
    good, left_out = [], {}
    for style in gaits.walks:
        for action, motions in (("walk", gaits.walks), ("run", gaits.runs)):
            motion = motions[style]
            try:
                mean_cycle(motion)
            except MotionStyleError as error:
                left_out[style] = str(error)
                break
            if (found := len(foot_stances(motion))) < LEAST_CONTACTS:
                left_out[style] = f"{action} {motion.id} has {found} contacts, needs 4"
                break
        else:
            good.append(style)
    return good, left_out


def analogy_machine(gaits: Gaits, target: str, settings: MachineSettings) -> MotionMachine:
    """Learn a style machine from all walks and runs but the target style's run."""
    motions, names = [], []
    for style in gaits.walks:
        motions.append(gaits.walks[style])
        names.append(f"walk:{style}")
        if style != target:
            motions.append(gaits.runs[style])
            names.append(f"run:{style}")
    return learn_machine(motions, names, settings)


def analogy(
    machine: MotionMachine, a: str, b: str, c: str, *, id: str = "analogy", gain: float = 1.0
) -> Motion:
    """Return X of a : b :: c : X, with b's content in the style v_c + gain·(v_b − v_a).

    Raises
    ------
    MotionStyleError
        If a name is unknown to the machine.
    """
    v = machine.coordinates(c) + gain * (machine.coordinates(b) - machine.coordinates(a))
    own = machine.index(b)
    channels, _ = restyled(machine.poses, machine.content(b), own, machine.space.weights(v))
    return motion_from(id, channels, machine, analogy=f"{a} : {b} :: {c} : X")


@dataclass(frozen=True)
class Variant:
    """Other arithmetic than the paper's.

    own_change : share of the source style's own change from walk to run; the rest is the mean
    change of all other styles. gain : factor on the difference in style. style_dof : S.
    """

    own_change: float = 1.0
    gain: float = 1.0
    style_dof: int | None = None


def variant_analogy(machine: MotionMachine, source: str, target: str, variant: Variant) -> Motion:
    """Return X of source walk : source run :: target walk : X by a variant's arithmetic.

    v = R + gain (v_target walk − W), where R and W are the source's run and walk, drawn to the
    mean run and the mean walk of the styles whose run is known.
    """
    space = machine.space
    if variant.style_dof is not None:
        generic, specifics = machine.machine.generic, machine.machine.specifics
        space = style_space(generic, specifics, min(variant.style_dof, len(machine.names)))
    v = {name: space.coordinates[k] for k, name in enumerate(machine.names)}
    known = [n.removeprefix("run:") for n in machine.names if n.startswith("run:")]
    runs = np.mean([v[f"run:{s}"] for s in known], axis=0)
    walks = np.mean([v[f"walk:{s}"] for s in known], axis=0)
    own = variant.own_change
    run = runs + own * (v[f"run:{source}"] - runs)
    walk = walks + own * (v[f"walk:{source}"] - walks)
    style = run + variant.gain * (v[f"walk:{target}"] - walk)
    content = f"run:{source}"
    channels, _ = restyled(
        machine.poses, machine.content(content), machine.index(content), space.weights(style)
    )
    return motion_from(f"{source}-{target}-variant", channels, machine)


def _from_cycle(cycle: MeanCycle, like: Motion, id: str) -> Motion:
    """Return a mean cycle repeated as a motion of the body of `like`."""
    coordinates, jumps = coordinates_of(
        repeated(cycle, BASELINE_CYCLES, like.rate_hz), like.rate_hz
    )
    frames = len(coordinates)
    return replace(
        like,
        id=id,
        kind="shmm",
        coordinates=coordinates,
        contacts=np.zeros((frames, like.contacts.shape[1]), dtype=bool),
        contact_normals=np.broadcast_to([0.0, 1.0, 0.0], (frames, like.contacts.shape[1], 3)),
        rebranched=jumps,
        contact_forces=None,
    )


def baselines(walk_a: Motion, run_a: Motion, walk_b: Motion) -> dict[str, Motion]:
    """Return the three baseline answers."""
    a_walk, a_run, b_walk = mean_cycle(walk_a), mean_cycle(run_a), mean_cycle(walk_b)
    ratio = b_walk.period_s / a_run.period_s
    faster = b_walk.channels.copy()
    faster[:, -3:] *= ratio  # the same way in less time
    aligned_walk = np.roll(a_walk.channels, best_shift(a_run, a_walk), axis=0)
    in_phase = MeanCycle(aligned_walk, a_walk.period_s, 1)
    aligned_b = np.roll(b_walk.channels, best_shift(in_phase, b_walk), axis=0)
    mixed = MeanCycle(
        a_run.channels + aligned_b - aligned_walk,
        max(a_run.period_s + b_walk.period_s - a_walk.period_s, 0.3),
        1,
    )
    return {
        "source_run": run_a,
        "walk_at_run_cadence": _from_cycle(
            MeanCycle(faster, a_run.period_s, 1), walk_b, "walk_at_run_cadence"
        ),
        "linear_mixing": _from_cycle(mixed, run_a, "linear_mixing"),
    }


def answers_rows(
    answers: Mapping[str, Motion | str], truth: Motion, facts: Mapping[str, object]
) -> list[dict[str, object]]:
    """Return one row a method: how far its answer is from the captured one.

    answers : a motion by method, or why there is none.
    """
    goal, numbers = mean_cycle(truth), gait_numbers(truth)
    rows: list[dict[str, object]] = []
    for method in (*METHODS, *(m for m in answers if m not in METHODS)):
        answer = answers[method]
        row: dict[str, object] = {**facts, "method": method, "status": "ok"}
        try:
            if isinstance(answer, str):
                raise MotionStyleError(answer)
            own = gait_numbers(answer)
            row["pose_distance_deg"] = pose_distance_deg(goal, mean_cycle(answer), truth.observed)
        except MotionStyleError as error:
            rows.append(row | {"status": "failed", "reason": str(error)})
            continue
        for name in ("speed_mps", "cadence", "arm_swing_deg", "trunk_lean_deg"):
            row[name] = getattr(own, name)
            stem, _, unit = name.rpartition("_") if name != "cadence" else (name, "", "")
            error_name = f"{stem}_error_{unit}" if unit else f"{stem}_error"
            row[error_name] = getattr(own, name) - getattr(numbers, name)
        rows.append(row)
    others = [
        r["pose_distance_deg"] for r in rows if r["method"] in METHODS[1:] and r["status"] == "ok"
    ]
    for row in rows:
        if row["method"] not in METHODS[1:]:
            ours = row.get("pose_distance_deg")
            row["beats_all_baselines"] = ours is not None and all(
                float(ours) < float(other)
                for other in others  # type: ignore[arg-type]
            )
    return rows


def analogy_rows(
    gaits: Gaits,
    settings: MachineSettings,
    facts: Mapping[str, object],
    variants: Mapping[str, Variant],
) -> tuple[list[dict[str, object]], dict[tuple[str, str], Motion]]:
    """Return the rows of all ordered pairs of styles of one take, and X of each pair.

    Styles that lack contacts or cycles are left out, and named in the log.
    """
    gaits = Gaits(
        {s: prepared(m, settings) for s, m in gaits.walks.items()},
        {s: prepared(m, settings) for s, m in gaits.runs.items()},
    )
    styles, left_out = usable_styles(gaits)
    for style, reason in left_out.items():
        print(f"{facts['set']}, take {facts['take']}: {style} left out: {reason}")
    gaits = Gaits({s: gaits.walks[s] for s in styles}, {s: gaits.runs[s] for s in styles})
    rows: list[dict[str, object]] = []
    found: dict[tuple[str, str], Motion] = {}
    for b in styles:
        machine = analogy_machine(gaits, b, settings)
        for a in styles:
            if a == b:
                continue
            answers: dict[str, Motion | str] = {
                **baselines(gaits.walks[a], gaits.runs[a], gaits.walks[b])
            }
            x = analogy(machine, f"walk:{a}", f"run:{a}", f"walk:{b}", id=f"{a}-{b}")
            answers["style_machine"] = found[a, b] = x
            for name, variant in variants.items():
                answers[f"style_machine_{name}"] = variant_analogy(machine, a, b, variant)
            pair = {"source_style": a, "target_style": b, "pair": f"{a}>{b}"}
            rows += answers_rows(answers, gaits.runs[b], {**facts, **pair})
    return rows, found


def pair_medians(rows: Sequence[Mapping[str, object]], method: str) -> dict[str, float]:
    """Return the median pose distance over takes of each pair, deg."""
    found: dict[str, list[float]] = {}
    for row in rows:
        if row["method"] == method and row.get("pose_distance_deg") is not None:
            found.setdefault(str(row["pair"]), []).append(float(row["pose_distance_deg"]))  # type: ignore[arg-type]
    return {pair: float(np.median(v)) for pair, v in sorted(found.items())}
