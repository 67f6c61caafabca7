"""What steps at one μ are held against: a filter of φ and θ, and whether they lead anywhere.

θ is the infeasibility and φ the barrier objective, as in Wächter & Biegler 2006.
"""

from __future__ import annotations

import numpy as np

MARGIN = 1e-5  # by which a step must better θ or φ, as a share of θ
FALL = 0.9  # of the optimality error, to count as lower
PATIENCE, GAIN = 20, 1e-6  # iterations at one μ that must lower the error, or φ by this share


class StepFilter:
    """What one μ has seen.

    Attributes
    ----------
    entries : pairs of θ and φ of which a step must better one. restored : error after the last
        restoration. error, phi : the lowest that counted, `since` so many iterations ago.
    stalled : whether steps have ceased to lead anywhere; it stays so until μ is lowered.
    """

    def __init__(self) -> None:
        self.entries: list[tuple[float, float]] = []
        self.error = self.phi = self.restored = np.inf
        self.since, self.stalled = 0, False

    def note(self, error: float, phi: float) -> None:
        """Take down the error and φ that an iteration begins with."""
        self.since += 1
        if error < FALL * self.error:
            self.error, self.since = error, 0
        if phi < self.phi - GAIN * abs(phi):
            self.phi, self.since = phi, 0
        self.stalled |= self.since > PATIENCE

    def takes(
        self,
        before: tuple[float, float],
        after: tuple[float, float],
        slope: float,
        limits: tuple[float, float],
    ) -> bool:
        """Say whether a step is better in φ or in θ, and remember where it came from.

        Parameters
        ----------
        before, after : θ and φ. slope : of φ along the step, times its length. limits : the largest
            θ there may be, and the θ below which φ has to fall as its slope says.
        """
        (theta, phi), (new_theta, new_phi) = before, after
        rounding = 10 * np.finfo(float).eps * abs(phi)
        if not np.isfinite(new_phi + new_theta) or new_theta > limits[0]:
            return False
        if any(
            new_theta >= (1 - MARGIN) * t and new_phi >= p - MARGIN * t for t, p in self.entries
        ):
            return False
        if slope < 0 and (-slope) ** 2.3 > theta**1.1 and theta <= limits[1]:
            return new_phi - phi - rounding <= 1e-8 * slope
        if new_theta <= (1 - MARGIN) * theta or new_phi - rounding <= phi - MARGIN * theta:
            self.entries.append(((1 - MARGIN) * theta, phi - MARGIN * theta))
            return True
        return False

    def takes_restoration(self, before: float, after: float) -> bool:
        """Say whether a step lowers the optimality error enough, and if so empty the filter.

        Each time at the same μ the error has to be lower than the last time: steps that the filter
        takes and steps taken here would else go round in circles.
        """
        if not after <= FALL * min(before, self.restored):
            return False
        self.restored = after
        self.entries.clear()
        return True
