"""Actuators: what becomes of the torque that the controller asks for, on its way to the joints.

Some act on what is asked for at samples, which is held until the next one: steps of torque, limits of its
rate, and actuators of one's own, see `Actuator`. A dead time shifts that in time. A lag and a ripple are at
work all the time: with torque that is held both are known in closed form, so the plant gets no state for
them.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from ...checks import finite_number, non_negative_number, shaped
from ...coupling.cell import Cell
from ...errors import InputError
from .settings import Device, Settings, at_joints, in_steps, numbers_of

Command = Callable[[np.ndarray], np.ndarray]
"""Torque that is asked for at a sample, (n, nv), N·m -> torque that is passed on. Samples come in order."""
#: instants that are closer than this share of a period are one
GRID = 1e-9


class Actuator(Device[Command], Protocol):
    """What acts on the torque that is asked for at samples."""


@dataclass(frozen=True, eq=False)
class TorqueQuantisation(Settings):
    """Torque in steps: tau = step round(tau / step).

    Args:
        step: a number, (nv,) or (n, nv), N·m (or N); 0 for a joint without steps.

    Raises:
        InputError: not numbers, not finite, or below 0.
    """

    step: ArrayLike

    def __post_init__(self) -> None:
        self._set("step", numbers_of("step", self.step, 0.0))

    def bind(self, cell: Cell, period: float) -> Command:
        return partial(in_steps, step=at_joints("step", self.step, cell))


@dataclass(frozen=True, eq=False)
class RateLimit(Settings):
    """Torque that changes from sample to sample by at most rate T, with the period T; the first one is free.

    Args:
        rate: a number, (nv,) or (n, nv), N·m/s (or N/s).

    Raises:
        InputError: not numbers, not finite, or below 0.
    """

    rate: ArrayLike

    def __post_init__(self) -> None:
        self._set("rate", numbers_of("rate", self.rate, 0.0))

    def bind(self, cell: Cell, period: float) -> Command:
        return _Limited(period * at_joints("rate", self.rate, cell))


@dataclass(frozen=True, eq=False)
class DeadTime(Settings):
    """Torque that acts a while after it was asked for; until then acts what is asked for at t = 0.

    Args:
        time: how long, s; it need be no multiple of the period, nor of the step.

    Raises:
        InputError: no number, or below 0.
    """

    time: float

    def __post_init__(self) -> None:
        self._set("time", non_negative_number("time", self.time))

    def bind(self, cell: Cell, period: float) -> Command:
        """Torque as it is: what a dead time does is no matter of one sample."""
        return _kept


@dataclass(frozen=True, eq=False)
class Lag(Settings):
    """Torque tau_m that follows what is asked for, T tau_m' = tau - tau_m, and begins with what is at t = 0.

    Args:
        time_constant: T, a number, (nv,) or (n, nv), s; 0 for a joint that does not lag.

    Raises:
        InputError: not numbers, not finite, or below 0.
    """

    time_constant: ArrayLike

    def __post_init__(self) -> None:
        self._set("time_constant", numbers_of("time_constant", self.time_constant, 0.0))

    def bind(self, cell: Cell, period: float) -> Command:
        """Torque as it is at samples, once the numbers fit the cell."""
        at_joints("time_constant", self.time_constant, cell)
        return _kept


@dataclass(frozen=True, eq=False)
class Ripple(Settings):
    """Torque that changes with the angle of the joint, tau (1 + share sin(order q + phase)).

    Args:
        share: amplitude, a number, (nv,) or (n, nv).
        order: ripples in 2 pi rad, of a joint that slides in 2 pi m.
        phase: rad.

    Raises:
        InputError: not numbers, or not finite.
    """

    share: ArrayLike
    order: float = 1.0
    phase: float = 0.0

    def __post_init__(self) -> None:
        self._set("share", numbers_of("share", self.share))
        self._set("order", finite_number("order", self.order))
        self._set("phase", finite_number("phase", self.phase))

    def bind(self, cell: Cell, period: float) -> Command:
        """Torque as it is at samples, once the numbers fit the cell."""
        at_joints("share", self.share, cell)
        return _kept


class Drive:
    """Torque of the motors through time, of what is asked for at samples.

    Between the instants at which it gets a new goal,

        tau(t, q) = (goal + owed exp((since - t) rate)) (1 + share sin(order q + phase)).

    Args:
        parts: actuators in the order in which they act.
        cell: the robots.
        period: time between two samples, s.

    Attributes:
        delay: all dead times together, s.
        goal, owed: (n, nv), N·m; `owed` is what was missing at `since`.
        since: when it got its goal, s.
        rate: of the lag, (n, nv), 1/s; 0 where nothing lags, and nothing is owed.
        ripple: its share, (n, nv), order and phase.

    Raises:
        InputError: an order that means nothing, or numbers that do not fit.
    """

    def __init__(self, parts: Sequence[Actuator], cell: Cell, period: float):
        _check_order(parts)
        self._commands = [(type(part).__qualname__, part.bind(cell, period)) for part in parts]
        self.delay = float(sum(part.time for part in parts if isinstance(part, DeadTime)))
        self._slack = GRID * period
        self._due: deque[tuple[float, np.ndarray]] = deque()
        self._started, self.since = False, 0.0
        self.goal, self.owed, self.rate, share = np.zeros((4, cell.n, cell.nv))
        self.ripple = share, 0.0, 0.0
        for part in parts:
            if isinstance(part, Lag):
                T = at_joints("time_constant", part.time_constant, cell)
                np.divide(1.0, T, out=self.rate, where=T > 0)
            elif isinstance(part, Ripple):
                self.ripple = at_joints("share", part.share, cell), part.order, part.phase

    def command(self, t: float, tau: np.ndarray) -> None:
        """Ask for torque tau, (n, nv), N·m, at a sample at time t, s.

        Raises:
            InputError: an actuator gives something of another shape.
        """
        for name, command in self._commands:
            tau = command(tau)
            shaped(f"actuator {name}", tau, self.goal.shape)
        if not self._started:  # until then all was as it is now
            self._started, self.goal = True, np.array(tau)
        self._due.append((t + self.delay, np.array(tau)))

    def reach(self, t: float) -> None:
        """Take the goals that are due until time t, s."""
        while self._due and self._due[0][0] <= t + self._slack:
            since, goal = self._due.popleft()
            self.owed = np.where(self.rate > 0, self._smooth(since) - goal, 0.0)
            self.goal, self.since = goal, since

    def torque(self, t: float, q: np.ndarray) -> np.ndarray:
        """What the motors give, (n, nv), N·m, at time t, s, and positions q, (n, nv), of the joints."""
        share, order, phase = self.ripple
        return self._smooth(t) * (1 + share * np.sin(order * q + phase))

    def _smooth(self, t: float) -> np.ndarray:
        return self.goal + self.owed * np.exp((self.since - t) * self.rate)


class _Limited:
    """Torque that changes by a certain size at most; it remembers the sample before."""

    def __init__(self, largest: np.ndarray):
        self._largest = largest
        self._last: np.ndarray | None = None

    def __call__(self, tau: np.ndarray) -> np.ndarray:
        last = tau if self._last is None else self._last
        self._last = last + np.clip(tau - last, -self._largest, self._largest)
        return self._last


def _kept(tau: np.ndarray) -> np.ndarray:
    return tau


def _check_order(parts: Sequence[Actuator]) -> None:
    """Refuse two of what there is one of, and samples behind what goes on between them.

    Raises:
        InputError: naming the actuators.
    """
    places = [2 if isinstance(part, Ripple) else 1 if isinstance(part, Lag) else 0 for part in parts]
    if places != sorted(places) or places.count(1) > 1 or places.count(2) > 1:
        found = ", ".join(type(part).__name__ for part in parts)
        text = "what acts at samples or is a dead time first, then at most one Lag, then at most one Ripple"
        raise InputError.expected(text, found, "actuators", shown=found)
