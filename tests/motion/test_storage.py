"""Motions on disk: exact, reproducible, and clear about every kind of damage (fault 25)."""

from __future__ import annotations

import json
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from motionstyle.errors import MotionStyleError
from motionstyle.files import file_sha256
from motionstyle.motion.storage import (
    load_available,
    load_motion,
    read_sidecar,
    save_failure,
    save_motion,
    sidecar_path,
)

ARRAYS = ("coordinates", "contacts", "contact_normals", "contact_forces", "observed")
BODY = ("masses", "coms", "inertias", "semi_axes")
GEOMETRY = ("joint_offsets", "contact_points", "end_points")


@pytest.fixture
def saved(tmp_path, plain_motion):
    path = tmp_path / "motions" / "captured" / "plain.npz"
    save_motion(path, plain_motion)
    return path


def rewrite(path, **changes):
    """Change or drop (None) arrays of an .npz."""
    with np.load(path) as stored:
        data = {name: stored[name] for name in stored.files}
    data |= changes
    np.savez(path, **{name: value for name, value in data.items() if value is not None})


def rewrite_sidecar(path, **changes):
    """Change or drop (None) keys of a sidecar."""
    values = json.loads(sidecar_path(path).read_text()) | changes
    kept = {name: value for name, value in values.items() if value is not None}
    sidecar_path(path).write_text(json.dumps(kept))


def same(a, b):
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


def test_a_motion_comes_back_bit_for_bit(saved, plain_motion):
    back = load_motion(saved)
    for name in ARRAYS:
        assert same(getattr(back, name), getattr(plain_motion, name)), name
    for name in BODY:
        assert same(getattr(back.body, name), getattr(plain_motion.body, name)), name
    for name in GEOMETRY:
        expected = getattr(plain_motion.body.geometry, name)
        assert same(getattr(back.body.geometry, name), expected), name
    for name in ("id", "kind", "rate_hz", "rebranched", "provenance"):
        assert getattr(back, name) == getattr(plain_motion, name), name
    assert (back.body.sex, back.body.mass_source) == ("male", "given")


def test_unknown_forces_and_rebranched_frames_come_back(tmp_path, plain_motion):
    motion = replace(plain_motion, contact_forces=None, rebranched=(3, 140))
    save_motion(tmp_path / "captured" / "m.npz", motion)
    back = load_motion(tmp_path / "captured" / "m.npz")
    assert back.contact_forces is None
    assert back.rebranched == (3, 140)


def test_equal_motions_are_equal_files(tmp_path, saved, plain_motion):
    again = tmp_path / "other" / "plain.npz"
    save_motion(again, plain_motion)
    third = tmp_path / "third" / "plain.npz"
    save_motion(third, load_motion(saved))
    for other in (again, third):
        assert file_sha256(other) == file_sha256(saved)
        assert file_sha256(sidecar_path(other)) == file_sha256(sidecar_path(saved))


def test_bytes_do_not_depend_on_the_memory_layout(tmp_path, saved, plain_motion):
    other = replace(
        plain_motion,
        coordinates=np.asfortranarray(plain_motion.coordinates),
        contacts=np.repeat(plain_motion.contacts, 2, axis=0)[::2],
    )
    save_motion(tmp_path / "f.npz", other)
    assert file_sha256(tmp_path / "f.npz") == file_sha256(saved)


def test_one_changed_bit_changes_the_file(tmp_path, saved, plain_motion):
    q = plain_motion.coordinates.copy()
    q[100, 10] = np.nextafter(q[100, 10], 9)
    save_motion(tmp_path / "c.npz", replace(plain_motion, coordinates=q))
    assert file_sha256(tmp_path / "c.npz") != file_sha256(saved)


def test_the_archive_bears_no_time_and_no_system(saved):
    with zipfile.ZipFile(saved) as archive:
        assert {info.date_time for info in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        assert {info.create_system for info in archive.infolist()} == {3}


def test_the_sidecar_says_what_a_table_wants(saved, plain_motion):
    sidecar = read_sidecar(saved)
    assert sidecar == read_sidecar(sidecar_path(saved))
    assert sidecar["frames"] == 241
    assert sidecar["rate_hz"] == 120.0
    assert sidecar["status"] == "ok"
    assert sidecar["unobserved"] == ["toes_extension_l"]
    assert sidecar["body"]["mass_kg"] == pytest.approx(73.0)
    assert sidecar["provenance"] == plain_motion.provenance


def refused(path, *words):
    """The message of the one error that loading gives; it names the file and what to do."""
    with pytest.raises(MotionStyleError) as caught:
        load_motion(path)
    message = str(caught.value)
    assert str(path.with_suffix("")) in message
    assert "delete it and run Snakemake again to remake motion captured/plain" in message
    for word in words:
        assert word in message
    return message


@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 0.6, 0.9, 0.999])
def test_a_truncated_file_is_refused(saved, share):
    data = saved.read_bytes()
    saved.write_bytes(data[: int(share * len(data))])
    refused(saved, "not a readable motion file", saved.name)


