"""Segments lie between contact events, and clips are aligned only on equal lists of them."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from motionstyle.errors import MotionStyleError
from motionstyle.similarity.alignment import align, all_segments, common_run, segments_of
from motionstyle.similarity.bank import build_bank, load_bank, save_bank
from motionstyle.similarity.events import Event, clip_events, read_events, whole_body_borders


def jump_of(walk, take_off=100, landing=160, lag=3):
    """The same body, both feet off the ground between two frames, the left one `lag` later."""
    contacts = np.ones_like(walk.contacts)
    contacts[take_off:landing, :4] = False
    contacts[take_off + lag : landing + lag, 4:] = False
    known = {**walk.provenance, "action": "jump"}
    return replace(walk, id="jump", contacts=contacts, provenance=known)


def test_a_walk_has_one_whole_body_segment_a_step_and_alternating_leg_segments(walks, rules):
    events = clip_events(walks[0], rules)
    touches = [e.frame for e in events.events if e.kind == "touch"]
    assert np.diff(touches).tolist() == [50] * (len(touches) - 1)  # a step is 50 frames
    segments = all_segments(events)
    whole = [s for s in segments if s.set == "whole_body"]
    assert [(s.first, s.last) for s in whole] == list(itertools.pairwise(touches))
    for leg in ("left_leg", "right_leg"):
        own = [s for s in segments if s.set == leg]
        assert all(a.last == b.first for a, b in itertools.pairwise(own))
        assert {s.last - s.first for s in own if s.label == "contact"} == {60}
        assert {s.last - s.first for s in own if s.label == "no contact"} == {40}


def test_a_jump_is_take_off_flight_and_landing_for_body_and_legs(walks, rules):
    events = clip_events(jump_of(walks[0]), rules)
    assert [e.name for e in events.events] == [
        ("stand", "lr"),
        ("lift", "lr"),
        ("touch", "lr"),
        ("stand", "lr"),
    ]
    assert [e.frame for e in events.events] == [40, 100, 160, 220]  # 0.6 s of standing at 100 Hz
    counts = [
        sum(s.set == n for s in segments_of(events.events))
        for n in ("whole_body", "left_leg", "right_leg")
    ]
    assert counts == [3, 3, 3]


def test_feet_that_leave_far_apart_in_time_are_two_events(walks, rules):
    events = clip_events(jump_of(walks[0], lag=20), rules)
    assert ("lift", "lr") not in [e.name for e in events.events]


def test_borders_follow_rule_w():
    events = [
        Event(0, "touch", "r"),
        Event(5, "lift", "l"),
        Event(9, "lift", "r"),
        Event(12, "touch", "l"),
        Event(20, "lift", "lr"),
    ]
    assert whole_body_borders(events) == [0, 3, 4]


def test_longest_common_run_against_brute_force():
    generator = np.random.default_rng(0)
    for _ in range(50):
        a = [("touch", "lr"[k]) for k in generator.integers(0, 2, 9)]
        b = [("touch", "lr"[k]) for k in generator.integers(0, 2, 7)]
        i, j, length = common_run(a, b)
        assert a[i : i + length] == b[j : j + length]
        longest = max(
            n
            for n in range(8)
            if n == 0
            or any(a[x : x + n] == b[y : y + n] for x in range(10 - n) for y in range(8 - n))
        )
        assert length == longest


def test_walks_are_aligned_segment_by_segment(walks, rules):
    found = align(clip_events(walks[0], rules), clip_events(walks[1], rules), rules)
    assert all(a.set == b.set and a.label == b.label for a, b in found.segments)
    assert sum(a.set == "whole_body" for a, _ in found.segments) >= 3


def test_different_contacts_are_not_aligned_and_say_why(walks, rules):
    walk, jump = clip_events(walks[0], rules), clip_events(jump_of(walks[0]), rules)
    with pytest.raises(MotionStyleError, match=r"different contacts.*3 are needed.*jump has =lr"):
        align(walk, jump, rules)


def test_a_clip_without_contacts_is_a_row_with_its_reason(walks, rules):
    floating = replace(walks[0], id="floating", contacts=np.zeros_like(walks[0].contacts))
    with pytest.raises(MotionStyleError, match=r"floating: no contact events.*table of events"):
        clip_events(floating, rules)
    bank, rows = build_bank([*walks[:2], floating], rules, ["walk"])
    assert [r["reason"][:30] for r in rows if r["first"] == "floating"] == [
        "clip floating: no contact even"
    ]
    assert "floating" not in {clip.id for clip in bank.clips}
    with pytest.raises(MotionStyleError, match="no clip has contact events"):
        build_bank([floating], rules, ["walk"])


def test_events_of_a_table_replace_the_clips_own(tmp_path, walks, rules):
    path = tmp_path / "events.tsv"
    path.write_text(
        "clip\teffector\tevent\tframe\n# checked by hand\n"
        "walk_0\tright_foot\ttouch\t31\nwalk_0\tleft_foot\tlift\t39\n"
        "walk_0\tleft_foot\ttouch\t81\nwalk_0\tright_foot\tlift\t92\n"
    )
    given = read_events(path)
    found = clip_events(walks[0], rules, given["walk_0"])
    assert [e.frame for e in found.events] == [31, 39, 81, 92]
    with pytest.raises(MotionStyleError, match=r"clips that are not here: walk_0"):
        build_bank(walks[1:3], rules, ["walk"], given)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("clip,effector\n", "must name the columns clip, effector, event, frame"),
        ("clip\teffector\tevent\tframe\na\tleft_hand\ttouch\t3\n", r"row 2, column effector"),
        ("clip\teffector\tevent\tframe\na\tleft_foot\ttouch\t-3\n", r"row 2, column frame"),
        (
            "clip\teffector\tevent\tframe\na\tleft_foot\ttouch\t3\na\tleft_foot\ttouch\t9\n",
            "must take turns",
        ),
        ("clip\teffector\tevent\tframe\na\tleft_foot\n", "2 cells, expected 4"),
    ],
)
def test_a_wrong_table_of_events_is_refused(tmp_path, text, expected):
    path = tmp_path / "events.tsv"
    path.write_text(text)
    with pytest.raises(MotionStyleError, match=expected):
        read_events(path)


def test_an_event_beyond_the_clip_is_refused(walks, rules):
    with pytest.raises(MotionStyleError, match="event at frame 900, but the clip has 300"):
        clip_events(walks[0], rules, [("l", "touch", 900)])


def test_a_bank_comes_back_from_disk_as_it_was(tmp_path, bank):
    save_bank(tmp_path / "bank.npz", bank)
    again = load_bank(tmp_path / "bank.npz")
    assert again.clips == bank.clips
    for name, vectors in bank.vectors.items():
        np.testing.assert_array_equal(again.vectors[name], vectors)
    assert len(again.pairs) == len(bank.pairs)
    np.testing.assert_array_equal(
        again.pairs[3].segments["left_leg"], bank.pairs[3].segments["left_leg"]
    )
    (tmp_path / "bank.npz").write_bytes(b"no zip")
    with pytest.raises(MotionStyleError, match="not a readable bank"):
        load_bank(tmp_path / "bank.npz")
