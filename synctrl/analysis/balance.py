"""The balance of V over time: whether all power that enters or leaves it has been accounted for."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from .replay import Replay


def drift(
    run: Replay, rates: Sequence[np.ndarray], V: np.ndarray, V_dot: np.ndarray
) -> tuple[np.ndarray, float]:
    """V - V(0) - integral of V', (T,), and a bound of its numerical error.

    V' is integrated by a cubic spline, which like the Runge-Kutta method errs with the fourth power of the
    step and with a larger constant. What an integral changes when every second instant is left out is about
    15 times its error. Summed over the terms of V, which exchange much, it stands for both errors.

    Args:
        run: instants of a run.
        rates: of the terms of V, (R,) each.
        V, V_dot: (R,).
    """
    missed, bound, columns = np.zeros(len(run.logged)), 0.0, np.stack((V_dot, *rates), axis=1)
    for first, last, rows in run.pieces:
        t = run.result.t[first : last + 1]
        gained, *terms = _integral(t, columns[rows]).T
        missing = V[rows] - V[rows][0] - gained
        missed[last + 1 :] = missed[first] + missing[-1]
        missed[first : last + 1] = missed[first] + missing
        bound += _halving(t, columns[rows, 1:], np.transpose(terms))
    return missed, bound


def jumped(run: Replay, V: np.ndarray) -> float:
    """What V gained between the smooth parts of a run, at jumps of the desired velocity or of the state.

    Of a jump that falls between two logged instants it has what V did from one to the other.
    """
    parts = [rows for _, _, rows in run.pieces]
    return float(sum(V[b.start] - V[a.stop - 1] for a, b in pairwise(parts)))


def supplied(run: Replay, rates: np.ndarray) -> np.ndarray:
    """Integrals of powers, (R, ...), over all pieces of the run, (...)."""
    t, none = run.result.t, np.zeros(rates.shape[1:])
    return sum((_integral(t[first : last + 1], rates[rows])[-1] for first, last, rows in run.pieces), none)


def accumulated(run: Replay, rates: np.ndarray) -> np.ndarray:
    """Integrals of rates, (R, ...), from the first instant to each, (T, ...).

    Where nothing jumps they are those of `supplied`. An interval of the log in which something does, and one
    that is a piece of its own, get the mean of their two ends.
    """
    t, start = run.result.t, run.logged[:-1]
    steps = np.diff(t).reshape(-1, *[1] * (rates.ndim - 1))
    gained = 0.5 * steps * (rates[start] + rates[start + 1])
    for first, last, rows in run.pieces:
        if last > first + 1:
            gained[first:last] = np.diff(_integral(t[first : last + 1], rates[rows]), axis=0)
    return np.concatenate((np.zeros_like(rates[:1]), np.cumsum(gained, axis=0)))


def _integral(t: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Integrals of smooth rates, (T, ...), from the first instant to each."""
    from scipy.interpolate import make_interp_spline

    return make_interp_spline(t, rate, k=min(3, len(t) - 1)).antiderivative()(t)


def _halving(t: np.ndarray, rates: np.ndarray, integrals: np.ndarray) -> float:
    """How much integrals of rates, (T, k), change when every second instant is left out, in all."""
    half = np.unique(np.append(np.arange(0, len(t), 2), len(t) - 1))
    return float(np.abs(_integral(t[half], rates[half]) - integrals[half]).max(axis=0).sum())
