"""Steps of a run: from each instant of its clock to the next, with all that a rate needs in between."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..coupling.cell import Reference
from .clock import Clock, Stretch
from .closed_loop import ClosedLoop
from .disturbances import DisturbanceSchedule
from .handover import up_to_a_failure

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
