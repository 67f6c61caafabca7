"""Aligning two motions segment by segment: equal lists of contact events (specification §3).

Of two clips of different length the longest common run of events is aligned; no time is warped
inside a segment but for its duration.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

from motionstyle.errors import MotionStyleError
from motionstyle.similarity.events import (
    ClipEvents,
    Event,
    EventRules,
    whole_body_borders,
)

SETS = ("whole_body", "left_leg", "right_leg")
SIDE_OF_SET = {"left_leg": "l", "right_leg": "r"}


@dataclass(frozen=True)
class Segment:
    """A part of a motion between two events, both frames included.

    Attributes
    ----------
    set : `whole_body`, `left_leg` or `right_leg`.
    first, last : frames.
    label : what happens at its borders and between; only equal ones can be compared.
    """

    set: str
    first: int
    last: int
    label: str


@dataclass(frozen=True)
class Alignment:
    """Two clips whose events agree in a run, and the segments of each, in the same order."""

    first: str
    second: str
    events: tuple[tuple[str, str], ...]
    segments: tuple[tuple[Segment, Segment], ...]


def describe(names: Sequence[tuple[str, str]], most: int = 8) -> str:
    """Write a list of events in short: `+l` the left foot touches down, `-lr` both lift off."""
    signs = {"touch": "+", "lift": "-", "stand": "="}
    text = " ".join(signs[kind] + sides for kind, sides in names[:most])
    return text + (" …" if len(names) > most else "")


def segments_of(events: Sequence[Event]) -> list[Segment]:
    """Return whole-body and leg segments between the first and the last of these events."""
    found = []
    borders = whole_body_borders(events)
    for a, b in itertools.pairwise(borders):
        label = describe([e.name for e in events[a : b + 1]])
        found.append(Segment("whole_body", events[a].frame, events[b].frame, label))
    for set_name, side in SIDE_OF_SET.items():
        own = [e for e in events if side in e.sides]
        for a, b in itertools.pairwise(own):
            on = a.kind == "touch" or (a.kind == "stand" and b.kind == "lift")
            found.append(Segment(set_name, a.frame, b.frame, "contact" if on else "no contact"))
    return [s for s in found if s.last - s.first >= 2]


def common_run(a: Sequence[tuple[str, str]], b: Sequence[tuple[str, str]]) -> tuple[int, int, int]:
    """Return (start in a, start in b, length) of the longest common contiguous run."""
    best = (0, 0, 0)
    lengths = [0] * (len(b) + 1)
    for i, name in enumerate(a, 1):
        row = [0] * (len(b) + 1)
        for j, other in enumerate(b, 1):
            if name == other:
                row[j] = lengths[j - 1] + 1
                if row[j] > best[2]:
                    best = (i - row[j], j - row[j], row[j])
        lengths = row
    return best


def align(a: ClipEvents, b: ClipEvents, rules: EventRules) -> Alignment:
    """Align two clips on their longest common run of events.

    Raises
    ------
    MotionStyleError
        If the run is shorter than `rules.fewest` events or holds no whole-body segment; the
        message says why, in the words of the table of alignments.
    """
    i, j, length = common_run(a.names, b.names)
    told = f"{a.clip} has {describe(a.names)}, {b.clip} has {describe(b.names)}"
    if length < rules.fewest:
        raise MotionStyleError(
            f"different contacts: the longest common run has {length} events, {rules.fewest} are "
            f"needed ({told})"
        )
    first = segments_of(a.events[i : i + length])
    second = segments_of(b.events[j : j + length])
    if [(s.set, s.label) for s in first] != [(s.set, s.label) for s in second]:
        raise MotionStyleError(f"a segment is shorter than three frames in one clip only ({told})")
    if not any(s.set == "whole_body" for s in first):
        raise MotionStyleError(f"no whole-body segment in the common run of events ({told})")
    return Alignment(
        a.clip, b.clip, a.names[i : i + length], tuple(zip(first, second, strict=True))
    )


def all_segments(events: ClipEvents) -> list[Segment]:
    """Return every segment of a clip that lies between two of its events."""
    return segments_of(events.events)
