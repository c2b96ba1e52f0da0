"""The one loop through time: from each instant of the clock to the next, with events in between.

The clock's instants are the multiples of dt and, between them, every instant at which something jumps, so
within a step everything is smooth. At an instant the state arrives as x-, its limit from the left. What falls
there happens in this order:

1. the plant changes: loads are picked up and put down, and its own events move its state;
2. desired motions break, and torques from outside, which the code calls pushes, begin and end;
3. messages of the network arrive, with continuous control;
4. the controller takes a sample, with sampled control, and messages that are due with it.

That gives x+, from which the state goes on to the next instant. The row of a logged instant is x+, with the
torque and the push that act from it on. What falls on the end of a run belongs to a run that goes on from
there; only a sample that is due is still taken, and its torque is in the last row.

Of these only events of the plant (`step.loop.meet`) and what the controller does (`control.begin`) are calls
that the loop below makes. The rest is in the step itself, because it does not move the state but changes what
the state will do: `step.loop` has the plant with the loads of this step, `step.stages` the desired motion
and `step.push` the torque from outside. `steps` looks loop and push up in the middle of the step, which is
on the right side of every jump; what is desired at its end is taken from just before it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np

from ..control.controller import Signals
from ..coupling.cell import Reference
from .clock import Clock, Stretch
from .closed_loop import ClosedLoop, State
from .schedules import DisturbanceSchedule

Made = TypeVar("Made")
#: steps whose references are evaluated together
BLOCK = 256


class Step(NamedTuple):
    """One step of a run, within which everything is smooth.

    Attributes:
        t, t_next: its start and end, s.
        stages: what is desired at its start, in its middle, and just before its end, which are the three
            instants at which the Runge-Kutta method evaluates rates.
        loop: the closed loop with the plant as it is in between, with the loads that it carries then.
        push: torque from outside in between, (n, nv), N·m.
        number: which multiple of dt it begins at or after.
        checked: whether it begins at that multiple: there the run is watched, and samples fall.
        logged: whether it begins at an instant that is logged.
        joined: whether all goes on smoothly from the step before, so that its error can be estimated across
            the instant between them.
    """

    t: float
    t_next: float
    stages: tuple[Reference, Reference, Reference]
    loop: ClosedLoop
    push: np.ndarray
    number: int
    checked: bool
    logged: bool
    joined: bool

    @property
    def h(self) -> float:
        """Its length, s."""
        return self.t_next - self.t

    @property
    def middle(self) -> float:
        """Halfway through it, s."""
        return 0.5 * (self.t + self.t_next)


class Sample(NamedTuple):
    """State and signals at one instant, after its events, and whether it belongs into the log."""

    t: float
    y: np.ndarray
    disturbance: np.ndarray
    signals: Signals
    logged: bool = True


class Control(Protocol):
    """Who says how fast the state changes, and what happens when a step begins: `Continuous`, `Sampled`."""

    def begin(self, step: Step, y: State, rate: State) -> Signals:
        """Let messages arrive and samples be taken, which make the state x+.

        Args:
            step: the step that begins.
            y: the state, to be changed in place.
            rate: where its rate goes.

        Returns:
            What the controller computed in x+.
        """

    def rate(self, step: Step, reference: Reference, y: State, rate: State) -> None:
        """Write how fast the state changes within a step, where `reference` is desired."""

    def arrive(self, step: Step, y: State, expected: Any = np.nan) -> None:
        """Be told where a step has led.

        Args:
            step: the step.
            y: the state at its end, to be changed in place.
            expected: accelerations that the solver expected there, (n, nv), if it has an idea.
        """

    def finish(self, t: float, y: State) -> Signals:
        """What the controller computes at the end of a run, s."""


class Solver(Protocol):
    """How the state gets across a step: `RungeKutta`, `Scipy`, or one of a user's own."""

    def carry(self, control: Control, step: Step, y: State, rate: State) -> State:
        """The state at the end of a step.

        Args:
            control: asked for rates; told by `arrive` of every step that the solver makes.
            step: the step.
            y: the state at its beginning, which the solver may use from now on.
            rate: the rate there, valid until the next call.
        """


