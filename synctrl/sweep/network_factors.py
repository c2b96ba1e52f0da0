"""Factors of a sweep that are settings of the experiment's `Network`; without one it starts as `Network()`.

A setting that does not go with the others, such as a loss without a period, makes a refused row. Factors are
applied in the order in which they are listed, so the period comes first.
"""

from __future__ import annotations

from functools import partial

from . import variations
from .distributions import Choice, Grid, Values
from .factors import Factor, indexed


def network_period(values: Values) -> Factor:
    """Time between two messages of a robot, s."""
    return _setting("period", values)


def network_delay(values: Values) -> Factor:
    """How late every robot hears every other, s."""
    return _setting("delay", values)


def network_jitter(values: Values) -> Factor:
    """Longest random addition to the delay of a message, s."""
    return _setting("jitter", values)


def network_loss(values: Values) -> Factor:
    """Probability that a message is lost, below 1."""
    return _setting("loss", values)


def network_burst_start(values: Values) -> Factor:
    """Probability per message that a link turns bad; it heals as before, by default at the next message."""
    return Factor("network_burst_start", values, partial(variations.with_burst, part=0))


def network_burst_end(values: Values) -> Factor:
    """Probability per message that a bad link heals; it turns bad as before, by default never."""
    return Factor("network_burst_end", values, partial(variations.with_burst, part=1))


def network_offset(values: Values, robot: int | None = None) -> Factor:
    """How much the clock of one robot, counted from 0, or of all is ahead, s."""
    return indexed("network_offset", values, variations.with_clock, robot=robot)


def network_event(values: Values) -> Factor:
    """Threshold beyond which a robot has something to say, in the unit of c e."""
    return _setting("event", values)


def network_heartbeat(values: Values) -> Factor:
    """Longest silence with an event, s."""
    return _setting("heartbeat", values)


def network_receiver(values: Grid | Choice) -> Factor:
    """What is believed between messages: listed words of "filter", "hold" and "extrapolate"."""
    return _setting("receiver", values)


def network_omega(values: Values) -> Factor:
    """Rate of the receivers' filter, rad/s."""
    return _setting("omega", values)


def network_horizon(values: Values) -> Factor:
    """Age up to which messages are extrapolated, s."""
    return _setting("horizon", values)


def network_seed(values: Grid | Choice) -> Factor:
    """Listed seeds of losses, bursts and jitter, whole numbers."""
    return Factor("network_seed", values, variations.with_seed)


def _setting(name: str, values: Values) -> Factor:
    """A factor that sets one number or word of the network."""
    return Factor(f"network_{name}", values, partial(variations.with_setting, setting=name))
