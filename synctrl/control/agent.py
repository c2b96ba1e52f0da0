"""One robot's controller: it knows its own robot, and what the messages of its neighbours say.

A sample has two halves. `tell` gives the messages that are due now, made of what was measured; `step` takes
those that have come and gives the torque. Neither waits for anybody: a message that is late or lost is not
there, and the receiver goes on with what it had. What an agent runs is the `DiscreteController` of a cell of
one robot, `own_cell`, whose network is a `Mailbox`; so the law stands nowhere a second time.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import instance, limits, numbers
from ..coupling.desired import rows_of
from . import measured
from .controller import Controller
from .discrete import DiscreteController
from .network import BoundMailbox, Message
from .own import own_controllers


class Agent:
    """The controller of one robot of a cell, called twice a period; see the head of the module.

    Args:
        controller: that of the robot's own cell, with a `Mailbox` for its network, see `own_controllers`.
        period: time between two samples, s.
        torque_limits: (nv,), N·m, see `DiscreteController`.
        include_gravity, faults: see `DiscreteController`.

    Attributes:
        robot: which robot of the cell it drives, counted from 0.
        hears: the robots whose messages it takes.

    Raises:
        InputError: see `DiscreteController`; or a controller whose network is no `Mailbox`.
    """

    def __init__(
        self,
        controller: Controller,
        period: float,
        *,
        torque_limits: ArrayLike | None = None,
        include_gravity: bool = True,
        faults: str = "error",
    ):
        instance("controller", controller, Controller, "a Controller")
        instance("network", controller.network, BoundMailbox, "a Mailbox")
        self._network: BoundMailbox = controller.network  # type: ignore[assignment]
        self._loop = _OwnLoop(
            controller,
            period,
            torque_limits=limits("torque_limits", torque_limits, (controller.cell.nv,))[None],
            include_gravity=include_gravity,
            faults=faults,
        )
        self.robot, self.hears = self._network.robot, tuple(self._network.links.sender.tolist())

    @property
    def period(self) -> float:
        """Time between two samples, s."""
        return self._loop.period

    @property
    def unheard(self) -> tuple[int, ...]:
        """Robots of which nothing has come since `reset`; for their w and W stand zeros."""
        return self._network.unheard(self._loop.memory)

    def reset(self, t: float, q: ArrayLike, v: ArrayLike) -> None:
        """Forget everything, and expect the first sample at time t.

        Args:
            t: time, s, on the clock of the desired motions.
            q, v: joint positions and velocities, (nv,), rad (or m) and rad/s (or m/s).

        Raises:
            InputError: another shape, or a number that is not finite.
        """
        self._loop.reset(t, self._row("q", q), self._row("v", v))

    def tell(self, t: float, q: ArrayLike, v: ArrayLike) -> tuple[Message, ...]:
        """The messages that are due with the sample at time t; often one, or none. Nothing is remembered.

        The first message has W, w and w', for the others to begin with, later ones what receivers need.

        Args:
            t, q, v: as of `step`, which is to be called with the same ones.

        Raises:
            InputError: another shape, or a number that is not finite.
        """
        time, motion = self._loop.measurement(t, self._row("q", q), self._row("v", v))
        return self._loop.told(time, motion)

    def step(
        self,
        t: float,
        q: ArrayLike,
        v: ArrayLike,
        inbox: Iterable[Message] = (),
        desired: ArrayLike | None = None,
    ) -> np.ndarray:
        """Torque for the period that begins now, (nv,), N·m; the caller's to keep.

        A call that raises an error leaves the agent as it was, without the messages.

        Args:
            t: time, s, as of `DiscreteController.step`.
            q, v: what is measured, (nv,), rad (or m) and rad/s (or m/s).
            inbox: messages that have come since the last sample, in any order; may be repeated.
            desired: xd, xd', xd'', (3, m), in place of the robot's own desired motion.

        Raises:
            InputError: no messages, or one that none of its neighbours can have sent; and see
                `DiscreteController.step`.
            SynctrlError: see `DiscreteController.step`.
        """
        instance("inbox", inbox, Iterable, "messages, see Message.from_bytes")
        cell, wanted = self._loop.cell, None
        if desired is not None:
            wanted = numbers("desired", desired, (rows_of(cell.space), cell.m))[:, None]
        return self._loop.heed(t, self._row("q", q), self._row("v", v), inbox, wanted)[0]

    # -- memory -------------------------------------------------------------------------------------------

    @property
    def state(self) -> dict[str, np.ndarray]:
        """Everything that the next step depends on, as that of `DiscreteController`, with n = 1."""
        return self._loop.state

    @state.setter
    def state(self, state: Mapping[str, ArrayLike]) -> None:
        self._loop.state = state

    def save(self, path: str | Path) -> Path:
        """Write the state to a file, see `DiscreteController.save`."""
        return self._loop.save(path)

    def load(self, path: str | Path) -> None:
        """Read what `save` wrote, see `DiscreteController.load`."""
        self._loop.load(path)

    def __repr__(self) -> str:
        return f"Agent('{self._loop.cell.names[0]}', hears {list(self.hears)})"

    def _row(self, name: str, value: ArrayLike) -> np.ndarray:
        return numbers(name, value, (self._loop.cell.nv,))[None]


class _OwnLoop(DiscreteController):
    """A digital controller of one robot that is handed its messages."""

    def measurement(self, t: float, q: np.ndarray, v: np.ndarray) -> tuple[float, np.ndarray]:
        """A time, and q and v as one array, (2, 1, nv), that are in order."""
        time, motion = self._time(t), measured.measurement(q, v, self._shape)
        fault = measured.not_finite(self.cell, time, motion)
        if fault is not None:
            raise fault
        return time, motion

    def told(self, t: float, motion: np.ndarray) -> tuple[Message, ...]:
        """The messages that are due with the sample at time t."""
        due, network, memory = self._due(self._samples + self._missed(t)), self._mailbox, self.memory
        w = self._messages.weighted(self._reference(t), motion) if due else motion
        messages = []
        for at in due:
            messages.append(network.told(at, w, memory))
            memory = network.meet(at, w, memory)
        return tuple(message for message in messages if message is not None)

    def heed(
        self, t: float, q: np.ndarray, v: np.ndarray, inbox: Iterable[Message], desired: np.ndarray | None
    ) -> np.ndarray:
        """`step` with messages that have come before it."""
        before, latest = self.memory, self._time(t) + self._mailbox.traffic.period
        self.memory = self._mailbox.read(inbox, latest, before)
        try:
            return self.step(t, q, v, desired)
        except BaseException:
            self.memory = before
            raise

    @property
    def _mailbox(self) -> BoundMailbox:
        return self.controller.network  # type: ignore[return-value]


def agents_of(whole: DiscreteController) -> tuple[Agent, ...]:
    """One agent for every robot of a cell, which together do what one controller of all of them does.

    Args:
        whole: the controller of the cell, with a `Network(period=...)` between its robots.

    Raises:
        InputError: another network, or a law or an adaptation of which no robot can do its part with its own
            errors and messages alone.
    """
    options: dict[str, Any] = {"include_gravity": whole.include_gravity, "faults": whole.faults}
    return tuple(
        Agent(own, whole.period, torque_limits=row[: own.cell.nv], **options)
        for own, row in zip(own_controllers(whole.controller), whole.torque_limits, strict=True)
    )
