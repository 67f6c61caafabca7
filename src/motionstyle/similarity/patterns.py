"""Sets of patterns: the feature vectors of similar pairs, drawn from the bank (paper §5, §5.2)."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.errors import MotionStyleError
from motionstyle.similarity.alignment import SETS
from motionstyle.similarity.bank import Bank, Clip, Pair
from motionstyle.similarity.features import pair_vector
from motionstyle.similarity.leg_space import LegSpace, fit_leg_space

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Patterns:
    """Patterns of one set.

    Attributes
    ----------
    name : the set.
    vectors : features, (I, n).
    groups : which pair of clips each pattern is of; a mirrored copy has its source's, (I,).
    types : action of each, (I,).
    labels : contact label of each, (I,).
    subjects : of both clips, (I, 2), empty where unknown.
    halves : segments in the bank, (I, 2).
    """

    name: str
    vectors: Array
    groups: NDArray[np.str_]
    types: NDArray[np.str_]
    labels: NDArray[np.str_]
    subjects: NDArray[np.str_]
    halves: NDArray[np.int64]

    def __len__(self) -> int:
        """Return the number of patterns."""
        return len(self.vectors)

    def take(self, index: NDArray[Any]) -> Patterns:
        """Return some of the patterns."""
        return Patterns(
            self.name,
            self.vectors[index],
            self.groups[index],
            self.types[index],
            self.labels[index],
            self.subjects[index],
            self.halves[index],
        )


def leg_spaces(bank: Bank, without: Collection[str] = ()) -> dict[str, LegSpace]:
    """Return the subspace of each leg, from all clips but those with these base names."""
    kept = np.array([clip.base not in without and clip.id == clip.base for clip in bank.clips])
    return {
        name: fit_leg_space(bank.vectors[name][kept[bank.owners[name]]], name) for name in SETS[1:]
    }


def halves(bank: Bank, spaces: Mapping[str, LegSpace], features: int) -> dict[str, Array]:
    """Return per set each segment's half of a pair's features: 54 whole body, 15 a leg."""
    found = {"whole_body": bank.vectors["whole_body"]}
    for name, space in spaces.items():
        found[name] = space.standardise(bank.vectors[name], features)
    return found


def similar(one: Clip, two: Clip, sets: Mapping[str, Any]) -> bool:
    """Whether two clips of one type are similar by their labels."""
    by_type = {*sets["labelled_by_type"]}
    both = all(c.source in by_type or c.base in sets["also_by_type"] for c in (one, two))
    return both or (one.source == two.source and bool(one.style) and one.style == two.style)


def group_of(one: Clip, two: Clip) -> str:
    """Return the name of a pair of clips, the same for mirrored copies of it."""
    return " ".join(sorted((one.base, two.base)))


def select_pairs(
    bank: Bank,
    wanted: Callable[[Clip, Clip], bool],
    types: Sequence[str],
    sizes: Mapping[str, int] | int,
    fewest_pairs: int,
    seed: int,
) -> tuple[list[tuple[Pair, bool]], dict[str, str]]:
    """Draw pairs of clips until each type has about as many whole-body patterns as asked for.

    Pairs of unmirrored clips come first, in a seeded order; pairs with mirrored copies only fill
    up what is missing. Which clip of a pair comes first is drawn too, so that neither half has a
    meaning of its own.

    Returns
    -------
    Pairs, each with whether its clips are swapped, and for each type left out the reason.
    """
    generator = np.random.default_rng(seed)
    chosen: list[tuple[Pair, bool]] = []
    reasons: dict[str, str] = {}
    for kind in types:
        size = sizes if isinstance(sizes, int) else sizes[kind]
        candidates = [
            p
            for p in bank.pairs
            if bank.clips[p.first].action == kind
            and wanted(bank.clips[p.first], bank.clips[p.second])
        ]
        if len(candidates) < fewest_pairs:
            reasons[kind] = (
                f"{len(candidates)} pairs of clips, {fewest_pairs} are needed; mark more clips of "
                f"type {kind} as `similarity` in the sheet"
            )
            continue
        order = generator.permutation(len(candidates))
        swaps = generator.random(len(candidates)) < 0.5
        mirrored = np.array(
            [
                any(bank.clips[c].id != bank.clips[c].base for c in (p.first, p.second))
                for p in candidates
            ]
        )
        order = np.concatenate([order[~mirrored[order]], order[mirrored[order]]])
        count = 0
        for index in order:
            more = len(candidates[index].segments["whole_body"])
            if count and count + more / 2 > size:
                break
            chosen.append((candidates[index], bool(swaps[index])))
            count += more
    return chosen, reasons


def make_patterns(
    bank: Bank, parts: Mapping[str, Array], pairs: Sequence[tuple[Pair, bool]]
) -> dict[str, Patterns]:
    """Return the patterns of these pairs, one `Patterns` a set."""
    found = {}
    for name in SETS:
        vectors, groups, types, labels, subjects, numbers = [], [], [], [], [], []
        for pair, swapped in pairs:
            one, two = bank.clips[pair.first], bank.clips[pair.second]
            if swapped:
                one, two = two, one
            for i, j in pair.segments[name]:
                a, b = (j, i) if swapped else (i, j)
                vectors.append(pair_vector(parts[name][a], parts[name][b]))
                groups.append(group_of(one, two))
                types.append(one.action)
                labels.append(bank.labels[name][a])
                subjects.append((one.subject, two.subject))
                numbers.append((a, b))
        found[name] = Patterns(
            name,
            np.array(vectors).reshape(len(vectors), -1),
            np.array(groups, dtype=str),
            np.array(types, dtype=str),
            np.array(labels, dtype=str),
            np.array(subjects, dtype=str).reshape(-1, 2),
            np.array(numbers, dtype=np.int64).reshape(-1, 2),
        )
    return found


def paper_set(
    bank: Bank,
    settings: Mapping[str, Any],
    *,
    without: Collection[str] = (),
    limit: int | None = None,
) -> tuple[dict[str, Patterns], dict[str, LegSpace], dict[str, str]]:
    """Return the patterns of the paper's size, the leg subspaces and why types are left out.

    Parameters
    ----------
    without : base names of clips that must not enter, mirrored copies included.
    limit : patterns a type instead of the paper's sizes, for the all-pairs set.

    Raises
    ------
    MotionStyleError
        If no type has enough pairs.
    """
    sets = settings["sets"]

    def wanted(one: Clip, two: Clip) -> bool:
        return similar(one, two, sets) and not {one.base, two.base} & set(without)

    by_type = [*sets["labelled_by_type"]]

    def of_paper(one: Clip, two: Clip) -> bool:
        labelled = all(c.source in by_type or c.base in sets["also_by_type"] for c in (one, two))
        planted = one.planted and two.planted
        return wanted(one, two) and (labelled or planted or not _has_labelled(bank, by_type))

    pairs, reasons = select_pairs(
        bank,
        of_paper if limit is None else wanted,
        sets["types"],
        sets["paper_size"] if limit is None else limit,
        sets["fewest_pairs"],
        sets["seed"],
    )
    if not pairs:
        told = "; ".join(f"{kind}: {reason}" for kind, reason in reasons.items())
        raise MotionStyleError(f"no type of motion has enough similar pairs ({told})")
    spaces = leg_spaces(bank, without)
    parts = halves(bank, spaces, settings["leg_space"]["features"])
    return make_patterns(bank, parts, pairs), spaces, reasons


def _has_labelled(bank: Bank, by_type: Collection[str]) -> bool:
    return any(clip.source in by_type for clip in bank.clips)


def mismatched(
    bank: Bank, parts: Mapping[str, Array], patterns: Patterns, seed: int
) -> tuple[Array, NDArray[np.int64], NDArray[np.str_]]:
    """Return pairs that are not similar, made from the patterns' own segments.

    For each pattern two: `shuffled`, its first half with the second half of a pattern of the same
    type in another phase (another contact label), and `cross_type`, with one of another type, of
    the same contact label where there is one. A kind is left out where no such partner exists.

    Returns
    -------
    Features (J, n), the pattern whose first half each has (J,), and the kind of each (J,).
    """
    generator = np.random.default_rng(seed)
    part = parts[patterns.name]
    vectors, origins, kinds = [], [], []
    for i in range(len(patterns)):
        same_type = patterns.types == patterns.types[i]
        same_label = patterns.labels == patterns.labels[i]
        cross = np.flatnonzero(~same_type & same_label)
        options = {
            "shuffled": np.flatnonzero(same_type & ~same_label),
            "cross_type": cross if len(cross) else np.flatnonzero(~same_type),
        }
        for kind, choice in options.items():
            if len(choice):
                partner = patterns.halves[generator.choice(choice), 1]
                vectors.append(pair_vector(part[patterns.halves[i, 0]], part[partner]))
                origins.append(i)
                kinds.append(kind)
    return (
        np.array(vectors).reshape(len(vectors), -1),
        np.array(origins, dtype=np.int64),
        np.array(kinds, dtype=str),
    )
