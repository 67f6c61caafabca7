"""The bank: every segment of every clip as numbers, and which segments of which clips are aligned.

It is what all models of the stage are made from; a model that must not have seen a clip takes
its patterns and its leg subspaces from the bank without that clip.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError
from motionstyle.files import atomic_write, read_json, write_json
from motionstyle.motion.mirror import mirror_motion
from motionstyle.motion.motion import Motion
from motionstyle.similarity.alignment import SETS, Segment, align, all_segments
from motionstyle.similarity.events import ClipEvents, EventRules, clip_events
from motionstyle.similarity.features import (
    LEG_DIMENSION,
    WHOLE_BODY_DIMENSION,
    leg_vector,
    whole_body_vector,
)

Array = NDArray[np.float64]
HALF = {"whole_body": WHOLE_BODY_DIMENSION // 2, "left_leg": LEG_DIMENSION}
HALF["right_leg"] = LEG_DIMENSION


@dataclass(frozen=True)
class Clip:
    """What is known of a clip. `base` is the clip a mirrored copy was made from, else itself."""

    id: str
    base: str
    source: str
    subject: str
    action: str
    style: str
    planted: bool
    series: str
    dose: float | None

    @property
    def data(self) -> str:
        """Whether it is `planted` or `captured`, as tables say it."""
        return "planted" if self.planted else "captured"


@dataclass(frozen=True)
class Pair:
    """Two aligned clips and, per set, the numbers of their aligned segments in the bank."""

    first: int
    second: int
    segments: Mapping[str, NDArray[np.int64]]


@dataclass(frozen=True)
class Bank:
    """Clips, their segments and the aligned pairs.

    Attributes
    ----------
    clips : all clips with contacts.
    vectors : per set the segments' numbers: (N, 54) whole body, (N, 175) legs.
    owners : per set the clip each segment is of, (N,).
    labels : per set what happens in each segment.
    pairs : alignable pairs of clips of one type and source.
    """

    clips: tuple[Clip, ...]
    vectors: Mapping[str, Array]
    owners: Mapping[str, NDArray[np.int64]]
    labels: Mapping[str, tuple[str, ...]]
    pairs: tuple[Pair, ...]


def describe_clip(motion: Motion) -> Clip:
    """Return what a motion's provenance tells of it."""
    known = motion.provenance
    truth = known.get("truth") or {}
    base = motion.id.removesuffix("_mirror") if known.get("mirrored") else motion.id
    return Clip(
        id=motion.id,
        base=base,
        source=str(known.get("dataset") or "own").split("/")[0],
        subject=str(known.get("subject") or ""),
        action=str(known.get("action") or ""),
        style=str(known.get("style") or ""),
        planted=motion.kind == "planted" or bool(known.get("planted")),
        series=str(truth.get("series") or ""),
        dose=None if truth.get("dose") is None else float(truth["dose"]),
    )


def build_bank(
    motions: Iterable[Motion],
    rules: EventRules,
    types: Sequence[str],
    given: Mapping[str, Sequence[tuple[str, str, int]]] | None = None,
    *,
    mirror: bool = True,
) -> tuple[Bank, list[dict[str, object]]]:
    """Return the bank and the rows of the table of alignments.

    Parameters
    ----------
    types : actions that pairs are made of.
    given : events of a user's table, by clip.
    mirror : whether a left–right mirrored copy of each clip of these types is taken too.

    Raises
    ------
    MotionStyleError
        If no clip has contacts, or the table of events names an unknown clip.
    """
    clips: list[Clip] = []
    events: list[ClipEvents] = []
    segments: list[dict[tuple[str, int, int], int]] = []
    vectors: dict[str, list[Array]] = {name: [] for name in SETS}
    owners: dict[str, list[int]] = {name: [] for name in SETS}
    labels: dict[str, list[str]] = {name: [] for name in SETS}
    rows: list[dict[str, object]] = []
    given = dict(given or {})
    ids = set()
    for motion in motions:
        ids.add(motion.id)
        wanted = [motion]
        if mirror and motion.provenance.get("action") in types and motion.id not in given:
            wanted.append(mirror_motion(motion))
        for one in wanted:
            if one is not motion and one.id in ids:
                continue  # the sheet has the mirrored copy already
            try:
                found = clip_events(one, rules, given.get(one.id))
            except MotionStyleError as error:
                rows.append({"first": one.id, "aligned": False, "reason": str(error)})
                continue
            index = len(clips)
            clips.append(describe_clip(one))
            events.append(found)
            own = {}
            for segment in all_segments(found):
                key = (segment.set, segment.first, segment.last)
                own[key] = len(owners[segment.set])
                vectors[segment.set].append(_vector(one, segment))
                owners[segment.set].append(index)
                labels[segment.set].append(segment.label)
            segments.append(own)
    if unknown := sorted(set(given) - ids):
        raise MotionStyleError(
            f"the table of events names clips that are not here: {', '.join(unknown)}"
        )
    if not clips:
        raise MotionStyleError(
            "no clip has contact events, so there is nothing to compare; mark clips with contacts "
            "as `similarity` in the sheet"
        )
    pairs = _pairs(clips, events, segments, types, rules, rows)
    bank = Bank(
        tuple(clips),
        {n: np.array(vectors[n]).reshape(-1, HALF[n]) for n in SETS},
        {n: np.array(owners[n], dtype=np.int64) for n in SETS},
        {n: tuple(labels[n]) for n in SETS},
        tuple(pairs),
    )
    return bank, rows


