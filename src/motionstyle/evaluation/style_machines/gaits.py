"""Experiments on walks and runs: explained variance, what the style axes mean, styled gaits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from motionstyle.evaluation.style_machines.analogies import analogy
from motionstyle.evaluation.style_machines.cycles import gait_numbers
from motionstyle.evaluation.style_machines.synthesis import (
    finished,
    hip_roll_deg,
    step_width_cm,
    synthesis_row,
)
from motionstyle.mocap.fitting.floor import StanceThresholds
from motionstyle.motion.motion import Motion
from motionstyle.shmm.machine import MachineSettings, MotionMachine, learn_machine, motion_from
from motionstyle.shmm.poses import restyled
from motionstyle.shmm.style_space import style_space

Array = NDArray[np.float64]
EXPLAINED_COLUMNS = (
    *("config", "data", "set", "draw", "prior", "models", "states", "dof"),
    *("cumulative_share", "cumulative_share_unscaled", "cumulative_share_means"),
)
DOF_COLUMNS = (
    "config",
    "data",
    "set",
    "dof",
    "quantity",
    "correlation",
    "abs_correlation",
    "minus",
    "plus",
)
QUANTITIES = ("trunk_pitch_deg", "speed_mps", "step_width_cm", "hip_roll_deg", "arm_swing_deg")
SHOWN_DOF = 8
NEGLIGIBLE = 1e-9
AXIS_STEP = 2.0  # standard deviations of the models' coordinates


def free_of_prior(settings: MachineSettings) -> MachineSettings:
    """Return settings without the cross-entropy prior: models that hardly know of each other."""
    weak = {"holding_hot": 0.02, "holding_roaming": 0.02, "holding_final": 0.02}
    return replace(settings, schedule=replace(settings.schedule, **weak))


def explained_rows(machine: MotionMachine, facts: Mapping[str, object]) -> list[dict[str, object]]:
    """Return the cumulative explained variance of the first style degrees of freedom.

    With means, covariances and dwell times at equal weight, which claims are judged on; unscaled;
    and of the means alone.
    """
    models = machine.machine.generic, machine.machine.specifics
    kinds = {
        "cumulative_share": {},
        "cumulative_share_unscaled": {"scale_blocks": False},
        "cumulative_share_means": {"block_weights": (1.0, NEGLIGIBLE, NEGLIGIBLE)},
    }
    shares = {name: np.cumsum(style_space(*models, 1, **how).shares) for name, how in kinds.items()}
    return [
        {
            **facts,
            "models": len(machine.names),
            "states": machine.machine.states,
            "dof": dof + 1,
            **{name: float(values[dof]) for name, values in shares.items()},
        }
        for dof in range(min(SHOWN_DOF, len(machine.names)))
    ]


def explained_variance(
    motions: Sequence[Motion], settings: MachineSettings, facts: Mapping[str, object]
) -> tuple[list[dict[str, object]], MotionMachine]:
    """Return the rows of a set with and without the cross-entropy prior, and its machine."""
    names = [m.id for m in motions]
    machine = learn_machine(motions, names, settings)
    rows = explained_rows(machine, {**facts, "prior": "cross_entropy"})
    bare = learn_machine(motions, names, free_of_prior(settings))
    return rows + explained_rows(bare, {**facts, "prior": "none"}), machine


def drawn_sets(ids: Sequence[str], count: int, size: int, seed: int) -> list[list[str]]:
    """Return random sets of ids; a set may not hold more ids than there are."""
    rng = np.random.default_rng(seed)
    pool = sorted(ids)
    if len(pool) < size:
        return []
    return [
        [pool[i] for i in sorted(rng.choice(len(pool), size, replace=False))] for _ in range(count)
    ]


def style_of(machine: MotionMachine, v: Array, content: str, id: str) -> Motion:
    """Return a model's content in the style v, (S,)."""
    own = machine.index(content)
    channels, _ = restyled(machine.poses, machine.content(content), own, machine.space.weights(v))
    return motion_from(id, channels, machine)


def measured(motion: Motion) -> dict[str, float]:
    """Return the quantities that style degrees of freedom are compared with."""
    numbers = gait_numbers(motion)
    return {
        "trunk_pitch_deg": numbers.trunk_lean_deg,
        "speed_mps": numbers.speed_mps,
        "step_width_cm": step_width_cm(motion),
        "hip_roll_deg": hip_roll_deg(motion),
        "arm_swing_deg": numbers.arm_swing_deg,
    }


