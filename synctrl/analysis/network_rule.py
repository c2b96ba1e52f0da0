"""Whether messages between robots come often and early enough, and what to change if they do not."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..control.network import Communication, Network
from .delay_margin import growth
from .frozen import Frozen, freeze
from .gain_case import Case, Change
from .gain_rules import MARGIN, coupled
from .period_margin import Exchange, first_loss, multiplier

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