def due(agenda: deque[float], t: float) -> list[float]:
    """Take from instants in order those that come up until time t, s."""
    found = []
    while agenda and agenda[0] <= t:
        found.append(agenda.popleft())
    return found


def advance(
    loop: ClosedLoop, clock: Clock, schedule: DisturbanceSchedule, control: Control, solver: Solver
) -> Iterator[Sample]:
    """Carry the initial state through time.

    Args:
        loop: the closed loop.
        clock: its instants.
        schedule: torques from outside.
        control: what the controller does.
        solver: how a step is made.

    Yields:
        One sample per multiple of dt, and one at the end. Its arrays are valid until the next one.

    Raises:
        SynctrlError: the run cannot go on.
    """
    y, rate = loop.state(loop.initial_state()), loop.state(np.zeros(loop.size))
    events = deque(sorted(t for t in loop.events.tolist() if t >= 0))
    for step in steps(loop, clock, schedule):
        for event in due(events, step.middle):
            step.loop.meet(event, y)
        signals = control.begin(step, y, rate)
        if step.checked:
            yield Sample(step.t, y.flat, step.push, signals, step.logged)
        y = solver.carry(control, step, y, rate)
    yield Sample(clock.end, y.flat, step.push, control.finish(clock.end, y))


def steps(loop: ClosedLoop, clock: Clock, schedule: DisturbanceSchedule) -> Iterator[Step]:
    """Every step of the clock; all that come before an instant whose references cannot be had, and its error.

    Raises:
        SynctrlError: a desired motion or weight fails.
    """

    def make(first: int, last: int) -> list[Step]:
        return list(_tabulated(loop, clock, clock.stretch(first, last), schedule))

    for first, last in clock.stretches(BLOCK):
        for made in up_to_a_failure(make, first, last):
            yield from made


def _tabulated(
    loop: ClosedLoop, clock: Clock, stretch: Stretch, schedule: DisturbanceSchedule
) -> Iterator[Step]:
    """The steps of a stretch, their references evaluated together."""
    table, n = loop.cell.reference_table(stretch.stages.ravel()), len(stretch.starts)
    stages = (loop.cell.instants(table, slice(i * n, (i + 1) * n)) for i in range(3))
    middles = stretch.middles
    columns = stretch.number, stretch.checked, stretch.logged, clock.joined(stretch.first, stretch.starts)
    return map(
        Step,
        stretch.starts.tolist(),
        stretch.times[1:].tolist(),
        zip(*stages, strict=True),
        map(loop.at, middles.tolist()),
        map(schedule.torques.__getitem__, schedule.windows(middles).tolist()),
        *(column.tolist() for column in columns),
    )


def up_to_a_failure(make: Callable[[int, int], Made], first: int, last: int) -> Iterator[Made]:
    """What is made for the steps [first, last) in one go, or, if that fails, for those before the failure.

    Args:
        make: first, last -> what is made.
        first, last: the steps.

    Raises:
        Exception, KeyboardInterrupt: what `make` raised for the first step for which it fails. An interrupt
            that does not come again was not of its doing, and is raised at once.
    """
    made, failure = _attempt(make, first, last)
    if failure is None:
        yield made  # type: ignore[misc]
        return
    good, bad = first, last
    while bad - good > 1:
        middle = (good + bad) // 2
        found = _attempt(make, good, middle)[1]
        good, bad, failure = (middle, bad, failure) if found is None else (good, middle, found)
    again = _attempt(make, good, bad)[1]
    if again is not None and good > first:
        yield make(first, good)
    raise failure if again is None else again


def _attempt(
    make: Callable[[int, int], Made], first: int, last: int
) -> tuple[Made | None, BaseException | None]:
    try:
        return make(first, last), None
    except (Exception, KeyboardInterrupt) as error:
        return None, error
