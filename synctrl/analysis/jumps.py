"""Where something jumps in the log of a run, and the parts in between in which nothing does.

At edges and breaks the right-hand side jumps: a logged instant there has a value from the left and one from
the right. At events the state itself jumps, and the log has it afterwards only: like an edge between two
instants, an event parts the log. What V does there is no part of V', and nothing is said of it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..control.network.messages import GRID
from ..coupling.cell import Cell
from ..simulation.closed_loop import ClosedLoop
from ..simulation.schedules import DisturbanceSchedule

#: how long before a break a desired motion is looked at, s: more than times and clocks are rounded
JUST_BEFORE = 1e-11
#: relative size from which a difference between the two sides of a break is a jump, and not rounding
JUMP = 1e-9


class SmoothPart(NamedTuple):
    """A part of the log in which nothing jumps: instants `first` to `last`, and their rows."""

    first: int
    last: int
    rows: slice


class DesiredJump(NamedTuple):
    """A jump of what is desired of a robot: its number, "position" or "velocity", the size, and when, s."""

    robot: int
    what: str
    size: float
    time: float


def desired_jumps(cell: Cell, end: float) -> list[DesiredJump]:
    """Jumps of desired positions and velocities after 0 and until the end, s; s_q and V jump there, too.

    Of all robots the one that jumps most.
    """
    found = []
    for time in (time for time in cell.breaks if 0.0 < time <= end):
        instants = np.array([time - JUST_BEFORE, time])
        left, right = (reference.desired for reference in cell.references(instants))
        for row, what in enumerate(("position", "velocity")):
            jump, passed = np.abs(right[row] - left[row]).max(axis=-1), JUST_BEFORE * np.abs(left[row + 1])
            i = int(jump.argmax())
            if jump[i] > JUMP * max(1.0, np.abs(right[row]).max()) + 2 * passed.max():
                found.append(DesiredJump(i, what, float(jump[i]), time))
    return found


def jumps_in(
    t: np.ndarray, loop: ClosedLoop, schedule: DisturbanceSchedule, period: float | None
) -> tuple[list[int], list[int], list[int]]:
    """Where something jumps.

    Args:
        t: logged instants, (T,), s.
        loop: the closed loop.
        schedule: torques from outside.
        period: of sampled control, with which messages arrive at samples, s, or None.

    Returns:
        Logged instants at which something jumps; those before a jump that falls between two, an event among
        them; and those before an event.
    """
    events = _events_in(t, loop, period)
    on_log, between = set(), {*events}
    heard = getattr(loop.controller.network, "breaks", ())
    for jump in (*schedule.edges, *loop.plant.schedule.edges, *loop.cell.breaks, *heard):
        if t[0] < jump < t[-1]:
            nearest = int(np.abs(t - jump).argmin())
            if abs(t[nearest] - jump) <= tolerance(t):
                on_log.add(nearest)
            else:
                between.add(int(np.searchsorted(t, jump)) - 1)
    return sorted(on_log - {0, len(t) - 1} - {k + 1 for k in events}), sorted(between), events


def _events_in(t: np.ndarray, loop: ClosedLoop, period: float | None) -> list[int]:
    """Logged instants between which and the next one the state jumps, and V with it."""
    events, end = np.sort(loop.events), float(t[-1])
    messages = np.array(loop.messages.between(0.0, end) if jumps_at_messages(loop) else [])
    if period is not None:
        messages = period * np.ceil(messages / period - GRID)
    return list(ends_before(t, np.concatenate((events, messages))))


def jumps_of_v(t: np.ndarray, cell: Cell, events: tuple[int, ...]) -> tuple[int, ...]:
    """Logged instants between which and the next one V jumps, at `events` or where what is desired jumps."""
    times = np.array([jump.time for jump in desired_jumps(cell, float(t[-1]))])
    return tuple(sorted({*events, *ends_before(t, times)}))


def ends_before(t: np.ndarray, times: np.ndarray) -> tuple[int, ...]:
    """Logged instants between which and the next one something happens, at that next one at the latest."""
    after = np.searchsorted(t, times - tolerance(t))
    return tuple(sorted({int(k) - 1 for k in after if 0 < k < len(t)}))


def jumps_at_messages(loop: ClosedLoop) -> bool:
    """Whether V jumps at messages: it does unless the network says that what robots believe does not."""
    return loop.messages.sent and getattr(loop.controller.network, "jumps", True)


def tolerance(t: np.ndarray) -> float:
    """How far a jump may be from a logged instant that stands for it, s."""
    return 1e-9 * float(np.diff(t).max(initial=0.0))


def pieces(logged: np.ndarray, jumps: list[int], crossed: list[int]) -> tuple[SmoothPart, ...]:
    """The parts of a log between jumps.

    Args:
        logged: row of every logged instant, (T,).
        jumps, crossed: as `jumps_in` gives them.
    """
    starts = sorted([0, *jumps, *(k + 1 for k in crossed)])
    ends = sorted([*jumps, *crossed, len(logged) - 1])
    return tuple(
        SmoothPart(a, b, slice(int(logged[a]), int(logged[b]) + 1 - (b in jumps)))
        for a, b in zip(starts, ends, strict=True)
        if b > a
    )
