"""The first growth of V along a run, and the term of V' that did it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .lyapunov import EPS, Lyapunov


@dataclass(frozen=True)
class Growth:
    """The first instant at which V grows.

    Attributes:
        time: s.
        index: of that instant in the log.
        rate: V' there, or the increase to the next instant over the step if V' is not positive.
        term: the largest positive power there; "integration" if there is none, and the step is too long.
    """

    time: float
    index: int
    rate: float
    term: str


def first_growth(record: Lyapunov) -> Growth | None:
    """The first instant at which V grows beyond rounding, and the term that did it; None if it never does.

    Jumps of V, at events of plant or network or of what is desired, do not count: they are no matter of V'.
    """
    V, V_dot = record.V, record.V_dot
    rising = V_dot > record.rounding
    gained = np.diff(V, append=V[-1])
    gained[list(record.events)] = 0.0  # a jump at an event is no growth by V'
    rising |= gained > 8 * EPS * V + record.rounding * np.diff(record.t, append=record.t[-1])
    if not rising.any():
        return None
    k = int(np.argmax(rising))
    if V_dot[k] > record.rounding[k]:
        term = max(record.power, key=lambda name: record.power[name][k])
        return Growth(float(record.t[k]), k, float(V_dot[k]), term)
    rate = float(gained[k] / (record.t[k + 1] - record.t[k]))
    term = max(record.power, key=lambda name: record.power[name][k + 1])
    grows = record.power[term][k + 1] > record.rounding[k + 1]
    return Growth(float(record.t[k]), k, rate, term if grows else "integration")
