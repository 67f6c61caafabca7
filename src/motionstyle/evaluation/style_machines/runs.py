"""Whole experiments: what one job of the workflow makes from motions and settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.style_machines import analogies as a
from motionstyle.evaluation.style_machines import checks, dances, driving, gaits, held_out, twins
from motionstyle.evaluation.style_machines.settings import pattern_ids
from motionstyle.mocap.fitting.floor import StanceThresholds
from motionstyle.motion.mirror import mirror_motion
from motionstyle.motion.motion import Motion
from motionstyle.shmm.machine import MachineSettings, MotionMachine, learn_machine

Array = NDArray[np.float64]
Rows = list[dict[str, object]]
Motions = Mapping[str, Motion]
GAIT_PREFIX, DANCE_PREFIX, DRIVE_PREFIX = "gait", "dance", "driven"
DRIVEN = ("truth", "path_map", "path_map_restyled")


@dataclass
class Outcome:
    """Tables by name, synthesised motions, rows of `shmm_syntheses.csv`, arrays for figures."""

    tables: dict[str, Rows] = field(default_factory=dict)
    motions: dict[str, Motion] = field(default_factory=dict)
    syntheses: Rows = field(default_factory=list)
    arrays: dict[str, Array] = field(default_factory=dict)


def data_of(motions: Sequence[Motion]) -> str:
    """Return "planted" if any of the motions is, else "captured"."""
    planted = any(m.kind == "planted" or m.provenance.get("planted") for m in motions)
    return "planted" if planted else "captured"


def _facts(config: str, motions: Sequence[Motion], **more: object) -> dict[str, object]:
    return {"config": config, "data": data_of(motions), **more}


def run_gaits(
    plan: Mapping[str, Any],
    motions: Motions,
    pool: Sequence[str],
    thresholds: StanceThresholds,
    config: str,
) -> Outcome:
    """Return explained variance with its draws, the meaning of the axes, and styled gaits."""
    settings = MachineSettings.from_config(plan["locomotion"])
    out = Outcome(tables={"explained_variance": [], "style_dof": []})
    explained, axes = out.tables["explained_variance"], out.tables["style_dof"]
    for name, entry in plan["explained_variance"].items():
        chosen = [motions[i] for i in entry["motions"]]
        facts = _facts(config, chosen, set=name)
        rows, machine = gaits.explained_variance(chosen, settings, facts)
        explained += rows
        both = chosen + [mirror_motion(m) for m in chosen]
        names = [m.id for m in chosen] * 2
        mirrored = learn_machine(both, names, settings)
        facts |= {"set": f"{name}_mirrored", "prior": "cross_entropy"}
        explained += gaits.explained_rows(mirrored, facts)
        if name == "headline" or len(plan["explained_variance"]) == 1:
            rows, shown = gaits.style_dof_rows(machine, _facts(config, chosen, set=name))
            axes += rows
            out.arrays |= {
                "style_coordinates": machine.space.coordinates,
                "style_names": np.array(machine.names),
            }
            for (dof, sign), motion in shown.items():
                id = f"{GAIT_PREFIX}-dof{dof}-{'plus' if sign > 0 else 'minus'}"
                done = gaits.finished(replace(motion, id=id), thresholds)
                facts = {"experiment": "sm-E2", "role": f"axis {dof}", "content": "gait"}
                facts |= {"style": f"axis {dof}, {'+' if sign > 0 else '-'}2 SD"}
                out.motions[id] = replace(done, provenance={"style": facts["style"]})
                out.syntheses.append(
                    gaits.synthesis_row(
                        done, machine.motions, {**_facts(config, chosen), **facts}, gait=True
                    )
                )
    explained += _draws(plan["draws"], motions, pool, settings, config)
    if "gaits" in plan:
        entry = plan["gaits"]
        chosen = [motions[i] for i in entry["motions"]]
        machine = learn_machine(chosen, entry["motions"], settings)
        made = gaits.styled_gaits(machine, entry, thresholds, GAIT_PREFIX)
        out.motions |= {m.id: _labelled(m, chosen) for m, _ in made}
        out.syntheses += gaits.gait_table_rows(made, machine.motions, _facts(config, chosen))
    return out


def _labelled(motion: Motion, training: Sequence[Motion]) -> Motion:
    """Return a synthesised motion that says if it rests on planted ones."""
    planted = {"planted": True} if data_of(training) == "planted" else {}
    return replace(motion, provenance={**motion.provenance, **planted})


def _draws(
    options: Mapping[str, int],
    motions: Motions,
    pool: Sequence[str],
    settings: MachineSettings,
    config: str,
) -> Rows:
    """Return the explained variance of random sets of motions."""
    rows: Rows = []
    short = replace(settings, schedule=replace(settings.schedule, steps=options["steps"]))
    sets = gaits.drawn_sets(pool, options["count"], options["size"], options["seed"])
    for draw, ids in enumerate(sets):
        chosen = [motions[i] for i in ids]
        machine = learn_machine(chosen, ids, short)
        facts = _facts(config, chosen, set="draw", draw=draw, prior="cross_entropy")
        rows += gaits.explained_rows(machine, facts)
    return rows


def run_analogies(plan: Mapping[str, Any], motions: Motions, config: str) -> Outcome:
    """Return all ordered pairs of styles of all sets and takes."""
    settings = MachineSettings.from_config(plan["locomotion"])
    variants = {name: a.Variant(**v) for name, v in plan["analogy_variants"].items()}
    out = Outcome(tables={"analogies": []})
    for name, entry in plan["analogies"].items():
        for take in entry["takes"]:
            walks = pattern_ids(entry["walk"], entry["styles"], [take])
            runs = pattern_ids(entry["run"], entry["styles"], [take])
            set_of = a.Gaits(
                dict(zip(entry["styles"], (motions[i] for i in walks), strict=True)),
                dict(zip(entry["styles"], (motions[i] for i in runs), strict=True)),
            )
            facts = _facts(config, [*set_of.walks.values()], set=name, take=take)
            rows, _ = a.analogy_rows(set_of, settings, facts, variants)
            out.tables["analogies"] += rows
    return out


def run_held_out(plan: Mapping[str, Any], motions: Motions, config: str) -> Outcome:
    """Return likelihoods of unseen takes and style retrieval, for all sets."""
    settings = MachineSettings.from_config(plan["locomotion"])
    out = Outcome(tables={"held_out": []})
    for name, entry in plan["held_out"].items():

        def takes(key: str, entry: Mapping[str, Any] = entry) -> dict[str, list[Motion]]:
            return {
                s: [motions[i] for i in pattern_ids(entry["motion"], [s], entry[key])]
                for s in entry["styles"]
            }

        learn, tried = takes("learn"), takes("try")
        facts = _facts(config, [m for ms in learn.values() for m in ms], set=name)
        out.tables["held_out"] += held_out.held_out_rows(learn, tried, settings, facts)
    return out


def run_dances(
    plan: Mapping[str, Any], motions: Motions, thresholds: StanceThresholds, config: str
) -> Outcome:
    """Return dance models, the syntheses of the headline model, and the simulated novice."""
    settings = MachineSettings.from_config(plan["dance"])
    out = Outcome(tables={"dance_model": [], "novice": []})
    for name, ids in plan["dances"].items():
        chosen = [motions[i] for i in ids]
        facts = _facts(config, chosen, model=name)
        machine, row = dances.dance_machine(chosen, settings, facts)
        out.tables["dance_model"].append(row)
        out.arrays |= _dance_arrays(name, machine)
        if name == next(iter(plan["dances"])):
            made = dances.dance_syntheses(machine, thresholds, DANCE_PREFIX, settings.seed)
            out.motions |= {m.id: _labelled(m, chosen) for m, _ in made}
            out.syntheses += dances.dance_table_rows(made, machine.motions, _facts(config, chosen))
    if "novice" in plan and plan["dances"]:
        entry = plan["novice"]
        group = next(ids for ids in plan["dances"].values() if entry["expert"] in ids)
        chosen = [motions[i] for i in group if i != entry["held_out"]]
        machine, _ = dances.dance_machine(chosen, settings, {})
        original = dances.prepared(motions[entry["held_out"]], settings)
        rows, pairs = dances.novice_rows(
            machine, original, entry["expert"], entry, {"config": config, "data": "planted"}
        )
        out.tables["novice"] += rows
        for label, motion in zip(
            ("original", "novice", "improved"), (original, *pairs[0]), strict=True
        ):
            id = f"{DANCE_PREFIX}-novice-{label}"
            marks = {"simulated_novice": label != "original", "planted": True, "edit": label}
            done = replace(motion, id=id, kind="shmm", provenance={**motion.provenance, **marks})
            out.motions[id] = dances.finished(done, thresholds)
    return out


def _dance_arrays(name: str, machine: MotionMachine) -> dict[str, Array]:
    learnt = machine.machine
    arrays = {
        f"{name}_transitions": learnt.generic.transitions,
        f"{name}_means": learnt.generic.means,
        f"{name}_names": np.array(machine.names),
        f"{name}_states_by_step": np.array([s.states for s in learnt.steps]),
        f"{name}_transitions_by_step": np.array([s.transitions for s in learnt.steps]),
    }
    return arrays | {
        f"{name}_occupancy_{r}": gamma.astype(np.float32)
        for r, gamma in enumerate(learnt.occupancy)
    }


def run_driving(
    plan: Mapping[str, Any], motions: Motions, thresholds: StanceThresholds, config: str
) -> Outcome:
    """Return dances driven by silhouettes and by 2-D points."""
    out = Outcome(tables={"path_map": []})
    if "driving" not in plan:
        return out
    entry = plan["driving"]
    chosen = [motions[i] for i in entry["learn"]]
    settings = MachineSettings.from_config(plan["dance"])
    rows, shown, _ = driving.driving_rows(chosen, settings, entry, _facts(config, chosen))
    out.tables["path_map"] += rows
    for label, motion in shown:
        id = f"{DRIVE_PREFIX}-{label}"
        made = replace(motion, id=id, kind="shmm", provenance={"edit": label, "style": label})
        out.motions[id] = _labelled(dances.finished(made, thresholds), chosen)
    images = driving.silhouettes(shown[0][1])
    out.arrays["silhouettes"] = images[:: max(1, len(images) // 6)][:6].astype(np.uint8)
    return out


def run_checks(plan: Mapping[str, Any], motions: Motions, config: str) -> Outcome:
    """Return the numbers of the schematic figures, of seeds and schedule, and of phases."""
    settings = MachineSettings.from_config(plan["locomotion"])
    data = checks.prior_ellipses()
    rows: Rows = [
        {"figure": "sm-F2", "quantity": name, "value": value}
        for name, value in checks.prior_numbers(data).items()
    ]
    out = Outcome(tables={"shmm_figure_checks": rows, "shmm_sensitivity": []})
    out.arrays |= {f"priors_{k}": v for k, v in data.items()}
    chosen: list[Motion] = []
    if "three_walks" in plan:
        entry = plan["three_walks"]
        chosen = [motions[i] for i in entry["learn"]]
        numbers, panels = held_out.three_walks(chosen, [motions[i] for i in entry["try"]], settings)
        rows += [{"figure": "sm-F1", "quantity": k, "value": v} for k, v in numbers.items()]
        out.arrays |= {f"walks_{k}": v for k, v in panels.items()}
    sets = plan["explained_variance"]
    if sets:
        name = "headline" if "headline" in sets else next(iter(sets))
        chosen = [motions[i] for i in sets[name]["motions"]]
        machine = learn_machine(chosen, [m.id for m in chosen], settings)
        purity, chance = checks.phase_purity(machine.machine.occupancy, machine.motions)
        rows += [
            {"figure": "sm-E8", "quantity": "phase_purity", "value": purity},
            {"figure": "sm-E8", "quantity": "phase_purity_chance", "value": chance},
        ]
        for r, gamma in enumerate(machine.machine.occupancy):
            out.arrays[f"phases_{r}"] = gamma.argmax(axis=1)
        out.arrays["phases_names"] = np.array(machine.names)
        features = checks.pooled_features(chosen, settings)
        annealed, courses = checks.annealing_runs(
            features, settings.states, plan["seeds"], settings.schedule.steps
        )
        rows += annealed
        out.arrays |= {f"annealing_{k}": v for k, v in courses.items()}
        out.tables["shmm_sensitivity"] += checks.sensitivity_rows(
            chosen, settings, plan["sensitivity"], plan["seeds"], _facts(config, chosen, set=name)
        )
    for row in rows:
        row |= {"config": config, "data": data_of(chosen) if chosen else "none"}
    return out


def run_twins(plan: Mapping[str, Any], config: str) -> Rows:
    """Learn known stylistic models again, for all seeds and noises."""
    if "twin" not in plan:
        return []
    twin = plan["twin"]
    return [
        {"config": config, "data": "planted", **twins.twin_row(seed, name, noise, twin)}
        for name, noise in twin["noise"].items()
        for seed in twin["seeds"]
    ]


def motion_ids(plan: Mapping[str, Any]) -> dict[str, list[str]]:
    """Return the ids of all motions that each job makes, known before it runs."""
    ids: dict[str, list[str]] = {"gaits": [], "dances": [], "driving": []}
    sets = plan["explained_variance"]
    if sets:
        name = "headline" if "headline" in sets else next(iter(sets))
        if name == "headline" or len(sets) == 1:
            dof = min(plan["locomotion"]["style_dof"], len(sets[name]["motions"]))
            ids["gaits"] += [
                f"{GAIT_PREFIX}-dof{d + 1}-{end}" for d in range(dof) for end in ("minus", "plus")
            ]
    if "gaits" in plan:
        ids["gaits"] += gaits.styled_gait_ids(GAIT_PREFIX)
    if plan["dances"]:
        first = next(iter(plan["dances"].values()))
        ids["dances"] += dances.dance_ids(DANCE_PREFIX, len(first))
        if "novice" in plan:
            ids["dances"] += [
                f"{DANCE_PREFIX}-novice-{k}" for k in ("original", "novice", "improved")
            ]
    if "driving" in plan:
        ids["driving"] += [f"{DRIVE_PREFIX}-{k}" for k in DRIVEN]
    return ids


def check_made(found: Mapping[str, Motion], wanted: Sequence[str]) -> None:
    """Raise if a job did not make exactly the motions it was to make."""
    if set(found) != set(wanted):
        missing, extra = sorted(set(wanted) - set(found)), sorted(set(found) - set(wanted))
        raise MotionStyleError(f"style machines: motions missing {missing}, unexpected {extra}")


COLUMNS = {
    "explained_variance": gaits.EXPLAINED_COLUMNS,
    "style_dof": gaits.DOF_COLUMNS,
    "analogies": a.ANALOGY_COLUMNS,
    "held_out": held_out.HELD_OUT_COLUMNS,
    "dance_model": dances.DANCE_COLUMNS,
    "novice": dances.NOVICE_COLUMNS,
    "path_map": driving.PATH_MAP_COLUMNS,
    "shmm_figure_checks": checks.CHECK_COLUMNS,
    "shmm_sensitivity": checks.SENSITIVITY_COLUMNS,
    "shmm_twin": twins.TWIN_COLUMNS,
}
