"""From a marker file to a motion: a known body in a known walk, gaps, belts, real clips."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_body_fit import known_gait
from test_contacts import SETTINGS, assert_stances
from test_markerset import SETS

from marker_person import forces_file, places, synthetic_markers, write_set, write_trc
from motionstyle.body.body import BodyGeometry, build_body
from motionstyle.body.layout import COORDINATE_INDEX, COORDINATES, NODE_INDEX
from motionstyle.errors import MotionStyleError
from motionstyle.mocap.datasets.doors import read_datasets
from motionstyle.mocap.datasets.sheet import ClipRow, read_sheet
from motionstyle.mocap.formats.marker_clip import ForceRecord
from motionstyle.mocap.markers.ingest import ingest_markers, placed_forces
from motionstyle.mocap.markers.joints import common_centre
from motionstyle.mocap.markers.markerset import Plates, read_marker_set
from motionstyle.mocap.markers.paths import Placement, fill_gaps
from motionstyle.mocap.markers.plate_feet import forces_by_foot, middle_of_feet

MIRROR = Path(__file__).parents[3] / "shared" / "mocap"
CONFIG = Path(__file__).parents[2] / "config"
RATE = 100.0
UNFILTERED = replace(SETTINGS, cutoff_hz={"default": 50.0})  # not below 0.45 of the rate
SIDED = ("hip_flexion", "hip_adduction", "hip_rotation", "knee_flexion", "ankle_dorsiflexion")
LEGS = [COORDINATE_INDEX[f"{name}_{side}"] for name in SIDED for side in "rl"]


def row(path, **changes):
    values = dict.fromkeys(ClipRow.__dataclass_fields__)
    values |= {
        "id": "made", "path": path.name, "action": "walk", "cycles": 1, "skeleton": "lab",
        "level": "physical", "surface": "level", "mirror": False, "experiments": (), "row": 2,
        "folder": path.parent,
    }  # fmt: skip
    return ClipRow(**(values | changes))


@pytest.fixture(scope="module")
def gait(plain_body):
    return known_gait(plain_body, rate_hz=RATE, thorax=False)


@pytest.fixture
def lab(tmp_path):
    return write_set(tmp_path)


def ingest(path, lab, *, settings=UNFILTERED, static=None, forces=None, mass=70.0, **changes):
    return ingest_markers(
        row(path, **changes), path, lab, settings, static_file=static, forces_file=forces,
        default_mass_kg=mass, default_sex="male",
    )  # fmt: skip


def files(folder, gait, standing, name="walk.trc", **options):
    """Write the walk (without medial markers) and the static trial (with them)."""
    medial = ("knee_medial", "ankle_medial", "elbow_medial")
    walk = synthetic_markers(gait.body, gait.coordinates, RATE, without=medial)
    walk = replace(walk, **{k: v(walk) for k, v in options.items()})
    still = synthetic_markers(gait.body, np.tile(standing, (20, 1)), RATE)
    return write_trc(folder / name, walk), write_trc(folder / "static.trc", still)


def test_a_known_walk_comes_back_with_its_lengths_angles_and_stances(tmp_path, lab, gait, standing):
    walk, static = files(tmp_path, gait, standing)
    found = ingest(walk, lab, static=static)
    motion, body = found.motion, gait.body
    lengths = np.linalg.norm(motion.body.joint_offsets - body.joint_offsets, axis=1)
    for node in ("thigh_r", "shank_l", "foot_r", "toes_l", "forearm_l", "hand_r", "head"):
        assert lengths[NODE_INDEX[node]] < 0.012, node
    assert motion.body.leg_length == pytest.approx(body.leg_length, abs=0.004)
    assert found.report["marker_rms_cm"] < 0.6
    assert found.report["markers_missing_pct"] == 0
    away = np.degrees(motion.coordinates - gait.coordinates)
    assert np.sqrt((away[:, LEGS] ** 2).mean()) < 1.5
    elbows = [COORDINATE_INDEX[f"elbow_flexion_{side}"] for side in "rl"]
    assert np.sqrt((away[:, elbows] ** 2).mean()) < 2.0
    assert np.abs(motion.coordinates[:, :3] - gait.coordinates[:, :3]).max() < 0.01
    assert_stances(gait, motion.contacts, frames=3)
    assert motion.observed.all()
    assert motion.provenance["measured_on"] == "static.trc"


def test_without_a_static_trial_the_walk_itself_tells_the_lengths(tmp_path, lab, gait, standing):
    walk, _ = files(tmp_path, gait, standing)
    found = ingest(walk, lab)
    assert found.motion.body.leg_length == pytest.approx(gait.body.leg_length, abs=0.02)
    assert found.report["marker_rms_cm"] < 1.0
    away = np.degrees(found.motion.coordinates - gait.coordinates)[:, LEGS]
    assert np.sqrt(((away - away.mean(axis=0)) ** 2).mean()) < 2.5
    assert found.motion.provenance["measured_on"] == "walk.trc"


def test_the_static_trial_scales_the_body_and_not_the_walk(tmp_path, lab, gait, standing):
    """A trial of somebody a tenth larger: lengths are theirs, though the walk shows others."""
    walk, _ = files(tmp_path, gait, standing)
    small, geometry = gait.body, gait.body.geometry
    larger = build_body(
        BodyGeometry(
            1.1 * geometry.joint_offsets, 1.1 * geometry.contact_points, 1.1 * geometry.end_points
        ),
        small.mass,
    )
    standing = standing.copy()
    standing[0, 1] *= 1.1
    still = synthetic_markers(larger, np.tile(standing, (20, 1)), RATE)
    static = write_trc(tmp_path / "larger.trc", still)
    scaled = ingest(walk, lab, static=static).motion
    own = ingest(walk, lab).motion
    assert own.body.leg_length == pytest.approx(small.leg_length, abs=0.02)
    assert scaled.body.leg_length == pytest.approx(1.1 * small.leg_length, abs=0.01)
    for node in ("shank_r", "foot_l", "forearm_r"):
        length = np.linalg.norm(small.joint_offsets[NODE_INDEX[node]])
        found = np.linalg.norm(scaled.body.joint_offsets[NODE_INDEX[node]])
        assert found == pytest.approx(1.1 * length, abs=0.01), node
    assert scaled.provenance["measured_on"] == "larger.trc"


def test_a_walk_in_any_direction_is_turned_and_moved(tmp_path, lab, gait, standing):
    turn = np.array([[0.6, 0, -0.8], [0, 1, 0], [0.8, 0, 0.6]])
    path, static = files(
        tmp_path, gait, standing, positions=lambda c: c.positions @ turn.T + [3.0, 0, -2.0]
    )
    motion = ingest(path, lab, static=static).motion
    assert np.abs(motion.coordinates[:, :3] - gait.coordinates[:, :3]).max() < 0.01
    placement = Placement.from_json(motion.provenance["placement"])
    np.testing.assert_allclose(placement.rotation, turn.T, atol=0.02)


def test_z_up_files_turn_upright(tmp_path, lab, gait, standing):
    walk, static = files(tmp_path, gait, standing)
    expected = ingest(walk, lab, static=static).motion.coordinates
    folder = tmp_path / "z"
    folder.mkdir()
    lay = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    body = gait.body
    medial = ("knee_medial", "ankle_medial", "elbow_medial")
    made = [
        synthetic_markers(body, gait.coordinates, RATE, without=medial),
        synthetic_markers(body, np.tile(standing, (20, 1)), RATE),
    ]
    paths = [
        write_trc(folder / name, replace(clip, positions=clip.positions @ lay.T))
        for name, clip in zip(("walk.trc", "static.trc"), made, strict=True)
    ]
    found = ingest(paths[0], lab, static=paths[1], up_axis="z").motion.coordinates
    np.testing.assert_allclose(found, expected, atol=1e-5)


def test_gaps_are_bridged_or_left_out(tmp_path, lab, gait, standing):
    def gapped(clip):
        positions = np.array(clip.positions)
        positions[40:50, clip.labels.index("M_knee_lateral_r")] = np.nan  # 0.1 s
        positions[100:160, clip.labels.index("M_thigh0_l")] = np.nan  # 0.6 s
        positions[:30, clip.labels.index("M_acromion_l")] = np.nan
        return positions

    walk, static = files(tmp_path, gait, standing, positions=gapped)
    found = ingest(walk, lab, static=static)
    away = np.degrees(found.motion.coordinates - gait.coordinates)[:, LEGS]
    assert np.sqrt((away**2).mean()) < 1.6
    assert found.report["markers_missing_pct"] == pytest.approx(
        100 * 100 / (len(gait.coordinates) * (len(places(gait.body)) - 6)), rel=1e-6
    )
    assert "M_thigh0_l 21 %" in found.report["warnings"]
    assert np.isfinite(list(found.marker_rms_cm.values())).all()


def test_weights_of_gaps(gait):
    clip = synthetic_markers(gait.body, gait.coordinates, RATE)
    positions = np.array(clip.positions)
    positions[10:30, 0] = np.nan  # 0.2 s
    positions[50:71, 0] = np.nan  # 0.21 s
    positions[:5, 1] = np.nan
    paths, weights, seen = fill_gaps(replace(clip, positions=positions), clip.labels)
    assert np.isfinite(paths).all()
    assert weights[10:30, 0].all()
    assert not weights[50:71, 0].any()
    assert not weights[:5, 1].any()
    assert not seen[10:30, 0].any()


def test_a_belt_is_told_from_the_feet_and_taken_away(tmp_path, lab, gait, standing):
    belt = np.array([1.2, 0.0, 0.0])
    path, static = files(
        tmp_path, gait, standing, name="belt_walk.trc",
        positions=lambda c: c.positions - (np.arange(c.frames) / RATE)[:, None, None] * belt,
    )  # fmt: skip
    found = ingest(path, lab, static=static)
    assert found.report["belt_mps"] == pytest.approx(1.2, abs=0.02)
    travelled = np.ptp(found.motion.coordinates[:, 0])
    assert travelled == pytest.approx(np.ptp(gait.coordinates[:, 0]), abs=0.08)
    assert_stances(gait, found.motion.contacts, frames=3)


def test_arms_and_head_that_no_marker_shows_stay_neutral(tmp_path, lab, gait, standing):
    without = ("head", "c7", "t10", "clav", "stern", "acro", "elbow", "wrist", "knee_m", "ankle_m")
    clip = synthetic_markers(gait.body, gait.coordinates, RATE, without=without)
    motion = ingest(write_trc(tmp_path / "walk.trc", clip), lab).motion
    seen = {name for name, one in zip(COORDINATES, motion.observed, strict=True) if one}
    assert {"hip_flexion_r", "toes_extension_l", "pelvis_tx"} <= seen
    assert not any(n.startswith(("abdomen", "thorax", "head", "should", "elbow")) for n in seen)
    idle = motion.coordinates[:, ~motion.observed]
    assert np.ptp(idle, axis=0).max() == 0
    flexion = COORDINATE_INDEX["abdomen_flexion"]  # upright against the pelvis' tilt of −4°
    assert np.degrees(motion.coordinates[0, flexion]) == pytest.approx(-4, abs=1.5)


def test_without_markers_at_knee_and_ankle_the_clusters_tell_them(tmp_path, lab, gait):
    clip = synthetic_markers(gait.body, gait.coordinates, RATE, without=("knee", "ankle"))
    body = ingest(write_trc(tmp_path / "walk.trc", clip), lab).motion.body
    for side in "rl":
        for node in ("shank", "foot"):
            at = NODE_INDEX[f"{node}_{side}"]
            length = np.linalg.norm(body.joint_offsets[at])
            assert length == pytest.approx(np.linalg.norm(gait.body.joint_offsets[at]), abs=0.025)


def test_a_common_centre_is_found_exactly(plain_body, gait):
    clip = synthetic_markers(plain_body, gait.coordinates, RATE)
    thigh = np.stack([clip.path(f"M_thigh{k}_r") for k in range(3)], axis=1)
    shank = np.stack([clip.path(f"M_shank{k}_r") for k in range(3)], axis=1)
    middle = (clip.path("M_knee_lateral_r") + clip.path("M_knee_medial_r")) / 2
    axis = clip.path("M_knee_lateral_r") - clip.path("M_knee_medial_r")
    centre, found = common_centre(thigh, shank, hinge=True)
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    np.testing.assert_allclose(np.abs((found * axis).sum(axis=1)), 1.0, atol=1e-6)
    off = centre - middle
    off -= (off * axis).sum(axis=1, keepdims=True) * axis
    assert np.abs(off).max() < 1e-6


def test_the_mass_is_the_sheets_or_the_default_never_the_plates(tmp_path, lab, gait, standing):
    walk, static = files(tmp_path, gait, standing)
    forces = forces_file(tmp_path)
    given = ingest(walk, lab, static=static, forces=forces, mass_kg=81.5).motion.body
    assert (given.mass, given.mass_source) == (pytest.approx(81.5), "sheet")
    default = ingest(walk, lab, static=static, forces=forces).motion.body
    assert (default.mass, default.mass_source) == (pytest.approx(70.0), "default")


def test_forces_follow_the_clip_to_its_frame_and_clock(tmp_path, lab, gait, standing):
    turn = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    walk, static = files(
        tmp_path, gait, standing,
        positions=lambda c: c.positions @ turn.T + [3.0, 0, -2.0], start_s=lambda _: 0.25,
    )  # fmt: skip
    motion = ingest(walk, lab, static=static).motion
    record = placed_forces(motion, forces_file(tmp_path), read_marker_set(lab, "lab"))
    assert record.start_s == pytest.approx(0.25)
    at = turn.T @ (np.array([0.1, 0.0, 0.2]) - [3.0, 0, -2.0])
    np.testing.assert_allclose(record.centre[0, 0], at, atol=0.02)
    np.testing.assert_allclose(record.force[0, 0], [0, 700, 0], atol=1e-6)


@pytest.mark.parametrize("mass", [0.0, -70.0, np.nan])
def test_a_mass_that_is_not_positive_is_refused(tmp_path, lab, gait, standing, mass):
    walk, static = files(tmp_path, gait, standing)
    with pytest.raises(MotionStyleError, match=r"body mass is .* kg; it must be a positive number"):
        ingest(walk, lab, static=static, mass_kg=mass)


def test_a_flipped_plate_is_refused(tmp_path, lab, gait, standing):
    walk, static = files(tmp_path, gait, standing)
    with pytest.raises(MotionStyleError, match="mean vertical force is negative on plate 'left'"):
        ingest(walk, lab, static=static, forces=forces_file(tmp_path, sign=-1.0))


def test_plates_in_another_unit_are_refused(tmp_path, lab, gait, standing):
    """Centres written in mm, read in m, lie a hundred metres from the person."""
    walk, static = files(tmp_path, gait, standing)
    forces = forces_file(tmp_path, rows=2000)
    text = forces.read_text(encoding="utf-8").replace("1.000000e-01", "1.000000e+02")
    forces.write_text(text, encoding="utf-8")
    with pytest.raises(MotionStyleError, match=r"grf\.mot: the centre of pressure lies .* `unit`"):
        ingest(walk, lab, static=static, forces=forces)


def test_a_marker_of_no_need_that_is_never_seen_is_left_out(tmp_path, lab, gait, standing):
    def unseen(clip):
        positions = np.array(clip.positions)
        positions[:, clip.labels.index("M_head_top")] = np.nan
        return positions

    walk, static = files(tmp_path, gait, standing, positions=unseen)
    found = ingest(walk, lab, static=static)
    assert "M_head_top" not in found.marker_rms_cm
    assert found.report["marker_rms_cm"] < 0.6


def test_a_static_trial_without_knees_is_refused(tmp_path, lab, gait, standing):
    walk, _ = files(tmp_path, gait, standing)
    clip = synthetic_markers(
        gait.body, np.tile(standing, (20, 1)), RATE, without=("knee_l", "thigh")
    )
    with pytest.raises(MotionStyleError, match=r"needed marker 'M_knee_lateral_r'.*static"):
        ingest(walk, lab, static=write_trc(tmp_path / "static.trc", clip))


def test_a_wrong_unit_in_the_sheet_is_refused(tmp_path, lab, gait, standing):
    walk, _ = files(tmp_path, gait, standing)
    with pytest.raises(MotionStyleError, match="is the unit mm"):
        ingest(walk, lab, unit="m")


def test_a_window_beyond_the_file_is_refused(tmp_path, lab, gait, standing):
    walk, _ = files(tmp_path, gait, standing)
    with pytest.raises(MotionStyleError, match="last_frame is 999"):
        ingest(walk, lab, last_frame=999)
    with pytest.raises(MotionStyleError, match="at least 8"):
        ingest(walk, lab, first_frame=10, last_frame=12)


def test_landmarks_never_seen_together_are_refused(tmp_path, lab, gait, standing):
    def apart(clip):
        positions = np.array(clip.positions)
        positions[:150, clip.labels.index("M_heel_r")] = np.nan
        positions[150:, clip.labels.index("M_heel_l")] = np.nan
        return positions

    walk, _ = files(tmp_path, gait, standing, positions=apart)
    with pytest.raises(MotionStyleError, match=r"seen together in 0 of .*'M_heel"):
        ingest(walk, lab)


def sheet_rows():
    datasets = read_datasets(CONFIG / "datasets.tsv")
    names = {p.stem for folder in (SETS, CONFIG / "skeletons") for p in folder.glob("*.yaml")}
    rows = read_sheet(CONFIG / "motions.full.tsv", datasets, skeletons=names)
    return [row for row in rows if row.path.endswith((".trc", ".c3d"))]


def test_every_marker_set_serves_a_clip_of_the_full_sheet():
    assert {r.skeleton for r in sheet_rows()} == {p.stem for p in SETS.glob("*.yaml")}


SPEEDS = {  # m/s along the way, and stances seen on the right and the left
    "rajagopal_walk": 1.25, "rajagopal_run": 3.73, "gait2354_walk": 1.10, "addb_walk": 1.6,
    "addb_stairs_up": 0.35, "opencap4_walk_1": 1.28, "opencap4_walk_ti1": 1.25,
    "opencapx_walk_2": 1.31, "pycgm_stairs_down": 0.49, "bmc_walk": 1.45,
}  # fmt: skip


@pytest.mark.mirror
@pytest.mark.skipif(not MIRROR.is_dir(), reason="no mirror folder")
@pytest.mark.parametrize("name", sorted(SPEEDS))
def test_real_clips_fit_within_the_goal(name):
    one = next(r for r in sheet_rows() if r.id == name)
    found = ingest_markers(
        one, MIRROR / one.path, SETS, SETTINGS,
        static_file=MIRROR / one.static if one.static else None,
        forces_file=MIRROR / one.forces if one.forces else None,
        default_mass_kg=70.0, default_sex="male",
    )  # fmt: skip
    assert found.report["marker_rms_cm"] < 1.5
    motion = found.motion
    span = motion.coordinates[-1, [0, 2]] - motion.coordinates[0, [0, 2]]
    speed = np.linalg.norm(span) / (motion.frames / motion.rate_hz)
    assert speed == pytest.approx(SPEEDS[name], abs=0.15)
    assert motion.contacts[:, :4].any()
    assert motion.contacts[:, 4:].any()


@pytest.mark.parametrize("foot", ["nearest", "as it says"])
def test_loads_go_to_the_foot_that_stands_there(plain_motion, foot):
    feet = middle_of_feet(plain_motion)
    count = plain_motion.frames
    force = np.zeros((3, count, 3))
    centre = np.full((3, count, 3), np.nan)
    for plate, frames, side in (
        (0, slice(10, 60), 0),
        (1, slice(50, 90), 1),
        (2, slice(40, 60), 0),
    ):
        force[plate, frames, 1] = 400.0
        centre[plate, frames] = feet[frames, side] * [1, 0, 1]
    centre[2, 40:60] += [0.1, 0, 0]
    record = ForceRecord(
        ("a", "b", "c"), force, centre, np.zeros_like(force), plain_motion.rate_hz, "made"
    )
    names = {"a": "right", "b": "left", "c": "right"}
    plates = Plates("*", names if foot == "as it says" else dict.fromkeys(names, "nearest"))
    found = forces_by_foot(plain_motion, record, plates)
    assert found.names == ("right", "left")
    np.testing.assert_allclose(found.force[0, 10:40, 1], 400)
    np.testing.assert_allclose(found.force[0, 40:60, 1], 800)
    np.testing.assert_allclose(found.force[1, 50:90, 1], 400)
    assert found.force[1, :50].max() == 0
    middle = feet[40:60, 0] * [1, 0, 1] + [0.05, 0, 0]
    np.testing.assert_allclose(found.centre[0, 40:60], middle)
    assert np.isnan(found.centre[1, :50]).all()
    np.testing.assert_allclose(found.moment, 0, atol=1e-9)


PLATES = {  # a foot whose every step the plates bear
    "rajagopal_walk": "right", "gait2354_walk": "left", "opencap4_walk_1": "right",
    "opencapx_walk_2": "right", "rajagopal_run": "left",
}  # fmt: skip


@pytest.mark.mirror
@pytest.mark.skipif(not MIRROR.is_dir(), reason="no mirror folder")
@pytest.mark.parametrize("name", sorted(PLATES))
def test_contacts_agree_with_the_plates(name):
    one = next(r for r in sheet_rows() if r.id == name)
    found = ingest_markers(
        one, MIRROR / one.path, SETS, SETTINGS,
        static_file=MIRROR / one.static if one.static else None,
        forces_file=MIRROR / one.forces, default_mass_kg=70.0, default_sex="male",
    )  # fmt: skip
    motion, markers = found.motion, read_marker_set(SETS, one.skeleton)
    record = placed_forces(motion, MIRROR / one.forces, markers)
    feet = forces_by_foot(motion, record, markers.plates(one.forces))
    side = feet.names.index(PLATES[name])
    frames = np.round(feet.times * motion.rate_hz).astype(int)
    inside = (frames >= 0) & (frames < motion.frames)
    loaded = feet.force[side, inside, 1] > 20
    contact = motion.contacts[frames[inside], 4 * side : 4 * side + 4].any(axis=1)
    assert (loaded == contact).mean() > 0.94
    away = middle_of_feet(motion)[frames[inside], side] - feet.centre[side, inside]
    assert np.nanmedian(np.linalg.norm(away[:, [0, 2]], axis=1)) < 0.14
