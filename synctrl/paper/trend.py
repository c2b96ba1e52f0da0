"""How an error goes on: its envelope over the later half of a run, and the rate at which that falls.

What is left of an error at one instant says as much about the instant as about the run. Whether the error
still falls, and how fast, is asked of windows that grow with the run, so that the answer is the same early
and late, as long as nothing else begins to act.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

#: into how many windows the later half of a run is cut
WINDOWS = 5
#: of an error that falls at most this share is left over the later half of the run, by the fitted rate
FALLEN = 0.75


@dataclass(frozen=True, eq=False)
class Trend:
    """The envelope of |e| over the later half of a run.

    Attributes:
        t: mean instant of each window, (k,), s.
        envelope: largest |e| of each window, over all rows and axes, (k,).
        rate: at which an exponential through the envelope falls, by least squares of its logarithm, 1/s.
        kept: share of it that is left from the first window to the last.
    """

    t: np.ndarray
    envelope: np.ndarray
    rate: float
    kept: float

    @property
    def falls(self) -> bool:
        """Whether the envelope falls from each window to the next, and by enough over all of them."""
        return bool((np.diff(self.envelope) < 0).all() and self.kept <= FALLEN)


def trend(t: np.ndarray, e: np.ndarray) -> Trend:
    """How |e|, (T, ...), goes on over the later half of the instants t, (T,), s."""
    later = np.flatnonzero(t >= (t[0] + t[-1]) / 2)
    parts = [part for part in np.array_split(later, WINDOWS) if len(part)]
    middles = np.array([t[part].mean() for part in parts])
    envelope = np.array([np.abs(e[part]).max() for part in parts])
    rate = fitted_rate(middles, envelope)
    return Trend(middles, envelope, rate, float(np.exp(-rate * (middles[-1] - middles[0]))))


def fitted_rate(t: np.ndarray, envelope: np.ndarray) -> float:
    """Rate of the exponential that fits an envelope best, 1/s; 0 for a single instant."""
    if len(t) < 2:
        return 0.0
    return -float(np.polyfit(t, np.log(np.maximum(envelope, np.finfo(float).tiny)), 1)[0])