def test_a_damaged_file_is_refused_or_harmless(saved, plain_motion):
    data = saved.read_bytes()
    rng = np.random.default_rng(5)
    places = [*rng.integers(0, len(data), 150), *range(60), *range(len(data) - 60, len(data))]
    refusals = []
    for place in places:
        damaged = bytearray(data)
        damaged[place] ^= 1 << int(rng.integers(8))
        saved.write_bytes(damaged)
        try:
            back = load_motion(saved)
        except MotionStyleError as error:
            refusals.append(str(error))
        else:
            assert same(back.coordinates, plain_motion.coordinates)
            assert same(back.body.inertias, plain_motion.body.inertias)
    assert len(refusals) > 140
    assert all(saved.name in text and "run Snakemake again" in text for text in refusals)


def test_other_files_of_the_same_name_are_refused(saved):
    saved.write_bytes(b"not an archive")
    refused(saved, "not a readable motion file")
    with saved.open("wb") as handle:
        np.save(handle, np.zeros(3))
    refused(saved, "not a readable motion file")
    saved.write_bytes(b"")
    refused(saved, "not a readable motion file")


def test_pickled_objects_are_not_loaded(saved):
    rewrite(saved, contacts=np.array([{}, []], dtype=object))
    refused(saved, "not a readable motion file")


@pytest.mark.parametrize("version", [0, 2, 99])
def test_another_schema_version_is_refused(saved, version):
    rewrite(saved, schema_version=np.int64(version))
    refused(saved, saved.name, f"schema version {version}, this program reads 1")


@pytest.mark.parametrize("version", [0, 2, "1", None])
def test_another_schema_version_of_the_sidecar_is_refused(saved, version):
    rewrite_sidecar(saved, schema_version=version)
    refused(saved, "plain.json", f"schema version {version}, this program reads 1")


@pytest.mark.parametrize(
    "key",
    [
        *("coordinates", "contacts", "contact_normals", "observed", "rebranched", "rate_hz"),
        *(f"body_{name}" for name in (*BODY, *GEOMETRY)),
    ],
)
def test_a_missing_array_is_refused_by_name(saved, key):
    rewrite(saved, **{key: None})
    refused(saved, saved.name, f"{key} missing from the file")


def test_a_missing_version_is_refused(saved):
    rewrite(saved, schema_version=None)
    refused(saved, "schema version None, this program reads 1")


@pytest.mark.parametrize("key", ["id", "kind", "status", "provenance", "body", "frames"])
def test_a_missing_key_of_the_sidecar_is_refused_by_name(saved, key):
    rewrite_sidecar(saved, **{key: None})
    refused(saved, "plain.json", key)


def test_a_body_without_its_sex_is_refused(saved):
    rewrite_sidecar(saved, body={"mass_source": "given"})
    refused(saved, "body sex missing")


@pytest.mark.parametrize("text", ["", "{", "[1]", "null", "\xff", '{"id": 3}'])
def test_a_damaged_sidecar_is_refused(saved, text):
    sidecar_path(saved).write_bytes(text.encode("latin-1"))
    refused(saved, "plain.json")


def test_a_missing_sidecar_is_refused(saved):
    sidecar_path(saved).unlink()
    refused(saved, "plain.json")


def test_a_missing_file_is_refused(saved):
    saved.unlink()
    refused(saved, "plain.npz")


def test_a_sidecar_of_another_motion_is_refused(saved):
    rewrite_sidecar(saved, frames=240)
    refused(saved, "241 frames, but its sidecar says 240")


def test_impossible_values_in_a_file_are_refused_with_its_name(saved, plain_motion):
    q = plain_motion.coordinates.copy()
    q[3, 0] = np.nan
    rewrite(saved, coordinates=q)
    refused(saved, saved.name, "pelvis_tx is not a number at frame 3")


def test_a_failed_motion_says_why_and_what_to_do(tmp_path):
    path = tmp_path / "captured" / "plain.npz"
    save_failure(path, "plain", "captured", "the feet never touch the floor", subject="02")
    refused(path, str(path), "could not be made: the feet never touch the floor")
    sidecar = read_sidecar(path)
    assert sidecar["status"] == "failed"
    assert sidecar["provenance"] == {"subject": "02"}


def test_a_failure_replaces_a_motion_and_the_other_way_round(saved, plain_motion):
    save_failure(saved, "plain", "captured", "no luck")
    refused(saved, "no luck")
    save_motion(saved, plain_motion)
    assert load_motion(saved).frames == 241


def test_available_motions_are_loaded_and_failed_ones_named(saved, capsys):
    failed = saved.with_name("limp.npz")
    save_failure(failed, "limp", "captured", "no luck")
    assert [motion.id for motion in load_available([failed, saved])] == ["plain"]
    assert "limp" in capsys.readouterr().out
    with pytest.raises(MotionStyleError, match="none of these motions is available: limp"):
        load_available([failed])
    sidecar_path(failed).unlink()
    with pytest.raises(MotionStyleError, match=r"limp\.json: not a readable motion file"):
        load_available([failed])


def test_a_failed_write_keeps_the_former_motion(saved, plain_motion):
    before = saved.read_bytes()
    with pytest.raises((TypeError, ValueError)):
        save_motion(saved, replace(plain_motion, observed=plain_motion.observed.astype(object)))
    assert saved.read_bytes() == before
    assert sorted(p.name for p in saved.parent.iterdir()) == ["plain.json", "plain.npz"]
