"""Maximum likelihood and G: Liu et al. 2005, App. C, on one-dimensional energies (nio.md E16).

L_τ = E(X_T) + τ ln ∫ e^(−E/τ) dX (27) equals E(X_T) − ⟨E⟩ − τ ∫ p ln p dX (28), and tends to
G = E(X_T) − min E (29) as τ → 0. Integrals are sums over a fine grid, with the least exponent taken
out first.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
LIMITS, POINTS = (-3.0, 3.0), 200_001
TEMPERATURES = tuple(float(t) for t in np.logspace(0.5, -4, 19))
CAPTURED = -0.6  # X_T, in no bowl's bottom

# Bowls: one narrow, one wide, and three at once: what the limit must hold for is any of them.
BOWLS: dict[str, Callable[[Array], Array]] = {
    "narrow bowl": lambda x: 4.0 * (x - 0.2) ** 2,
    "wide bowl": lambda x: 0.5 * (x - 0.8) ** 2 + 0.2,
    "three bowls": lambda x: np.minimum.reduce(
        [3 * (x + 1.4) ** 2 + 0.3, 6 * (x - 0.1) ** 2 + 0.1, (x - 1.5) ** 2]
    ),
}


def tempered(energy: Callable[[Array], Array], tau: float) -> dict[str, float]:
    """Return L_τ by (27) and by (28), and G, for X_T = `CAPTURED`."""
    x = np.linspace(*LIMITS, POINTS)
    step = x[1] - x[0]
    e = energy(x)
    least = float(e.min())
    weights = np.full(POINTS, step)
    weights[[0, -1]] *= 0.5
    boltzmann = np.exp(-(e - least) / tau)
    partition = float(weights @ boltzmann)
    density = boltzmann / partition
    log_density = -(e - least) / tau - np.log(partition)
    captured = float(energy(np.array([CAPTURED]))[0])
    mean = float(weights @ (density * e))
    entropy = float(weights @ (density * log_density))
    return {
        "by_27": captured - least + tau * np.log(partition),
        "by_28": captured - mean - tau * entropy,
        "G": captured - least,
    }


def likelihood_curves() -> dict[str, dict[str, list[float]]]:
    """Return L_τ over the temperatures, for each bowl, with G."""
    curves = {}
    for name, energy in BOWLS.items():
        found = [tempered(energy, tau) for tau in TEMPERATURES]
        curves[name] = {key: [one[key] for one in found] for key in found[0]}
    return curves


def likelihood_checks() -> list[dict[str, Any]]:
    """Return how far L_τ is from G at the least temperature, and (27) from (28) at any."""
    rows = []
    for name, curve in likelihood_curves().items():
        gap = curve["G"][-1]
        identity = np.abs(np.subtract(curve["by_27"], curve["by_28"])).max() / gap
        values = {
            "limit_relative_error": abs(curve["by_27"][-1] - gap) / gap,
            "identity_relative_error": float(identity),
        }
        for quantity, value in values.items():
            rows.append(
                {"figure": "nio-E16", "quantity": quantity, "value": float(value),
                 "unit": "relative to G", "note": name}
            )  # fmt: skip
    return rows
