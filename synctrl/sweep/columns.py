"""Columns: quantities of many runs of one experiment at once, an array with a row per run for each.

A factor whose values only change numbers that the compiled engine reads writes columns of them, instead of an
experiment per run. The arrays are those that it would have of the changed experiments, bit for bit. Runs that
columns cannot speak for are left to be made one by one: values that an experiment would refuse, for example.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..control.adaptation.gradient import BoundGradient
from ..control.laws.sun_mills import BoundSunMills
from ..control.network import BoundIdeal
from ..errors import InputError
from ..robots.parameters import FrictionParameters, Parameters
from ..simulation.closed_loop import ClosedLoop
from ..simulation.engines import Run
from ..simulation.plant import Plant
from .variations import fitted, states_of

#: how a column of values, (count,), changes columns of quantities
ColumnChange = Callable[["Columns", np.ndarray], None]
#: gains that the law reads at every instant
OF_LAW = "Lambda", "beta", "K_eps", "K_r"
#: what the paper's adaptation adds; others may be made of it in ways that are not known here
OF_START = "Gamma", "q", "v", "z", "theta", "pi"


def apart(columns: Columns, values: np.ndarray) -> None:
    """The change of a factor that touches nothing that columns hold, such as a law or a control period.

    Runs with equal values of such factors share a base run, of which the columns of all others are.
    """


class Columns:
    """Quantities of some runs that differ from a base run in numbers alone.

    Args:
        run: the base run.
        count: number of runs.

    Attributes:
        run, count: as given.
        left: which runs are left to be made one by one, (count,).

    `columns[name]` is the array of a quantity, (count, rows, columns), to be changed in place: a gain of the
    controller, "q", "v" and "z" at the start, true inertial parameters "pi", or the true values "theta" of
    what is adapted.
    """

    def __init__(self, run: Run, count: int):
        self.run, self.count = run, count
        self.left = np.zeros(count, dtype=bool)
        self._held, self._arrays = held(run.loop), dict[str, np.ndarray]()
        self._torques: dict[int, np.ndarray] = {}
        self._moved: set[int] = set()  # robots whose theta does not follow their pi yet

    def leave(self, where: np.ndarray) -> None:
        """Leave runs, (count,), to be made one by one."""
        self.left |= where

    def __getitem__(self, name: str) -> np.ndarray:
        """The array of a quantity.

        Raises:
            InputError: columns cannot speak for it in runs of this kind.
        """
        if name not in self._held:
            raise InputError.expected(f"one of {', '.join(self._held)}", name, "columns")
        if name not in self._arrays:
            self._arrays[name] = self._repeated(_base(name, self.run.loop))
        if name == "theta":
            self._follow()
        return self._arrays[name]

    def torque(self, disturbance: int) -> np.ndarray:
        """Torque of a disturbance, (count, nv) or (count, 1), N·m, to be changed in place."""
        if disturbance not in self._torques:
            torque = np.atleast_1d(self.run.experiment.disturbances[disturbance].torque)
            self._torques[disturbance] = self._repeated(torque)
        return self._torques[disturbance]

    def moved(self, robot: int) -> None:
        """Say that the true inertial parameters of a robot are others now, and with them its theta."""
        self._moved.add(robot)

    def arrays(self) -> dict[str, np.ndarray]:
        """What differs from the base run in the runs that are not left, by the names of the engine.

        Runs with numbers that are not finite, which an experiment refuses, are left from here on.
        """
        found = {name: array for name, array in self._arrays.items() if name != "theta"}
        if self._torques:
            found["disturbance"] = self._disturbance()
        if "pi" in found:
            found["pi"] = found["pi"][:, None]
        for array in found.values():
            self.leave(~np.isfinite(array.reshape(self.count, -1)).all(axis=1))
        return {name: array[~self.left] for name, array in found.items()}

    # -- internals ----------------------------------------------------------------------------------------

    def _repeated(self, base: np.ndarray) -> np.ndarray:
        return np.repeat(base[None], self.count, axis=0)

    def _follow(self) -> None:
        """Make theta of robots that moved what it is for their inertial parameters now."""
        if not self._moved:
            return
        cell, pi = self.run.loop.cell, self["pi"]
        for i in sorted(self._moved):
            true = pi[:, i, : 10 * cell.robots[i].body_count]
            found = _true_values(cell.parameters[i], true)
            self._arrays["theta"][:, i, : found.shape[1]] = found
        self._moved.clear()

    def _disturbance(self) -> np.ndarray:
        """Torques on all joints, (count, windows, n, nv), added as `DisturbanceSchedule` does."""
        schedule, robots = self.run.schedule, self.run.loop.cell.robots
        found = np.zeros((self.count, *schedule.torques.shape))
        for window, begin in enumerate((0.0, *schedule.edges)):
            for k, each in enumerate(self.run.experiment.disturbances):
                if each.start <= begin < each.stop:
                    found[:, window, each.robot, : robots[each.robot].nv] += self.torque(k)
        return found


def held(loop: ClosedLoop) -> tuple[str, ...]:
    """Names of the quantities that columns can speak for in runs of a closed loop."""
    controller, plant = loop.controller, loop.plant
    known = type(controller.law) is BoundSunMills and type(controller.network) is BoundIdeal
    if not known or type(plant) is not Plant or controller.admittance is not None or plant.payloads:
        return ()
    return OF_LAW + (OF_START if type(controller.adaptation) is BoundGradient else ())


def _base(name: str, loop: ClosedLoop) -> np.ndarray:
    """What all runs start from, (rows, columns)."""
    cell, controller = loop.cell, loop.controller
    if name in OF_LAW:
        return np.atleast_2d(getattr(controller, name))
    adaptation: Any = controller.adaptation
    if name == "pi":
        return true_parameters(loop.plant.robots)
    starts = {"q": cell.q0, "v": cell.v0, "theta": cell.theta}
    return adaptation.Gamma if name == "Gamma" else adaptation.start() if name == "z" else starts[name]


def true_parameters(robots: Any) -> np.ndarray:
    """Inertial parameters of robots, (n, 10 bodies of the largest)."""
    pi = np.zeros((len(robots), 10 * max(robot.body_count for robot in robots)))
    for row, robot in zip(pi, robots, strict=True):
        row[: 10 * robot.body_count] = robot.inertial_parameters
    return pi


def _true_values(parameters: Parameters, pi: np.ndarray) -> np.ndarray:
    """theta for true inertial parameters pi, (count, 10 bodies), without what there is of friction."""
    rigid = parameters.base if isinstance(parameters, FrictionParameters) else parameters
    matrix = getattr(rigid, "matrix", None)
    if matrix is None:
        return pi
    Y = states_of(rigid.robot)  # type: ignore[attr-defined]
    return np.array([fitted(matrix, Y, each) for each in pi])
