"""Planted motions have exactly the parameters they claim, on a small gait made here."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionstyle.body.body import BodyGeometry, build_body
from motionstyle.body.kinematics import contact_points, forward_kinematics
from motionstyle.body.layout import CONTACT_POINTS, COORDINATE_INDEX, COORDINATES, NODE_INDEX, NODES
from motionstyle.errors import MotionStyleError
from motionstyle.mocap.fitting.floor import runs
from motionstyle.mocap.planted.legs import Leg, solve_leg
from motionstyle.mocap.planted.variants import (
    PlantedRecipe,
    plant,
    shared_source_frames,
    source_frames_of,
)
from motionstyle.motion.motion import Motion
from motionstyle.motion.storage import load_motion, save_motion

CATALOGUE = Path(__file__).parents[2] / "config" / "planted.yaml"
CYCLE, RATE, STRIDE = 40, 30.0, 1.0
ANKLE, STANCE = 0.08, 0.6


def make_body():
    offsets = np.zeros((len(NODES), 3))
    points, ends = np.zeros((8, 3)), np.array([[0, 0.24, 0], [0, -0.18, 0], [0, -0.18, 0]])
    for side, sign in (("r", 1.0), ("l", -1.0)):
        offsets[NODE_INDEX[f"thigh_{side}"]] = [0.01, -0.05, 0.09 * sign]
        offsets[NODE_INDEX[f"shank_{side}"]] = [0.0, -0.41, 0.005 * sign]
        offsets[NODE_INDEX[f"foot_{side}"]] = [0.005, -0.42, 0.0]
        offsets[NODE_INDEX[f"toes_{side}"]] = [0.13, -0.06, 0.0]
        offsets[NODE_INDEX[f"upper_arm_{side}"]] = [0.0, 0.18, 0.17 * sign]
        offsets[NODE_INDEX[f"forearm_{side}"]] = [0.0, -0.29, 0.0]
        offsets[NODE_INDEX[f"hand_{side}"]] = [0.0, -0.26, 0.0]
        first = CONTACT_POINTS.index(f"heel_{side}")
        points[first : first + 4] = [
            [-0.05, -ANKLE, 0.0],
            [0.13, -ANKLE, -0.04 * sign],
            [0.13, -ANKLE, 0.04 * sign],
            [0.07, -ANKLE + 0.06, 0.0],
        ]
    offsets[NODE_INDEX["abdomen"]] = [0, 0.1, 0]
    offsets[NODE_INDEX["thorax"]] = [0, 0.15, 0]
    offsets[NODE_INDEX["head"]] = [0, 0.28, 0]
    return build_body(BodyGeometry(offsets, points, ends), 70.0)


BODY = make_body()


def foot_path(phase, sign):
    """Return ankle positions, pitch and stance of one foot at phases counted from touch-down."""
    turn, within = np.floor(phase), np.mod(phase, 1.0)
    stance = within < STANCE
    s = np.clip((within - STANCE) / (1 - STANCE), 0, 1)
    ease = s**3 * (10 - 15 * s + 6 * s**2)
    x = STRIDE * (turn + STANCE / 2 + ease)
    y = ANKLE + 0.1 * np.sin(np.pi * s) ** 2
    pitch = -0.4 * np.sin(np.pi * s) ** 2 * np.cos(np.pi * s)
    return np.column_stack([x, y, np.full_like(x, 0.09 * sign)]), pitch, stance


def make_walk(asymmetry_deg=0.0, cycles=3):
    frames = CYCLE * cycles + 1
    phase = np.arange(frames) / CYCLE
    q = np.zeros((frames, len(COORDINATES)))
    q[:, 0] = STRIDE * phase
    q[:, 1] = 0.86 + 0.01 * np.cos(4 * np.pi * phase)
    wave = np.sin(2 * np.pi * phase)
    contacts = np.zeros((frames, 8), dtype=bool)
    turns = np.broadcast_to(np.eye(3), (frames, 3, 3))
    for side, sign, lead in (("r", 1.0, 0.0), ("l", -1.0, 0.5)):
        ankles, pitch, stance = foot_path(phase + lead, sign)
        ankles[:, 0] -= lead * STRIDE
        feet = np.tile(np.eye(3), (frames, 1, 1))
        feet[:, 0, 0] = feet[:, 1, 1] = np.cos(pitch)
        feet[:, 1, 0], feet[:, 0, 1] = np.sin(pitch), -np.sin(pitch)
        leg = Leg.of(BODY, side)
        q[:, leg.columns] = solve_leg(leg, q[:, :3], turns, ankles, feet)
        first = CONTACT_POINTS.index(f"heel_{side}")
        contacts[:, first : first + 4] = stance[:, None]
        q[:, COORDINATE_INDEX[f"shoulder_flexion_{side}"]] = -0.3 * sign * wave
        q[:, COORDINATE_INDEX[f"elbow_flexion_{side}"]] = 0.5 - 0.1 * sign * wave
    q[:, COORDINATE_INDEX["shoulder_abduction_r"]] += np.radians(asymmetry_deg) * (
        1 + np.cos(2 * np.pi * phase)
    )
    observed = np.array([not n.startswith(("toes", "thorax")) for n in COORDINATES])
    return Motion(
        id="gait",
        kind="captured",
        rate_hz=RATE,
        coordinates=q,
        body=BODY,
        contacts=contacts,
        contact_normals=np.tile([0.0, 1.0, 0.0], (frames, 8, 1)),
        observed=observed,
        provenance={
            "source": "gait.txt",
            "action": "walk",
            "style": "normal",
            "source_frames": f"0-{frames - 1}",
            "planted": False,
        },
    )


BASE = make_walk()
RECIPE = PlantedRecipe(id="p", base="gait", style="planted-x", cycle_frames=CYCLE, cycles=3)


def planted(base=BASE, **changes):
    return plant(base, replace(RECIPE, **changes))


NEUTRAL = planted()


def column(motion, name):
    return motion.coordinates[:, COORDINATE_INDEX[name]]


def points_of(motion):
    return contact_points(motion.body, motion.pose())


def slip_mm(motion):
    points, worst = points_of(motion)[..., [0, 2]], 0.0
    for p in range(8):
        for first, last in runs(motion.contacts[:, p]):
            path = points[first : last + 1, p]
            worst = max(worst, np.linalg.norm(path - path.mean(axis=0), axis=1).max())
    return 1000 * worst


def touch_downs(motion, point="heel_r"):
    bears = motion.contacts[:, CONTACT_POINTS.index(point)]
    return [first for first, _ in runs(bears) if first > 0]


def stride_m(motion):
    points = points_of(motion)[:, CONTACT_POINTS.index("heel_r")]
    bears = motion.contacts[:, CONTACT_POINTS.index("heel_r")]
    places = [np.median(points[a : b + 1], axis=0) for a, b in runs(bears) if b - a > 4]
    return float(np.mean(np.linalg.norm(np.diff(places, axis=0), axis=1)))


def swing_deg(motion, name="shoulder_flexion_r"):
    return float(np.degrees(np.ptp(column(motion, name))))


def lift_m(motion):
    heights = points_of(motion)[..., 1]
    return float(heights[:, :3].min(axis=1).max())


# --------------------------------------------------------------------------- legs in closed form


def test_solved_legs_put_the_foot_where_it_was():
    rng = np.random.default_rng(3)
    q = np.zeros((40, len(COORDINATES)))
    q[:, :6] = rng.normal(0, 0.3, (40, 6))
    for side in "rl":
        wanted = rng.uniform(-0.4, 0.4, (40, 6))
        wanted[:, 3] = rng.uniform(0.05, 2.0, 40)
        q[:, Leg.of(BODY, side).columns] = wanted
    pose = forward_kinematics(BODY, q)
    for side in "rl":
        leg, node = Leg.of(BODY, side), NODE_INDEX[f"foot_{side}"]
        found = solve_leg(
            leg, q[:, :3], pose.rotations[:, 0], pose.positions[:, node], pose.rotations[:, node]
        )
        np.testing.assert_allclose(found, q[:, leg.columns], atol=1e-9)


# --------------------------------------------------------------------------- one effect each


def test_no_change_keeps_the_base_but_for_the_straightest_knees():
    begin = round(NEUTRAL.provenance["start_phase"] * CYCLE)
    assert begin > 3  # far from the touch-down at 0
    expected = BASE.window(begin, BASE.frames - 1)
    for name in ("shoulder_flexion_r", "elbow_flexion_l", "abdomen_flexion", "pelvis_tx"):
        path = column(expected, name) - (column(expected, name)[0] if name[-2:] == "tx" else 0)
        np.testing.assert_allclose(column(NEUTRAL, name)[: len(path)], path, atol=1e-3)
    assert stride_m(NEUTRAL) == pytest.approx(STRIDE, rel=0.005)
    # the toe bears while the tip stays, so only heel and ball are compared
    rigid = [i for i, n in enumerate(CONTACT_POINTS) if not n.startswith("toe")]
    same = NEUTRAL.contacts[: expected.frames, rigid] == expected.contacts[:, rigid]
    assert same.mean() > 0.97


def test_motions_of_one_base_have_the_same_list_of_events():
    lists = set()
    for seed in range(6):
        window = ("even", "odd")[seed % 2]
        motion = planted(phase_noise=0.01, pose_noise_deg=1.0, seed=seed, source_window=window)
        events = []
        for foot in (slice(0, 4), slice(4, 8)):
            bears = motion.contacts[:, foot].any(axis=1)
            events += [(first, 1, foot.start) for first, _ in runs(bears)]
            events += [(last + 1, 0, foot.start) for _, last in runs(bears)]
        lists.add(tuple(event[1:] for event in sorted(events)))
    assert len(lists) == 1


def test_posture_offset_moves_the_mean_and_nothing_else():
    motion = planted(posture_offset_deg={"abdomen_flexion": 10.0, "shoulder_abduction": 5.0})
    change = np.degrees(motion.coordinates - NEUTRAL.coordinates)
    means = change.mean(axis=0)
    assert means[COORDINATE_INDEX["abdomen_flexion"]] == pytest.approx(10, rel=0.02)
    for side in "rl":
        assert means[COORDINATE_INDEX[f"shoulder_abduction_{side}"]] == pytest.approx(5, rel=0.02)
    touched = {"abdomen_flexion", "shoulder_abduction_r", "shoulder_abduction_l"}
    others = [i for i, n in enumerate(COORDINATES) if n not in touched]
    assert np.abs(change[:, others]).max() < 1e-9


def test_one_sided_posture_offset():
    motion = planted(posture_offset_deg={"elbow_flexion_l": 8.0})
    change = np.degrees(motion.coordinates - NEUTRAL.coordinates).mean(axis=0)
    assert change[COORDINATE_INDEX["elbow_flexion_l"]] == pytest.approx(8, rel=0.02)
    assert change[COORDINATE_INDEX["elbow_flexion_r"]] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("gain", [0.5, 1.4])
def test_arm_swing_gain_scales_the_swing_about_its_mean(gain):
    motion = planted(swing_gain={"arms": gain})
    for name in ("shoulder_flexion_r", "shoulder_flexion_l", "elbow_flexion_l"):
        assert swing_deg(motion, name) / swing_deg(NEUTRAL, name) == pytest.approx(gain, rel=0.02)
    assert stride_m(motion) == pytest.approx(stride_m(NEUTRAL), rel=1e-6)


@pytest.mark.parametrize("factor", [0.85, 1.25])
def test_cadence_scales_time_and_speed(factor):
    motion = planted(cadence=factor)
    seconds = [np.diff(touch_downs(m)).mean() / RATE for m in (motion, NEUTRAL)]
    assert seconds[1] / seconds[0] == pytest.approx(factor, rel=0.02)
    assert stride_m(motion) == pytest.approx(stride_m(NEUTRAL), rel=0.005)
    speeds = [np.polyfit(m.times, column(m, "pelvis_tx"), 1)[0] for m in (motion, NEUTRAL)]
    assert speeds[0] / speeds[1] == pytest.approx(factor, rel=0.02)


@pytest.mark.parametrize("factor", [0.7, 1.1])
def test_step_length_scales_the_steps_and_the_travel(factor):
    motion = planted(step_length=factor)
    assert stride_m(motion) / stride_m(NEUTRAL) == pytest.approx(factor, rel=0.02)
    travel = [column(m, "pelvis_tx")[-1] for m in (motion, NEUTRAL)]
    assert travel[0] / travel[1] == pytest.approx(factor, rel=0.02)
    assert np.diff(touch_downs(motion)).mean() == np.diff(touch_downs(NEUTRAL)).mean()
    assert lift_m(motion) == pytest.approx(lift_m(NEUTRAL), rel=0.02)
    assert swing_deg(motion) == pytest.approx(swing_deg(NEUTRAL), rel=1e-9)


def test_leg_swing_gain_scales_steps_and_lift():
    motion = planted(swing_gain={"legs": 1.1})
    assert stride_m(motion) / stride_m(NEUTRAL) == pytest.approx(1.1, rel=0.02)
    assert lift_m(motion) / lift_m(NEUTRAL) == pytest.approx(1.1, rel=0.02)


def test_pose_noise_has_its_rms_and_no_mean():
    motion = planted(pose_noise_deg=1.0, seed=5)
    change = np.degrees(motion.coordinates - NEUTRAL.coordinates)
    for name in ("shoulder_flexion_r", "abdomen_flexion", "head_rotation"):
        noise = change[:, COORDINATE_INDEX[name]]
        assert np.sqrt((noise**2).mean()) == pytest.approx(1.0, rel=0.02)
        assert noise.mean() == pytest.approx(0.0, abs=1e-9)
    unseen = change[:, COORDINATE_INDEX["thorax_flexion"]]
    assert np.abs(unseen).max() == 0


def test_phase_noise_shifts_time_by_its_rms():
    motion = planted(phase_noise=0.01, seed=5)
    travel = (column(motion, "pelvis_tx") - column(NEUTRAL, "pelvis_tx")) / STRIDE
    travel -= travel.mean()  # motions start over the origin
    assert np.sqrt((travel**2).mean()) == pytest.approx(0.01, rel=0.02)


# --------------------------------------------------------------------------- feet and knees


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"step_length": 0.7},
        {"step_length": 1.1, "cadence": 1.1},
        {"swing_gain": {"legs": 1.1, "arms": 1.5}},
        {"source_window": "even", "phase_noise": 0.01, "pose_noise_deg": 1.0, "seed": 1},
        {"source_window": "odd", "phase_noise": 0.01, "pose_noise_deg": 1.0, "seed": 2},
        {"source_window": "second_half", "posture_offset_deg": {"abdomen_flexion": 15}},
    ],
)
def test_feet_neither_skate_nor_sink_and_knees_bend_one_way(changes):
    motion = planted(**changes)
    assert slip_mm(motion) < 5
    assert points_of(motion)[..., 1].min() > -0.005
    assert points_of(motion)[motion.contacts][:, 1].max() < 0.016
    for side in "rl":
        assert column(motion, f"knee_flexion_{side}").min() > np.radians(2)
    accelerations = [np.abs(np.diff(m.coordinates[:, 6:], 2, axis=0)).max() for m in (motion, BASE)]
    assert accelerations[0] < 2 * accelerations[1]


def test_a_clip_that_does_not_loop():
    clip = replace(BASE.window(10, 90), id="clip")
    recipe = replace(RECIPE, base="clip", cycle_frames=None, cycles=1)
    neutral, shorter = plant(clip, recipe), plant(clip, replace(recipe, step_length=0.8))
    assert neutral.frames == clip.frames
    assert stride_m(shorter) / stride_m(neutral) == pytest.approx(0.8, rel=0.02)
    assert slip_mm(shorter) < 5
    with pytest.raises(MotionStyleError, match="no half cycles"):
        plant(clip, replace(recipe, source_window="first_half"))


# --------------------------------------------------------------------------- seeds and frames


def test_same_seed_same_bits_other_seed_other_motion():
    noisy = {"phase_noise": 0.01, "pose_noise_deg": 1.0}
    first, again = (planted(**noisy, seed=7) for _ in range(2))
    assert first.coordinates.tobytes() == again.coordinates.tobytes()
    assert first.contacts.tobytes() == again.contacts.tobytes()
    other = planted(**noisy, seed=8)
    assert np.abs(first.coordinates - other.coordinates).max() > 1e-3


def test_takes_of_every_second_frame_share_no_source_frame():
    even, odd = planted(source_window="even"), planted(source_window="odd")
    assert source_frames_of(even) == {("gait.txt", f) for f in range(0, CYCLE // 2, 2)}
    assert shared_source_frames(even, odd) == 0
    assert shared_source_frames(even, NEUTRAL) == len(source_frames_of(even))


def test_a_mirrored_second_half_is_no_second_take():
    first, second = (planted(source_window=f"{n}_half") for n in ("first", "second"))
    assert first.provenance["source_frames"] != second.provenance["source_frames"]
    assert shared_source_frames(first, second) == CYCLE // 2


def test_the_halves_of_an_asymmetric_cycle_are_two_takes():
    base = make_walk(asymmetry_deg=12.0)
    first, second = (planted(base, source_window=f"{n}_half") for n in ("first", "second"))
    assert shared_source_frames(first, second) == 0
    assert slip_mm(first) < 5


def test_source_frames_of_a_captured_motion_and_of_nonsense():
    assert len(source_frames_of(BASE)) == BASE.frames
    assert shared_source_frames(BASE, planted(source_window="odd")) > 0
    odd = replace(BASE, provenance={"source_frames": "all"})
    with pytest.raises(MotionStyleError, match="source_frames has 'all'"):
        source_frames_of(odd)


# --------------------------------------------------------------------------- labels


def test_everything_says_planted(tmp_path):
    motion = planted(step_length=0.9, posture_offset_deg={"head_flexion": 4.0}, seed=3)
    known = motion.provenance
    assert motion.kind == "planted"
    assert known["planted"] is True
    for key in ("style", "edit", "title"):
        assert "planted" in known[key]
    assert known["example"] == "gait"
    assert known["seed"] == 3
    assert known["truth"]["step_length"] == 0.9
    assert known["truth"]["posture_offset_deg"] == {"head_flexion": 4.0}
    path = tmp_path / "motions" / "planted" / "p.npz"
    save_motion(path, motion)
    assert load_motion(path).provenance == known


def test_another_base_is_refused():
    with pytest.raises(MotionStyleError, match="the base is gait, not other"):
        plant(BASE, replace(RECIPE, base="other"))


def test_a_style_must_say_planted():
    with pytest.raises(MotionStyleError, match="contains 'planted'"):
        replace(RECIPE, style="happy")


# --------------------------------------------------------------------------- refusals


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"step_length": 2.5}, "step_length 2.5 is infeasible"),
        ({"swing_gain": {"legs": 2.5}}, "swing_gain legs 2.5 is infeasible"),
        ({"posture_offset_deg": {"abdomen_flexion": 60}}, "posture_offset_deg abdomen_flexion"),
        ({"posture_offset_deg": {"elbow_flexion": -60}}, "posture_offset_deg elbow_flexion"),
        ({"phase_noise": 0.1, "seed": 1}, "phase_noise 0.1"),
        ({"posture_offset_deg": {"thorax_flexion": 5}}, "does not show"),
        ({"cycle_frames": 33}, "is not its cycle"),
        ({"cycle_frames": 4}, "cycle_frames is 4"),
    ],
)
def test_what_cannot_be_is_refused_by_name(changes, named):
    with pytest.raises(MotionStyleError, match=named):
        planted(**changes)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"posture_offset_deg": {"abdomen_flexoin": 5}}, "did you mean abdomen_flexion"),
        ({"posture_offset_deg": {"knee_flexion": 5}}, "follows from pelvis and feet"),
        ({"swing_gain": {"arm": 1.2}}, "did you mean arms"),
        ({"source_window": "evn"}, "did you mean even"),
        ({"cadence": 0.0}, "cadence is 0"),
        ({"cycle_frames": None}, "has 1"),
    ],
)
def test_wrong_recipes_are_refused(changes, said):
    with pytest.raises(MotionStyleError, match=said):
        replace(RECIPE, **changes)
