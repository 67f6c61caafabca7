"""Experiments of style machines on made-up walks and dances, whose answers are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motionstyle.body.layout import COORDINATE_INDEX
from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.style_machines import (
    analogies,
    checks,
    cycles,
    dances,
    driving,
    gaits,
    held_out,
    synthesis,
)
from motionstyle.evaluation.style_machines.store import load_arrays, save_arrays
from motionstyle.mocap.fitting.floor import StanceThresholds
from motionstyle.shmm.features import coordinates_of
from motionstyle.shmm.machine import MachineSettings, learn_machine
from motionstyle.shmm.schedule import Schedule
from synthetic_walk import RATE, SPEED, STEP, STRIDE, WIDTH, make_walk

LIGHT = MachineSettings(
    states=14,
    dimensions=4,
    style_dof=2,
    block_weights=(1.0, 0.1, 0.1),
    longest_s=3.0,
    schedule=Schedule(start_temperature=2.0, steps=20),
)


def walker(swing=20.0, lean=0.0, stretch=1.0, seed=0, frames=420):
    """Return the made-up walk with arms that swing, a trunk that leans, and another tempo."""
    motion = make_walk(frames)
    q = motion.coordinates.copy()
    phase = 2 * np.pi * (np.arange(frames) - 30) / STRIDE
    noise = np.random.default_rng(seed).normal(scale=0.002, size=(frames, 2))
    for k, (side, sign) in enumerate((("r", -1), ("l", 1))):
        column = COORDINATE_INDEX[f"shoulder_flexion_{side}"]
        q[:, column] = np.radians(sign * swing / 2 * np.cos(phase)) + noise[:, k]
        q[:, COORDINATE_INDEX[f"elbow_flexion_{side}"]] = 0.4 + 0.1 * np.cos(phase * sign)
    q[:, COORDINATE_INDEX["abdomen_flexion"]] = np.radians(lean)
    return replace(
        motion, id=f"walk-{swing:g}-{lean:g}-{stretch:g}-{seed}", coordinates=q,
        rate_hz=RATE / stretch,
    )  # fmt: skip


@pytest.fixture(scope="module")
def four():
    """Slow and fast, each with calm and with wide arms: the fast wide one is the answer."""
    return {
        "walk:calm": walker(20.0),
        "walk:wide": walker(60.0),
        "run:calm": walker(20.0, 15.0, 0.7),
        "run:wide": walker(60.0, 15.0, 0.7),
    }


def test_cycles_and_numbers_of_a_known_walk():
    walk = walker(40.0)
    cycle = cycles.mean_cycle(walk)
    assert cycle.period_s == pytest.approx(STRIDE / RATE, abs=0.01)
    numbers = cycles.gait_numbers(walk)
    assert numbers.speed_mps == pytest.approx(SPEED, rel=0.01)
    assert numbers.cadence == pytest.approx(120.0, rel=0.01)
    assert numbers.arm_swing_deg == pytest.approx(40.0, rel=0.03)
    assert numbers.step_length_m == pytest.approx(STEP, rel=0.02)
    assert synthesis.step_width_cm(walk) == pytest.approx(100 * WIDTH, abs=0.5)
    assert synthesis.skate_mm(walk) < 15.0


def test_distances_ignore_where_a_cycle_begins_and_measure_offsets():
    a = cycles.mean_cycle(walker())
    later = cycles.mean_cycle(walker().window(37, 419))
    assert cycles.pose_distance_deg(a, later) < 0.6
    leaning = cycles.mean_cycle(walker(lean=29.0))
    assert cycles.pose_distance_deg(a, leaning) == pytest.approx(29.0 / np.sqrt(29), rel=0.02)


def test_a_motion_without_cycles_is_an_error():
    with pytest.raises(MotionStyleError, match="no complete gait cycle"):
        cycles.mean_cycle(walker().window(0, 60))


def test_repeating_a_mean_cycle_gives_the_walk_again():
    walk = walker(30.0)
    cycle = cycles.mean_cycle(walk)
    q, _ = coordinates_of(cycles.repeated(cycle, 3, RATE), RATE)
    again = replace(
        walk, coordinates=q, contacts=walk.contacts[: len(q)],
        contact_normals=walk.contact_normals[: len(q)],
    )  # fmt: skip
    assert cycles.gait_numbers(again).speed_mps == pytest.approx(SPEED, rel=0.02)
    assert cycles.pose_distance_deg(cycle, cycles.mean_cycle(again)) < 0.5


def test_an_additive_analogy_is_answered(four):
    """The answer is held out; every method that adds should find it, the source run should not."""
    g = analogies.Gaits(
        {s: four[f"walk:{s}"] for s in ("calm", "wide")},
        {s: four[f"run:{s}"] for s in ("calm", "wide")},
    )
    facts = {"config": "test", "data": "planted", "set": "made-up", "take": "1"}
    variants = {"pooled": analogies.Variant(own_change=0.0)}
    rows, found = analogies.analogy_rows(g, LIGHT, facts, variants)
    assert set(found) == {("calm", "wide"), ("wide", "calm")}
    assert len(rows) == 2 * (len(analogies.METHODS) + 1)
    by = {(r["pair"], r["method"]): r for r in rows}
    own = by["calm>wide", "style_machine"]
    assert own["status"] == "ok"
    assert own["pose_distance_deg"] < 0.6 * by["calm>wide", "source_run"]["pose_distance_deg"]
    assert own["arm_swing_deg"] == pytest.approx(60.0, rel=0.2)
    assert abs(own["cadence_error"]) < 0.1 * by["calm>wide", "source_run"]["cadence"]
    assert by["calm>wide", "linear_mixing"]["pose_distance_deg"] < 1.0
    pooled = by["calm>wide", "style_machine_pooled"]  # one other style: its own change is the mean
    assert pooled["pose_distance_deg"] == pytest.approx(own["pose_distance_deg"], rel=0.05)


def test_styles_without_contacts_are_left_out(four):
    bare = replace(four["run:wide"], contacts=np.zeros_like(four["run:wide"].contacts))
    g = analogies.Gaits(
        {"calm": four["walk:calm"], "wide": four["walk:wide"]},
        {"calm": four["run:calm"], "wide": bare},
    )
    good, left_out = analogies.usable_styles(g)
    assert good == ["calm"]
    assert "has 0 contacts, needs 4" in left_out["wide"]


def test_an_unknown_clip_in_an_analogy_is_one_clear_error(four):
    machine = learn_machine(list(four.values()), list(four), LIGHT)
    with pytest.raises(MotionStyleError, match=r"'walk:clam' is no model.*did you mean walk:calm"):
        analogies.analogy(machine, "walk:clam", "run:calm", "walk:wide")


def test_explained_variance_and_styled_gaits(four):
    motions = list(four.values())
    rows, machine = gaits.explained_variance(motions, LIGHT, {"set": "four"})
    shares = {(r["prior"], r["dof"]): r["cumulative_share"] for r in rows}
    assert shares["cross_entropy", 2] > 0.9
    assert shares["cross_entropy", 4] == pytest.approx(1.0)
    names = [m.id for m in motions]
    roles = dict(zip(("walk", "strut", "run", "cat"), names, strict=True))
    made = gaits.styled_gaits(machine, roles, StanceThresholds(), "gait")
    assert [m.id for m, _ in made] == gaits.styled_gait_ids("gait")
    table = gaits.gait_table_rows(made, machine.motions, {"config": "test"})
    by = {
        (r["experiment"], r["role"], r["content"]): r for r in table if r["experiment"] == "sm-F5"
    }
    x, run = by["sm-F5", "x", "gait"], by["sm-F5", "run", "gait"]
    assert x["arm_swing_deg"] > 1.3 * run["arm_swing_deg"]
    assert all(set(r) <= set(synthesis.SYNTHESIS_COLUMNS) for r in table)
    axis_rows, shown = gaits.style_dof_rows(machine, {})
    assert len(axis_rows) == 2 * len(gaits.QUANTITIES)
    assert set(shown) == {(d, s) for d in (1, 2) for s in (-1, 1)}
    sets = gaits.drawn_sets(names, 3, 2, 7)
    assert sets == gaits.drawn_sets(names[::-1], 3, 2, 7)
    assert gaits.drawn_sets(names, 3, 9, 7) == []


def test_held_out_takes_and_retrieval():
    learn = {"calm": [walker(20.0, seed=1)], "wide": [walker(70.0, seed=2)]}
    tried = {"calm": [walker(22.0, seed=3)], "wide": [walker(66.0, seed=4)]}
    rows = held_out.held_out_rows(learn, tried, LIGHT, {"config": "test", "set": "two"})
    likelihood = [r for r in rows if r["test"] == "likelihood"]
    assert len(likelihood) == 6
    assert np.isfinite([r["loglik_nat_per_frame"] for r in likelihood]).all()
    found = {(r["motion"], r["method"]): r["correct"] for r in rows if r["test"] == "retrieval"}
    assert all(found.values())
    numbers, panels = held_out.three_walks(
        [learn["calm"][0], learn["wide"][0]], [tried["calm"][0], tried["wide"][0]], LIGHT
    )
    assert numbers["state_spread_cross_entropy"] < numbers["state_spread_individual"]
    assert panels["cross_means"].shape[0] == 2


def test_phases_are_told_apart_without_labels(four):
    machine = learn_machine(list(four.values()), list(four), LIGHT)
    purity, chance = checks.phase_purity(machine.machine.occupancy, machine.motions)
    assert purity > chance + 0.2
    assert 0.05 < chance < 0.5


def test_priors_shrink_and_draw_steadily():
    numbers = checks.prior_numbers(checks.prior_ellipses())
    assert numbers == {"share_volume_falls": 1.0, "share_divergence_falls": 1.0}


DANCE = replace(LIGHT, states=20, longest_s=6.0, hint_dimensions=0)


def test_dances_are_made_as_announced(four):
    motions = [four["walk:calm"], four["walk:wide"]]
    machine, row = dances.dance_machine(motions, DANCE, {"model": "m"})
    assert row["frames"] == sum(len(g) for g in machine.machine.occupancy)
    assert 0 <= row["occupancy_entropy_bit"] < 0.5
    made = dances.dance_syntheses(machine, StanceThresholds(), "dance", 0)
    assert [m.id for m, _ in made] == dances.dance_ids("dance", 2)
    assert all(np.isfinite(m.coordinates).all() for m, _ in made)
    first = [facts for _, facts in made if facts["experiment"] == "sm-F0"]
    assert sum(bool(f["style_recognised"]) for f in first) >= 3


def test_a_simulated_novice_is_labelled_and_improved(four):
    original = dances.prepared(walker(40.0, seed=9), DANCE)
    options = {"noise_deg": 4.0, "tempo": 0.1, "swaps": 1, "seeds": [1]}
    novice, source = dances.simulated_novice(original, seed=1, noise_deg=4.0, tempo=0.1, swaps=1)
    assert novice.provenance["simulated_novice"] is True
    assert not np.array_equal(source, np.sort(source))  # pieces in the wrong order
    machine, _ = dances.dance_machine([four["walk:calm"], four["walk:wide"]], DANCE, {})
    rows, _ = dances.novice_rows(machine, original, machine.names[0], options, {})
    assert rows[0]["simulated"] is True
    assert rows[0]["jerk_ratio"] < 0.9
    assert rows[0]["loglik_gain_nat_per_frame"] > 0


def test_cues_do_not_know_where_the_dancer_stands(four):
    walk = four["walk:wide"].window(100, 160)
    moved = walk.coordinates.copy()
    moved[:, 0] += 3.0
    images = driving.silhouettes(walk)
    elsewhere = driving.silhouettes(replace(walk, coordinates=moved))
    assert (images != elsewhere).mean() < 1e-3  # rounding at the edges of pixels
    moments = driving.silhouette_moments(images)
    assert moments.shape == (61, 10)
    assert ((moments[:, 0] > 0.005) & (moments[:, 0] < 0.5)).all()
    assert moments[:, 5].mean() > moments[:, 3].mean()  # a standing body is taller than wide
    assert driving.cue_of(walk, "points", 0.03, 0).shape == (61, 28)


def test_a_dance_is_driven_by_its_cue(four):
    motions = [four["walk:calm"], four["walk:wide"]]
    options = {"hold_out_share": 0.25, "points_noise_m": 0.01}
    rows, shown, _ = driving.driving_rows(motions, DANCE, options, {"config": "test"})
    errors = {(r["cue"], r["method"], r["dance"]): r["joint_rms_deg"] for r in rows}
    own = [v for (cue, method, _), v in errors.items() if (cue, method) == ("points", "path_map")]
    assert max(own) < 6.0
    assert [label for label, _ in shown] == ["truth", "path_map", "path_map_restyled"]


def test_arrays_are_the_same_bytes(tmp_path):
    arrays = {"b": np.arange(3.0), "a": np.array(["x"])}
    save_arrays(tmp_path / "one.npz", arrays)
    save_arrays(tmp_path / "two.npz", dict(reversed(arrays.items())))
    assert (tmp_path / "one.npz").read_bytes() == (tmp_path / "two.npz").read_bytes()
    np.testing.assert_array_equal(load_arrays(tmp_path / "one.npz")["b"], arrays["b"])
    (tmp_path / "one.npz").write_bytes(b"no")
    with pytest.raises(MotionStyleError, match="not readable"):
        load_arrays(tmp_path / "one.npz")
