"""New choreography from a state graph: random walks, and pieces cut and pasted.

Brand & Hertzmann 2000, §4.5; style_machines.md A7. A choreography is a list of stays in states.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import shortest_path

from motionstyle.errors import MotionStyleError
from motionstyle.shmm.poses import visits

Array = NDArray[np.float64]


def moves_of(path: NDArray[np.int64]) -> list[int]:
    """Return the states a path (T,) stays in, one entry a stay."""
    return [state for state, _first, _last in visits(path)]


def leaving(transitions: Array) -> Array:
    """Return the probabilities of the next other state, (N, N); rows without one are zero."""
    away = transitions.copy()
    np.fill_diagonal(away, 0.0)
    total = away.sum(axis=1, keepdims=True)
    return np.where(total > 0, away / np.where(total > 0, total, 1.0), 0.0)


def random_walk(transitions: Array, start: int, stays: int, seed: int) -> list[int]:
    """Return a walk through the state graph of at most `stays` stays; it ends at a dead end."""
    rng = np.random.default_rng(seed)
    next_state = leaving(transitions)
    walk = [start]
    while len(walk) < stays and next_state[walk[-1]].sum() > 0:
        walk.append(int(rng.choice(len(next_state), p=next_state[walk[-1]])))
    return walk


def joined(transitions: Array, pieces: Sequence[Sequence[int]]) -> list[int]:
    """Return pieces one after the other, with the likeliest path between where no arc joins them.

    Raises
    ------
    MotionStyleError
        If no path leads from one piece to the next.
    """
    graph = leaving(transitions)
    # SciPy takes what is below 1e-8 for no arc at all
    costs = np.where(graph > 0, -np.log(np.where(graph > 0, graph, 1.0)) + 1e-6, 0.0)
    _, before = shortest_path(costs, return_predecessors=True)
    result = list(pieces[0])
    for piece in pieces[1:]:
        here, goal = result[-1], piece[0]
        if here == goal:
            result += piece[1:]
            continue
        way = [goal]
        while way[-1] != here:
            former = int(before[here, way[-1]])
            if former < 0:
                raise MotionStyleError(
                    f"choreography: no path of transitions leads from state {here} to {goal}"
                )
            way.append(former)
        result += way[::-1][1:] + list(piece[1:])
    return result


def primitives(
    paths: Sequence[NDArray[np.int64]], length: int, count: int
) -> list[tuple[int, ...]]:
    """Return the most reused runs of `length` stays, none of which share a state.

    Runs that occur once are taken too where too few occur more often; the order is that of reuse.
    """
    seen: Counter[tuple[int, ...]] = Counter()
    for path in paths:
        states = moves_of(path)
        seen.update(tuple(states[k : k + length]) for k in range(max(0, len(states) - length + 1)))
    chosen: list[tuple[int, ...]] = []
    for run, _times in sorted(seen.items(), key=lambda item: (-item[1], item[0])):
        if not any(set(run) & set(other) for other in chosen):
            chosen.append(run)
        if len(chosen) == count:
            break
    return chosen
