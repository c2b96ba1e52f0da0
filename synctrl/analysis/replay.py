"""A run gone through again: the closed loop evaluated at every logged state."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import NamedTuple

import numpy as np

from ..checks import instance
from ..errors import InputError
from ..simulation.closed_loop import ClosedLoop
from ..simulation.recorder import ADAPTATION_STATE, NETWORK_STATE, PLANT_STATE
from ..simulation.result import Result
from ..simulation.schedules import DisturbanceSchedule
from ..simulation.simulate import Experiment
from .jumps import SmoothPart, jumps_in, pieces, tolerance
from .model_torques import Robots
from .moment import Moment, look, moment
from .origin import check_numbers, check_same, check_settings, check_sizes
from .stacked import Stack, stackable

#: instants whose references are evaluated together
BLOCK = 256


@dataclass(frozen=True, eq=False)
class Replay:
    """The instants of a run, gone through again.

    Attributes:
        result: the run.
        experiment: what made it.
        loop: its closed loop.
        rows: states and signals, one row per instant, and two where something jumps: from the left and right.
        logged: row of every logged instant, (T,); at a jump the one from the right.
        pieces: parts of the log in which nothing jumps.
        events: instants between which and the next one the state jumps, by events of plant or network.
        learning: names of the powers of the adaptation.
        stored, chained: names of the energies and powers of a closed chain, none if there is none.
    """

    result: Result
    experiment: Experiment
    loop: ClosedLoop
    rows: Moment
    logged: np.ndarray
    pieces: tuple[SmoothPart, ...]
    events: tuple[int, ...]
    learning: tuple[str, ...]
    stored: tuple[str, ...]
    chained: tuple[str, ...]


def replay(result: Result | Replay, experiment: Experiment | None = None) -> Replay:
    """Evaluate the closed loop at every logged state of a run.

    Args:
        result: the run; its replay, where one has been made already, is returned as it is.
        experiment: what made it; may be left out while the result still knows.

    Raises:
        InputError: no experiment for a result loaded from a file, another than the one that made it, numbers
            that have no squares, or a state of adaptation or plant that is not in the result.
    """
    if isinstance(result, Replay):
        return result
    instance("result", result, Result, "a Result")
    experiment = experiment_of(result, experiment)
    loop = experiment.closed_loop(result.info.get("plant", "pinocchio"))
    check_sizes(result, loop)
    check_settings(result, loop)
    check_numbers(result)
    schedule = DisturbanceSchedule(loop.cell, experiment.disturbances)
    jumps, crossed, events = jumps_in(result.t, loop, schedule, result.info.get("control_period"))
    rows = _moments(result, loop, schedule, jumps)
    instants = np.arange(len(result.t))
    logged = instants + np.searchsorted(jumps, instants, side="right")
    speed = np.abs(rows.v_ref) + np.abs(rows.v)
    check_same(result, rows.s_q[logged], speed[logged])
    names = _names(loop, result)
    parts = pieces(logged, jumps, crossed)
    return Replay(result, experiment, loop, rows, logged, parts, tuple(events), *names)


def experiment_of(result: Result, experiment: Experiment | None) -> Experiment:
    """The experiment given, or else the one the result still knows.

    Raises:
        InputError: there is neither.
    """
    experiment = result.experiment if experiment is None else experiment
    if experiment is None:
        raise InputError(
            "this result was loaded from a file and does not know the closed loop that made it; "
            "pass the experiment, for example certify(result, experiment=planar_four())",
            subject="experiment",
        )
    instance("experiment", experiment, Experiment, "an Experiment")
    return experiment


# -- rows -------------------------------------------------------------------------------------------------


def _moments(result: Result, loop: ClosedLoop, schedule: DisturbanceSchedule, jumps: list[int]) -> Moment:
    """The closed loop at every logged instant, and twice where something jumps, one row each."""
    visits = _visits(result, loop, schedule, jumps)
    parts = [*(_together if stackable(loop) else _one_by_one)(result, loop, visits)]
    return parts[0] if len(parts) == 1 else Moment(*map(np.concatenate, zip(*parts, strict=True)))


class Visits(NamedTuple):
    """Evaluations of the closed loop in the order of time; where something jumps, from the left and right.

    Attributes:
        k: logged instants whose states they are, (R,).
        times: of what is desired, (R,), s.
        loops: the closed loop as it is then, R of them.
        disturbance: torque from outside, (R, n, nv), N·m.
    """

    k: np.ndarray
    times: np.ndarray
    loops: Sequence[ClosedLoop]
    disturbance: np.ndarray

    def part(self, start: int, stop: int) -> Visits:
        """Some of them."""
        rows = slice(start, stop)
        return Visits(self.k[rows], self.times[rows], self.loops[rows], self.disturbance[rows])


def _visits(result: Result, loop: ClosedLoop, schedule: DisturbanceSchedule, jumps: list[int]) -> Visits:
    t, instants = result.t, np.arange(len(result.t))
    k = np.sort(np.append(instants, np.array(jumps, int)))
    left = np.flatnonzero(np.diff(k, append=-1) == 0)
    times, at, disturbance = t[k], t[k], result.disturbance[k]
    times[left], at[left] = np.nextafter(t[k[left]], -np.inf), t[k[left]] - 2 * tolerance(t)
    for row in left:
        disturbance[row] = schedule.torque(at[row])
    return Visits(k, times, [*map(loop.at, at.tolist())], disturbance)


def _one_by_one(result: Result, loop: ClosedLoop, visits: Visits) -> Iterator[Moment]:
    """A row at a time, of a closed loop with parts of any kind."""
    bodies = Robots(loop.cell.robots)
    for start in range(0, len(visits.k), BLOCK):
        part = visits.part(start, start + BLOCK)
        references = loop.cell.references(part.times)
        for k, at, disturbance, reference in zip(
            part.k, part.loops, part.disturbance, references, strict=True
        ):
            found = moment(at, bodies, look(at, reference, state_at(result, k), disturbance))
            yield Moment(*(np.asarray(value)[None] for value in found))


def _together(result: Result, loop: ClosedLoop, visits: Visits) -> Iterator[Moment]:
    """Many rows at a time, of a closed loop that is `stackable`."""
    stack, done, z = Stack(loop), 0, result.outputs.get(ADAPTATION_STATE, result.theta_hat)
    for _, same in groupby(visits.loops, key=id):
        end = done + len([*same])
        for start in range(done, end, stack.instants):
            k, times, loops, disturbance = visits.part(start, min(start + stack.instants, end))
            state = np.stack((result.q[k], result.v[k])), z[k], result.sync_integral[k]
            yield moment(loops[0], stack, stack.look(loops[0], times, *state, disturbance))
        done = end


def state_at(result: Result, k: int) -> np.ndarray:
    """The state of the loop at logged instant k."""
    z = result.outputs.get(ADAPTATION_STATE, result.theta_hat)[k]
    memory = result.outputs.get(NETWORK_STATE, result.sync_integral)[k]
    hidden = result.outputs[PLANT_STATE][k] if PLANT_STATE in result.outputs else np.zeros(0)
    parts = result.q[k], result.v[k], z, memory, hidden
    return np.concatenate([part.ravel() for part in parts])


def _names(loop: ClosedLoop, result: Result) -> tuple[tuple[str, ...], ...]:
    """What the storage of the adaptation changes by, and energies and powers of a closed chain, by name."""
    y = loop.initial_state()
    y_dot, signals = loop.evaluate(loop.cell.references(result.t[:1])[0], y, result.disturbance[0])
    state, energies = loop.state(y), getattr(loop.chain, "energies", None)
    powers = tuple(loop.controller.adaptation.powers(state.z, loop.cell.theta, signals.seen))
    if energies is None:
        return powers, (), ()
    terms = energies.terms(state, loop.state(y_dot).v, signals)
    return powers, tuple(terms.energies), tuple(terms.powers)