def _vector(motion: Motion, segment: Segment) -> Array:
    function = whole_body_vector if segment.set == "whole_body" else leg_vector
    return function(motion, segment)


def _pairs(
    clips: Sequence[Clip],
    events: Sequence[ClipEvents],
    segments: Sequence[Mapping[tuple[str, int, int], int]],
    types: Sequence[str],
    rules: EventRules,
    rows: list[dict[str, object]],
) -> list[Pair]:
    """Align all clips of one type and source; add a row for each pair of unmirrored clips."""
    pairs = []
    for a, b in combinations(range(len(clips)), 2):
        one, two = clips[a], clips[b]
        same = (one.action, one.source) == (two.action, two.source) or (
            one.action == two.action == "jump" and not (one.planted or two.planted)
        )
        if not same or one.action not in types or one.base == two.base:
            continue
        row = {"first": one.id, "second": two.id, "type": one.action, "source": one.source}
        try:
            found = align(events[a], events[b], rules)
        except MotionStyleError as error:
            row |= {"aligned": False, "reason": str(error)}
        else:
            numbers = {
                name: np.array(
                    [
                        (segments[a][name, s.first, s.last], segments[b][name, t.first, t.last])
                        for s, t in found.segments
                        if s.set == name
                    ],
                    dtype=np.int64,
                ).reshape(-1, 2)
                for name in SETS
            }
            pairs.append(Pair(a, b, numbers))
            row |= {"aligned": True, "events": len(found.events)}
            row |= {f"{name}_segments": len(numbers[name]) for name in SETS}
        if one.id == one.base and two.id == two.base:
            rows.append(row)
    return pairs


ALIGNMENT_COLUMNS = (
    *("first", "second", "type", "source", "aligned", "events"),
    *(f"{name}_segments" for name in SETS),
    "reason",
)


def save_bank(path: str | Path, bank: Bank) -> None:
    """Write a bank: arrays as .npz, the rest as JSON beside it, each atomically."""
    path = Path(path)
    arrays: dict[str, Any] = {}
    for name in SETS:
        arrays[f"vectors_{name}"] = bank.vectors[name]
        arrays[f"owners_{name}"] = bank.owners[name]
        joined = [p.segments[name] for p in bank.pairs] or [np.zeros((0, 2), dtype=np.int64)]
        arrays[f"pairs_{name}"] = np.concatenate(joined)
        arrays[f"counts_{name}"] = np.array([len(p.segments[name]) for p in bank.pairs], int)
    arrays["pairs"] = np.array([(p.first, p.second) for p in bank.pairs], int).reshape(-1, 2)
    with atomic_write(path, "wb") as handle:
        np.savez(handle, **arrays)
    write_json(
        path.with_suffix(".json"),
        {
            "clips": [asdict(clip) for clip in bank.clips],
            "labels": {name: list(bank.labels[name]) for name in SETS},
        },
    )


def load_bank(path: str | Path) -> Bank:
    """Read a bank.

    Raises
    ------
    MotionStyleError
        If a file is missing or damaged.
    """
    path = Path(path)
    try:
        with np.load(path, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
        sidecar = read_json(path.with_suffix(".json"))
        cuts = {n: np.split(arrays[f"pairs_{n}"], np.cumsum(arrays[f"counts_{n}"])) for n in SETS}
        return Bank(
            tuple(Clip(**clip) for clip in sidecar["clips"]),
            {n: arrays[f"vectors_{n}"] for n in SETS},
            {n: arrays[f"owners_{n}"] for n in SETS},
            {n: tuple(sidecar["labels"][n]) for n in SETS},
            tuple(
                Pair(int(a), int(b), {n: cuts[n][k] for n in SETS})
                for k, (a, b) in enumerate(arrays["pairs"])
            ),
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise MotionStyleError(
            f"{path}: not a readable bank of segments ({error}); delete it and run Snakemake again"
        ) from error
