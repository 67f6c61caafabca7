"""How training anneals: temperatures and the strengths of both priors at each step.

Brand & Hertzmann 2000, §3.4 and style_machines.md A2.4: T decays exponentially; while it is high
the specific models are held near the generic one, while it falls they may roam, and both
temperatures end at 0. The net strengths are Z = 1 − T and Z′ = ζ′ n, n being a state's frames.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

Z_COLDEST = 0.02  # a temperature below this is taken as 0


@dataclass(frozen=True)
class Schedule:
    """Settings of annealing.

    Attributes
    ----------
    steps : at most this many EM steps. start_temperature, decay : T_k = T₀ decayᵏ.
    entropy : Z at T = 0, with which the entropy strength is multiplied; 0 is ordinary EM.
    holding_hot, holding_roaming, holding_final : ζ′ in the three phases.
    roam_below, settle_below : temperatures at which the second and the third phase begin.
    trim_above, trim_every : transitions and states are trimmed once Z exceeds the first, every
        so many steps.
    state_cost : after training, a state is removed where the log-likelihood then falls by less
        than this many times ½ log(frames) per free parameter of its Gaussians (1: BIC, 0: never).
        Trimming alone keeps two states that share one true state, for each is entered.
    tolerance : training stops when the log-posterior changes by less than this share of itself,
        in the third phase at T = 0.
    """

    steps: int = 120
    start_temperature: float = 20.0
    decay: float = 0.9
    entropy: float = 1.0
    holding_hot: float = 10.0
    holding_roaming: float = 0.05
    holding_final: float = 0.5
    roam_below: float = 1.0
    settle_below: float = 0.2
    trim_above: float = 0.5
    trim_every: int = 5
    state_cost: float = 0.0
    tolerance: float = 1e-6

    @staticmethod
    def from_config(values: Mapping[str, Any]) -> Schedule:
        """Build a schedule from a section of `style_machines.yaml`."""
        return Schedule(**values)

    def temperature(self, step: int) -> float:
        """Return T of a step, counted from 0."""
        found = self.start_temperature * self.decay**step
        return found if found >= Z_COLDEST else 0.0

    def strength(self, step: int) -> float:
        """Return Z = 1 − T, times `entropy`."""
        return self.entropy * (1.0 - self.temperature(step))

    def holding(self, step: int) -> float:
        """Return ζ′ of a step: constant, then falling and rising again log-linearly."""
        t = self.temperature(step)
        if t >= self.roam_below:
            return self.holding_hot
        if t >= self.settle_below:
            return self.holding_roaming
        return self.holding_final

    def settled(self, step: int) -> bool:
        """Whether the strengths no longer change."""
        return self.temperature(step) == 0.0


# Ordinary EM of one model for all, and of models that know nothing of each other.
PLAIN = Schedule(start_temperature=0.0, entropy=0.0, holding_hot=0.0, holding_final=0.0)
