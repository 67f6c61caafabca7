"""Multinomials under the entropic prior: the MAP row and its trimming.

Brand & Hertzmann 2000, eqs. (12), (13), (18), (19) as corrected in style_machines.md, and its
algorithms E1, E2. Symbols: ω evidence of a row's destinations (M,), counts; Z strength of the
prior (1 minimum entropy, 0 maximum likelihood, negative when hot); λ the Lagrange multiplier,
ℓ = λ/Z. Stationarity: ω/P + Z log P + Z = λ, so that y = ω/(Z P) solves y − log y = ℓ − 1 −
log(ω/Z): with y ≥ 1 on the branch W₋₁ and y ≤ 1 on W₀ of Lambert's function.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import wrightomega, xlogy

from motionstyle.shmm.model import normalised

Array = NDArray[np.float64]
NOTHING = 1e-300


def row_entropies(probabilities: Array) -> Array:
    """Return the entropy of each row, nat; eq. (12)."""
    return -xlogy(probabilities, probabilities).sum(axis=-1)


def entropic_rows(evidence: Array, strength: Array | float) -> Array:
    """Return the rows P that maximise Σ ω log P + Z Σ P log P; eqs. (18), (19), algorithm E1.

    Parameters
    ----------
    evidence : ω ≥ 0, (rows, M). A destination without evidence gets probability 0; a row without
        any evidence becomes uniform over all destinations.
    strength : Z of all rows, or of each (rows,).
    """
    rows = np.array(evidence, dtype=float)
    strengths = np.broadcast_to(np.asarray(strength, dtype=float), rows.shape[:1])
    result = normalised(rows)
    several = (rows > NOTHING).sum(axis=1) > 1
    # where the evidence dwarfs the prior, dividing by Z only loses digits
    weak = np.abs(strengths) < 1e-9 * np.maximum(rows.sum(axis=1), NOTHING)
    for mask, solve in (
        (several & ~weak & (strengths > 0), _cold_rows),
        (several & ~weak & (strengths < 0), _hot_rows),
    ):
        if mask.any():
            result[mask] = solve(rows[mask], strengths[mask])
    blurred = several & (strengths != 0) & (np.abs(strengths) < 1e-6 * rows.sum(axis=1))
    result[blurred] = _sharpened(result[blurred], rows[blurred], strengths[blurred, None])
    return result


def _sharpened(found: Array, evidence: Array, strength: Array) -> Array:
    """Return rows after one Newton step on ω/P + Z log P = λ itself, which divides by no Z.

    Only for evidence far above the prior, where the left side falls with every P.
    """
    live = found > 0
    p = np.where(live, found, 1.0)
    slope = np.where(live, evidence / p + strength * np.log(p), 0.0)
    yields = np.where(live, p**2 / (evidence - strength * p), 0.0)
    level = (slope * yields).sum(axis=1, keepdims=True) / yields.sum(axis=1, keepdims=True)
    return normalised(found + (slope - level) * yields)


def _hot_rows(evidence: Array, strength: Array) -> Array:
    """Solve rows with Z < 0, on the branch W₀: w + log w = log(ω/|Z|) + 1 − ℓ, P = ω/(|Z| w)."""
    live = evidence > NOTHING
    log_ratio = np.log(np.where(live, evidence, 1.0) / -strength[:, None])

    def logs(level: Array) -> Array:
        w = np.real(wrightomega(log_ratio + 1.0 - level[:, None]))
        log_w = np.where(w > 0, np.log(np.maximum(w, 1e-320)), log_ratio + 1.0 - level[:, None])
        # tiny w: w = exp(c), so that P = (ω/|Z|)/w keeps its digits through the log
        return np.where(live, log_ratio - log_w, -np.inf)

    low = np.full(len(evidence), -1.0)
    high = np.full(len(evidence), 1.0)
    for _ in range(200):
        grow = _log_sum(logs(low)) > 0
        if not grow.any():
            break
        low = np.where(grow, low * 2 - 1, low)
    for _ in range(200):
        grow = _log_sum(logs(high)) < 0
        if not grow.any():
            break
        high = np.where(grow, high * 2 + 1, high)
    # log ΣP rises with ℓ
    level = _bisect(lambda at: _log_sum(logs(at)), low, high)
    return normalised(np.exp(logs(level)))


def _cold_rows(evidence: Array, strength: Array) -> Array:
    """Solve rows with Z > 0: all on W₋₁, or, where that cannot sum to one, the largest on W₀."""
    live = evidence > NOTHING
    log_ratio = np.where(live, np.log(np.maximum(evidence, NOTHING) / strength[:, None]), -np.inf)
    top = log_ratio.max(axis=1)
    least = top + 2.0

    def logs(level: Array) -> Array:
        argument = np.where(live, level[:, None] - 1.0 - log_ratio, 1.0)
        return log_ratio - np.log(_upper(np.maximum(argument, 1.0)))

    plain = _log_sum(logs(least)) >= 0
    result = np.zeros_like(evidence)
    if plain.any():
        result[plain] = _plain_cold(log_ratio[plain], live[plain], least[plain])
    for row in np.flatnonzero(~plain):
        result[row] = _one_below(log_ratio[row], float(least[row]))
    return result


def _plain_cold(log_ratio: Array, live: NDArray[np.bool_], least: Array) -> Array:
    """Solve rows whose destinations all sit on W₋₁, by Newton steps kept inside a bracket."""

    def state(level: Array) -> tuple[Array, Array]:
        argument = np.where(live, level[:, None] - 1.0 - log_ratio, 1.0)
        y = _upper(np.maximum(argument, 1.0))
        return log_ratio - np.log(y), y

    low, width = least.copy(), np.ones(len(least))
    high = least + width
    for _ in range(200):
        short = _log_sum(state(high)[0]) > 0
        if not short.any():
            break
        width = np.where(short, width * 2, width)
        low = np.where(short, high, low)
        high = np.where(short, high + width, high)
    level = (low + high) / 2
    for _ in range(100):
        logs, y = state(level)
        p = np.exp(logs)
        total = p.sum(axis=1)
        value = np.log(total)
        if (np.abs(value) < 1e-14).all():
            break
        low = np.where(value > 0, level, low)
        high = np.where(value > 0, high, level)
        slope = -(p / np.maximum(y - 1.0, 1e-12)).sum(axis=1) / total
        newton = level - value / slope
        inside = (newton > low) & (newton < high)
        following = np.where(inside, newton, (low + high) / 2)
        if (np.abs(following - level) <= 1e-15 * np.abs(level)).all():
            break
        level = following
    return _closed(np.exp(state(level)[0]))


def _one_below(log_ratio: Array, least: float) -> Array:
    """Solve one row whose largest destination sits on W₀ (style_machines.md, E1 step 4)."""
    first = int(np.argmax(log_ratio))
    others = np.isfinite(log_ratio)
    others[first] = False

    def logs(level: Array) -> Array:
        argument = float(level[0]) - 1.0 - log_ratio
        found = np.full((1, len(log_ratio)), -np.inf)
        found[0, others] = log_ratio[others] - np.log(_upper(argument[others]))
        found[0, first] = log_ratio[first] - _lower_log(max(float(argument[first]), 1.0))
        return found

    high = np.array([least + 1.0])
    for _ in range(200):
        if _log_sum(logs(high))[0] >= 0:
            break
        high = least + (high - least) * 2
    level = _bisect(lambda at: _log_sum(logs(at)), np.array([least]), high)
    return _closed(np.exp(logs(level)))[0]


def _upper(c: Array) -> Array:
    """Return y ≥ 1 with y − log y = c ≥ 1, that is −W₋₁(−e^{−c}); Newton from an upper bound."""
    y = c + np.sqrt(2.0 * (c - 1.0))  # 1 + √(2u) + u with u = c − 1 (Chatzigeorgiou 2013)
    for _ in range(12):
        with np.errstate(divide="ignore", invalid="ignore"):
            step = (y - np.log(y) - c) / (1.0 - 1.0 / y)
        step = np.where(np.isfinite(step), step, 0.0)
        y = np.maximum(y - step, 1.0)
        if (np.abs(step) <= 1e-15 * y).all():
            break
    return y


def _lower_log(c: float) -> float:
    """Return log y of the y ≤ 1 with y − log y = c ≥ 1, that is log(−W₀(−e^{−c}))."""
    z = min(c, np.sqrt(2.0 * max(c - 1.0, 0.0)))  # z = −log y ≥ 0 solves e^{−z} + z = c
    for _ in range(200):
        slope = 1.0 - np.exp(-z)
        if slope <= 0:
            break
        step = (np.exp(-z) + z - c) / slope
        z = max(z - step, 0.0)
        if abs(step) <= 1e-15 * max(z, 1e-12):
            break
    return -z


def _closed(rows: Array) -> Array:
    """Return rows whose sum is nearly one with the largest probability changed so that it is one.

    Where W₋₁ and W₀ meet, rounding of ℓ by ε moves the largest by √ε; scaling all would spread that
    to small ones, whose ω/P it changes most, while the largest's own is stationary there.
    """
    result, every = rows.copy(), np.arange(len(rows))
    largest = rows.argmax(axis=1)
    result[every, largest] = 0.0
    result[every, largest] = 1.0 - result.sum(axis=1)
    return result


def _log_sum(logs: Array) -> Array:
    top = logs.max(axis=1)
    return top + np.log(np.exp(logs - top[:, None]).sum(axis=1))


def _bisect(rising, low: Array, high: Array) -> Array:  # noqa: ANN001
    """Return where a rising function of each row crosses zero, between low and high."""
    low, high = low.copy(), high.copy()
    for _ in range(100):
        middle = (low + high) / 2
        below = rising(middle) < 0
        low = np.where(below, middle, low)
        high = np.where(below, high, middle)
        if (high - low <= 1e-15 * np.maximum(np.abs(low), 1.0)).all():
            break
    return (low + high) / 2


def trimmed(probabilities: Array, counts: Array, strength: float) -> NDArray[np.bool_]:
    """Return which transitions to extinguish (rows, M); algorithm E2.

    P is trimmed where P ≤ exp(−(∂ log p(X|θ)/∂P)/Z) with ∂ log p/∂P = ω/P; only when Z > 0, and
    never a row's largest entry.
    """
    if strength <= 0:
        return np.zeros(probabilities.shape, dtype=bool)
    live = probabilities > 0
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        gradient = np.where(live, counts / np.where(live, probabilities, 1.0), 0.0)
        gone = live & (np.log(np.where(live, probabilities, 1.0)) <= -gradient / strength)
    largest = probabilities.argmax(axis=1)
    gone[np.arange(len(gone)), largest] = False
    return gone
