"""What a base experiment is, as plain data that can be compared with what a folder says."""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np

from ..simulation.recorder import describe
from ..simulation.schedules import DisturbanceSchedule
from .factors import Setup

#: instants at which desired motion and closed loop are looked at
INSTANTS = 40
#: digits that count: fewer than those in which machines may differ
DIGITS = 9


def describe_base(setup: Setup) -> dict[str, Any]:
    """Names, gains and options of an experiment, and digests of what cannot be told in words."""
    experiment = setup.experiment
    loop, cell = experiment.closed_loop(), experiment.cell
    schedule = DisturbanceSchedule(cell, experiment.disturbances)
    times = np.linspace(0, setup.duration, INSTANTS)
    described = {key: value for key, value in describe(loop).items() if key != "versions"}
    table = cell.reference_table(times)
    disturbances = [np.array(schedule.edges), schedule.torques]
    return {
        **described,
        "digest": {
            "initial state": digest([loop.initial_state()]),
            "desired motion": digest([table.xd, table.xd_dot, table.xd_ddot]),
            "weights": digest([table.c, table.c_dot, table.c_ddot]),
            "disturbances": digest(disturbances),
            "dynamics": digest(_flow(setup, times)),
        },
    }


def digest(arrays: Any) -> str:
    """A short digest of arrays, to the digits that count; -0 counts as 0."""
    rows = (" ".join(f"{value + 0.0:.{DIGITS - 1}e}" for value in array.ravel()) for array in arrays)
    text = "\n".join(rows)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _flow(setup: Setup, times: np.ndarray) -> list[np.ndarray]:
    """y' of the closed loop at some instants, near its initial state: robots, friction, options and all.

    Events of the plant come after it, each with what it makes of such a state.
    """
    loop = setup.experiment.closed_loop()
    rng = np.random.default_rng(0)
    y, none = loop.initial_state(), np.zeros((loop.cell.n, loop.cell.nv))
    spread = 0.01 * _used(loop)
    flow = [
        loop.at(float(t)).evaluate(reference, y + spread * rng.standard_normal(y.size), none)[0]
        for t, reference in zip(times, loop.cell.references(times), strict=True)
    ]
    for t in loop.events.tolist():
        state = loop.state(y + spread * rng.standard_normal(y.size))
        loop.at(t).meet(t, state)
        flow += [np.array([t]), state.flat]
    return flow


def _used(loop: Any) -> np.ndarray:
    """1 for joints that a robot has, 0 for padding and everything that is no joint."""
    used = np.zeros(loop.size)
    for part in loop.split(used)[:2]:
        for i, robot in enumerate(loop.cell.robots):
            part[i, : robot.nv] = 1
    return used
