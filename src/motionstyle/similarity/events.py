"""Contact events and the segments they bound (specification §3, rules L and W).

The paper's own rules stand on a missing page; these follow from its counts. A leg's segments lie
between its own touch-downs and lift-offs. Whole-body segments begin at touch-downs, and at a
lift-off that ends a double support and leaves no foot on the ground (a jump's take-off).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from motionstyle.body.layout import CONTACT_POINTS
from motionstyle.errors import MotionStyleError
from motionstyle.mocap.datasets.cells import Cells
from motionstyle.motion.motion import Motion

SIDES = ("l", "r")
EFFECTORS = {"left_foot": "l", "right_foot": "r"}
KINDS = ("touch", "lift")
_COLUMNS = {
    side: [i for i, name in enumerate(CONTACT_POINTS) if name.endswith(f"_{side}")]
    for side in SIDES
}


@dataclass(frozen=True)
class Event:
    """Feet that touch down, lift off, or stand at the clip's border, at one frame.

    Attributes
    ----------
    frame : the first frame with (`touch`) or without (`lift`) contact; for `stand` the frame at
        which a support that has no end inside the clip is cut.
    kind : `touch`, `lift` or `stand`.
    sides : `l`, `r` or `lr`.
    """

    frame: int
    kind: str
    sides: str

    @property
    def name(self) -> tuple[str, str]:
        """What must be equal for two events to be aligned."""
        return self.kind, self.sides


@dataclass(frozen=True)
class EventRules:
    """Our choices (specification §3): seconds within which events count as one, and so on."""

    simultaneous_s: float = 0.06
    standing_s: float = 0.6
    fewest: int = 3


@dataclass(frozen=True)
class ClipEvents:
    """The events of one clip in order."""

    clip: str
    events: tuple[Event, ...]

    @property
    def names(self) -> tuple[tuple[str, str], ...]:
        """The list that must be equal in two motions to align them."""
        return tuple(event.name for event in self.events)


def bearing(motion: Motion) -> dict[str, np.ndarray]:
    """Return per foot whether any of its four points bears, (F,)."""
    return {side: motion.contacts[:, columns].any(axis=1) for side, columns in _COLUMNS.items()}


def read_events(path: str | Path) -> dict[str, tuple[tuple[str, str, int], ...]]:
    """Read hand-checked events, a table divided by tabs: clip, effector, event, frame.

    Returns
    -------
    By clip, (side, kind, frame) in order of frames.

    Raises
    ------
    MotionStyleError
        With every problem of the table, one a line.
    """
    path = Path(path)
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise MotionStyleError(f"{path}: not a readable table of events ({error})") from error
    columns = ["clip", "effector", "event", "frame"]
    numbered = [(n, x.split("\t")) for n, x in enumerate(lines, 1) if x.strip() and x[0] != "#"]
    if not numbered or [c.strip() for c in numbered[0][1]] != columns:
        raise MotionStyleError(
            f"{path}: the first line must name the columns {', '.join(columns)}, divided by tabs"
        )
    problems: list[str] = []
    found: dict[str, list[tuple[str, str, int]]] = {}
    for number, cells in numbered[1:]:
        if len(cells) != len(columns):
            problems.append(f"{path.name} row {number}: {len(cells)} cells, expected 4")
            continue
        named = dict(zip(columns, (c.strip() for c in cells), strict=True))
        row = Cells(path.name, number, named, problems)
        clip = row.required("clip")
        effector = row.one_of("effector", tuple(EFFECTORS))
        kind = row.one_of("event", KINDS)
        frame = row.whole("frame", 0)
        if clip and effector and kind and frame is not None:
            found.setdefault(clip, []).append((EFFECTORS[effector], kind, frame))
        elif not (named["effector"] and named["event"] and named["frame"]):
            problems.append(f"{path.name} row {number}: effector, event and frame must be given")
    for clip, events in found.items():
        for side in SIDES:
            own = sorted((frame, kind) for s, kind, frame in events if s == side)
            if any(a[1] == b[1] for a, b in itertools.pairwise(own)):
                problems.append(
                    f"{path.name}: clip {clip}: touch and lift of one foot must take turns"
                )
    if problems:
        raise MotionStyleError("\n".join(problems))
    return {clip: tuple(sorted(events, key=lambda e: e[2])) for clip, events in found.items()}


def _own_events(motion: Motion) -> list[tuple[str, str, int]]:
    """Return (side, kind, frame) of every change of a foot's support in the motion's contacts."""
    found = []
    for side, on in bearing(motion).items():
        for frame in np.flatnonzero(np.diff(on.astype(int))) + 1:
            found.append((side, "touch" if on[frame] else "lift", int(frame)))
    return sorted(found, key=lambda e: e[2])


def clip_events(
    motion: Motion,
    rules: EventRules,
    given: Sequence[tuple[str, str, int]] | None = None,
) -> ClipEvents:
    """Return the events of a motion, from its contacts or from a user's table.

    Equal changes of both feet within `simultaneous_s` are one event. Where both feet stand
    before a take-off (after a landing), `standing_s` of that support are kept.

    Raises
    ------
    MotionStyleError
        If no foot ever touches or leaves the ground, or a given frame lies outside the clip.
    """
    changes = list(given) if given is not None else _own_events(motion)
    if outside := [f for _s, _k, f in changes if f >= motion.frames]:
        raise MotionStyleError(
            f"clip {motion.id}: an event at frame {outside[0]}, but the clip has {motion.frames} "
            "frames (counted from 0); mend the table of events"
        )
    if not changes:
        raise MotionStyleError(
            f"clip {motion.id}: no contact events (no foot touches or leaves the ground); "
            "leave it out of `similarity` or give its events in a table of events"
        )
    merged: list[Event] = []
    tolerance = rules.simultaneous_s * motion.rate_hz
    for side, kind, frame in changes:
        last = merged[-1] if merged else None
        paired = last and last.kind == kind and last.sides not in {side, "lr"}
        if last and paired and frame - last.frame <= tolerance:
            merged[-1] = Event(last.frame, kind, "lr")
            continue
        merged.append(Event(frame, kind, side))
    longest = round(rules.standing_s * motion.rate_hz)
    if merged[0].name == ("lift", "lr"):
        merged.insert(0, Event(max(0, merged[0].frame - longest), "stand", "lr"))
    if merged[-1].name == ("touch", "lr"):
        merged.append(Event(min(motion.frames - 1, merged[-1].frame + longest), "stand", "lr"))
    elif len(merged) > 1 and merged[-2].name == ("touch", "lr") and merged[-1].kind == "lift":
        # after landing on both feet, one is lifted: the landing ends there at the latest
        first = merged[-2].frame
        merged[-1] = Event(min(merged[-1].frame, first + longest), "stand", "lr")
    return ClipEvents(motion.id, tuple(merged))


def whole_body_borders(events: Sequence[Event]) -> list[int]:
    """Return the indices of events that bound whole-body segments (rule W)."""
    borders = []
    for index, event in enumerate(events):
        take_off = event.name == ("lift", "lr")
        if event.kind in {"touch", "stand"} or take_off:
            borders.append(index)
    return borders
