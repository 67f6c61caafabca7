"""What each foot is expected to bear: the smooth transition of weight in double support.

Newton fixes the sum of the contact forces; what each of two feet bears is left open. Markers tell
when both stand, and over that time weight passes smoothly from the trailing to the leading foot,
as in Ren et al. 2008 (J. Biomech. 41:2750–2759), here along the cubic 3u² − 2u³ and as a soft
expectation that torques and centres of pressure may overrule.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from motionstyle.spacetime.ground import stances

Array = NDArray[np.float64]


def smooth_step(u: Array) -> Array:
    """Return 3u² − 2u³ for u within 0 and 1, and its end values beyond."""
    inside = np.clip(u, 0.0, 1.0)
    return inside**2 * (3 - 2 * inside)


def expected_shares(bearing: NDArray[np.bool_]) -> Array:
    """Return which share of the weight each foot is expected to bear, (F, 2).

    Alone a foot bears all. While both stand, weight passes to the one that came last; NaN where
    markers do not tell how far it has passed: double support cut by the clip's ends, and feet that
    stand together without one having just come and the other going next.

    Parameters
    ----------
    bearing : whether any point of the right and of the left foot bears, (F, 2).
    """
    frames = len(bearing)
    share = np.where(bearing, 1.0, 0.0)
    for first, stop in stances(bearing.all(axis=1)):
        share[first:stop] = np.nan
        if first == 0 or stop == frames:
            continue
        before, after = bearing[first - 1], bearing[stop]
        if before.sum() != 1 or after.sum() != 1 or (before == after).all():
            continue
        trailing = 0 if before[0] else 1
        passed = smooth_step((np.arange(first, stop) + 0.5 - first) / (stop - first))
        share[first:stop, trailing] = 1 - passed
        share[first:stop, 1 - trailing] = passed
    return share