def style_dof_rows(
    machine: MotionMachine, facts: Mapping[str, object]
) -> tuple[list[dict[str, object]], dict[tuple[int, int], Motion]]:
    """Return, per style axis, its correlation with gait quantities over the models, and ± 2 SD.

    The extremes are synthesised from the generic style with the content of the first model.
    """
    values = [measured(m) for m in machine.motions]
    rows: list[dict[str, object]] = []
    shown: dict[tuple[int, int], Motion] = {}
    for dof in range(machine.space.dof):
        v = machine.space.coordinates[:, dof]
        ends = {}
        for sign in (-1, 1):
            style = np.zeros(machine.space.dof)
            style[dof] = sign * AXIS_STEP * float(np.sqrt((v**2).mean()))
            motion = style_of(
                machine, style, machine.names[0], f"dof{dof + 1}{'+' if sign > 0 else '-'}"
            )
            shown[dof + 1, sign] = motion
            try:
                ends[sign] = measured(motion)
            except Exception as error:
                print(f"axis {dof + 1}, {sign:+d}: {error}")
                ends[sign] = {}
        for name in QUANTITIES:
            series = np.array([one[name] for one in values])
            varied = np.std(series) > 0 and np.std(v) > 0
            r = float(np.corrcoef(v, series)[0, 1]) if varied else 0.0
            rows.append(
                {
                    **facts,
                    "dof": dof + 1,
                    "quantity": name,
                    "correlation": r,
                    "abs_correlation": abs(r),
                    "minus": ends[-1].get(name),
                    "plus": ends[1].get(name),
                }
            )
    return rows, shown


def styled_gaits(
    machine: MotionMachine,
    roles: Mapping[str, str],
    thresholds: StanceThresholds,
    prefix: str,
) -> list[tuple[Motion, dict[str, object]]]:
    """Return the motions of F5, E4 and E3 with what the table says of them.

    roles : models that play walk, run, strut and cat.
    """
    found: list[tuple[Motion, dict[str, object]]] = []

    def add(motion: Motion, name: str, experiment: str, role: str, style: str) -> None:
        done = finished(replace(motion, id=f"{prefix}-{name}"), thresholds)
        facts = {"experiment": experiment, "role": role, "style": style, "content": "gait"}
        found.append((replace(done, provenance={**done.provenance, "style": style}), facts))

    def own(name: str) -> Motion:
        return style_of(machine, machine.coordinates(name), name, name)

    walk, run = roles["walk"], roles["run"]
    for experiment, style, label in (
        ("sm-F5", roles["strut"], "strut"),
        ("sm-E4", roles["cat"], "cat"),
    ):
        for role, model in (("walk", walk), ("run", run), ("style", style)):
            add(own(model), f"{label}-{role}", experiment, role, model)
        add(analogy(machine, walk, run, style), f"{label}-x", experiment, "x", f"{style}+run")
    for label, model in (("strut", roles["strut"]), ("cat", roles["cat"])):
        base, goal = machine.coordinates(walk), machine.coordinates(model)
        for gain, role in ((0.5, "interpolated"), (2.0, "extrapolated")):
            motion = style_of(machine, base + gain * (goal - base), walk, model)
            add(motion, f"{label}-{role}", "sm-E3", role, f"{model} x {gain:g}")
    return found


def styled_gait_ids(prefix: str) -> list[str]:
    """Return the ids of `styled_gaits`, known before they are made."""
    names = [
        f"{label}-{role}" for label in ("strut", "cat") for role in ("walk", "run", "style", "x")
    ]
    names += [
        f"{label}-{role}" for label in ("strut", "cat") for role in ("interpolated", "extrapolated")
    ]
    return [f"{prefix}-{name}" for name in names]


def gait_table_rows(
    made: Sequence[tuple[Motion, Mapping[str, object]]],
    training: Sequence[Motion],
    facts: Mapping[str, object],
) -> list[dict[str, object]]:
    """Return the rows of `shmm_syntheses.csv` of styled gaits."""
    return [synthesis_row(m, training, {**facts, **own}, gait=True) for m, own in made]
