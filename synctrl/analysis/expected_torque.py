"""How much torque a run will take, before it runs: what the path takes, and what small errors add at first.

The path takes inverse dynamics of the true robots, and friction. Errors of the start, of positions,
velocities and parameters, are those of the linear loop held there, see `linear_loop`; they add their torque:

    tau = tau_path(t) - M y''_c(t),    (W, y, y', p) = e^(A t) (0, q^d - q, v^d - v, Y (theta - theta_hat))

with y''_c the part of y'' that torque gives. At t = 0 it is the torque of the controller itself.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..control.excursion import Excursion, path
from ..coupling.cell import Cell
from ..simulation.closed_loop import ClosedLoop
from ..simulation.plant import torque_limits
from .linear_loop import LinearLoop

#: instants of the path, and of each of the stretches in which errors are looked at
INSTANTS, STRETCH = 61, 60
#: stretches of time, the first of which is so many times 1/(largest rate)
STRETCHES, FIRST = 4, 10.0


@dataclass(frozen=True, eq=False)
class ExpectedTorque:
    """The largest torque of every joint, all (n, nv), N·m, or N of joints that slide.

    Attributes:
        path: that the desired motion takes.
        first: at t = 0.
        peak: of all, with what errors of the start add on the way.
        gravity: that holds the robots on their paths.
        stretch: how many times as long the desired motion has to take, so that it stays within the limits; 1
            where it does, infinite where it never will.
        limit: of the robots' descriptions, infinite without one.
    """

    path: np.ndarray
    first: np.ndarray
    peak: np.ndarray
    gravity: np.ndarray
    limit: np.ndarray
    stretch: float

    @property
    def share(self) -> np.ndarray:
        """Peak over limit, (n, nv)."""
        return self.peak / self.limit


def on_path(cell: Cell, duration: float) -> tuple[np.ndarray, Excursion]:
    """Instants of the path, (K,), s, either side of where it is not smooth, and the states there."""
    edges = np.array([b for b in cell.breaks if 0 < b < duration])
    times = np.concatenate((np.linspace(0.0, duration, INSTANTS), edges, edges * (1 - 1e-9)))
    times = np.unique(times)
    return times, path(cell, times)


def expected_torque(
    loop: ClosedLoop, linear: LinearLoop, times: np.ndarray, states: Excursion
) -> ExpectedTorque:
    """The torque that a cell will take.

    Args:
        loop: its closed loop.
        linear: the same, linear, held where it starts.
        times, states: of the path.
    """
    along, gravity = path_torque(loop, times, states)
    rough, there = _without_errors(loop, along, gravity), existing(loop.cell)
    later, added = _added(linear, first_errors(loop, linear), float(times[-1]))
    on = np.stack([np.interp(later, times, row) for row in along[:, there].T], axis=-1)
    peak = rough.peak.copy()
    peak[there] = np.maximum(peak[there], np.abs(on + added).max(axis=0))
    return replace(rough, peak=peak)


def rough_torque(loop: ClosedLoop, times: np.ndarray, states: Excursion) -> ExpectedTorque:
    """The same without what errors add after t = 0, for cells with very many joints."""
    return _without_errors(loop, *path_torque(loop, times, states))


def _without_errors(loop: ClosedLoop, along: np.ndarray, gravity: np.ndarray) -> ExpectedTorque:
    reference = loop.cell.references(np.zeros(1))[0]
    first = np.abs(loop.look(reference, loop.state(loop.initial_state())).tau)
    most, held, limit = np.abs(along).max(axis=0), np.abs(gravity).max(axis=0), torque_limits(loop.cell)
    stretch = _stretch(along, gravity, limit)
    return ExpectedTorque(most, first, np.maximum(first, most), held, limit, stretch)


def _stretch(along: np.ndarray, gravity: np.ndarray, limit: np.ndarray) -> float:
    """What moves a robot falls with the square of the time that it takes, what holds it does not."""
    moving = along - gravity
    room = np.where(moving > 0, limit - gravity, limit + gravity)
    if (room <= 0).any():
        return np.inf
    return float(np.sqrt(max(1.0, np.max(np.abs(moving) / room))))


def existing(cell: Cell) -> np.ndarray:
    """Which joints there are, (n, nv), bool."""
    return np.arange(cell.nv) < np.array([[robot.nv] for robot in cell.robots])


def path_torque(loop: ClosedLoop, times: np.ndarray, states: Excursion) -> tuple[np.ndarray, np.ndarray]:
    """Torque of the true robots and their friction on the path, and that of gravity, (K, n, nv) each."""
    torque, gravity = np.zeros((2, *states.q.shape))
    for k, t in enumerate(times):
        plant = loop.plant.at(float(t))
        for i, (real, robot) in enumerate(zip(plant.robots, loop.cell.robots, strict=True)):
            robot = real if real.nv == robot.nv else robot  # a plant may have joints of its own
            q, v, a = (part[k, i, : robot.nv] for part in states[:3])
            torque[k, i, : robot.nv] = robot.inverse_dynamics(q, v, a)
            gravity[k, i, : robot.nv] = robot.gravity(q)
        torque[k] += plant.friction(states.v[k])
    return torque, gravity


def first_errors(loop: ClosedLoop, linear: LinearLoop) -> np.ndarray:
    """x at the start, (X,)."""
    cell = loop.cell
    reference, still = cell.references(np.zeros(1))[0], np.zeros((cell.n, cell.m))
    signals = loop.look(reference, loop.state(loop.initial_state()))
    to_joints, task, there = cell.task.to_joints, signals.task, existing(cell)
    y = to_joints(task, task.e, still)[0] - to_joints(task, still, still)[0]
    y_dot = to_joints(task, *task.rates)[0] - cell.v0
    lacking = np.matvec(signals.Y, cell.theta - signals.theta_hat)
    x = np.zeros(len(linear.A))
    for part, row in zip(linear.parts[1:], (y, y_dot, lacking), strict=True):
        x[part] = row[there]
    return x


def _added(linear: LinearLoop, x: np.ndarray, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Times, (K,), and the torque that errors add then, (K, J), through stretches of growing steps."""
    from scipy.linalg import expm

    rows = -linear.M @ linear.asked
    shortest = min(FIRST / float(np.abs(linear.poles).max()), duration)
    times, found = [0.0], [rows @ x]
    for end in np.geomspace(shortest, duration, STRETCHES):
        h = (end - times[-1]) / STRETCH
        step = np.asarray(expm(h * linear.A))
        for _ in range(STRETCH if h > 0 else 0):
            x = step @ x
            times.append(times[-1] + h)
            found.append(rows @ x)
    return np.array(times), np.array(found)
