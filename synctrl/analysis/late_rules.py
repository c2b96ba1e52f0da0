"""Whether torque, measurements and messages come early enough, and what to change if they do not."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from ..control.gains import Gains
from ..control.network import Communication, Network
from .delay_margin import growth
from .equipped import Equipment, equipped
from .frozen import Frozen, freeze
from .gain_case import Case, Change
from .gain_rules import MARGIN, coupled
from .linear_loop import LinearLoop
from .period_margin import Exchange, first_loss, multiplier

#: shares of K_r that are tried where sensors and actuators lag, and part of the one that does
FEWER, SAFE = np.geomspace(1.0, 0.01, 40), 0.6
#: growth of errors that is worth a word, 1/s
GROWING = 1.0
LAG = "sensors and actuators lag too much for so much of it"
#: periods, or delays, looked at as shares of the one that is too long
SHARES = np.geomspace(0.01, 1.0, 25)


def too_late(case: Case, network: Communication | None) -> Iterator[Change]:
    """K_eps, or period or delay of the network, where small errors grow between robots that hear each other.

    Chance and clocks are left out: no message is lost, and all come with the longest delay.

    Args:
        case: the gains as they are.
        network: what robots know of each other; only a `Network` is ever late.
    """
    if not isinstance(network, Network) or not _lost(_frozen(case), network, 1.0):
        return
    change = coupled(case, "late", "with less of it every constant delay between robots is tolerated")
    if change is not None:
        yield change
        case = replace(case, gains=change.gains)
    frozen = _frozen(case)
    if _lost(frozen, network, 1.0):
        yield _sooner(case, frozen, network)


def too_lagged(case: Case, parts: Equipment, linear: Callable[[Gains], LinearLoop]) -> Iterator[Change]:
    """Gamma, or K_r and K_eps with it, where small errors grow because sensors and actuators lag.

    Args:
        case: the gains as they are.
        parts: the lags.
        linear: small errors where the cell starts, for some gains.
    """

    def grows(gains: Gains) -> bool:
        return growth(equipped(_with_learning(linear(gains)), parts), 0.0) > GROWING

    if parts == Equipment() or not grows(case.gains):
        return
    for name, calmed in (("Gamma", _slower), ("K_r", _softer)):
        share = SAFE * next((share for share in FEWER if not grows(calmed(case.gains, share))), 0.0)
        if share > 0 and getattr(case.gains, name).any():
            found, gains = float(max(map(np.max, getattr(case.gains, name)))), calmed(case.gains, share)
            to = found * (share**2 if name == "Gamma" else share)
            yield Change("late", name, None, None, found, to, "", LAG, gains)
            return


def _slower(gains: Gains, share: float) -> Gains:
    """Rates of learning times the square of a share, as damping times the share could bear."""
    return gains if gains.Gamma is None else gains.replace(Gamma=share**2 * gains.Gamma)


def _softer(gains: Gains, share: float) -> Gains:
    """Damping and coupling times a share, and learning as slow as that asks for."""
    softer = gains.replace(K_r=share * gains.K_r, K_eps=share * gains.K_eps)
    return _slower(softer, share)


def _with_learning(linear: LinearLoop) -> Frozen:
    """The same as a frozen cell with p before y', which are the last ones there."""
    W, y, v, p = linear.parts
    order = np.r_[W, y, p, v]
    heard = np.zeros((len(order), linear.frozen.heard.shape[1]))
    sent = np.zeros((linear.frozen.sent.shape[0], len(order)))
    return replace(linear.frozen, own=linear.A[np.ix_(order, order)], heard=heard, sent=sent, proved=False)


def _frozen(case: Case) -> Frozen:
    return freeze(case.loop.cell, case.gains, k_r_space=case.controller.k_r_space)


def _lost(frozen: Frozen, network: Network, share: float) -> bool:
    """Whether small errors grow with a share of the network's period, or of its delay if it has no period."""
    delay = float(np.max(network.delay) + np.max(network.jitter))
    if network.period is None:
        return not frozen.proved and growth(frozen, share * delay) > 0
    horizon = frozen.horizon if network.horizon is None else network.horizon
    sent = Exchange(share * network.period, delay, network.receiver, network.omega, horizon)
    return multiplier(frozen, sent) > 1


def _sooner(case: Case, frozen: Frozen, network: Network) -> Change:
    """A shorter period, or delay where there is none."""
    what, found = (
        ("delay", float(np.max(network.delay))) if network.period is None else ("period", network.period)
    )
    most = MARGIN * first_loss(lambda share: _lost(frozen, network, share), SHARES)
    why = "between robots that hear each other so late small errors grow"
    return Change("late", f"network {what}", None, None, found, most * found, "s", why, case.gains)
