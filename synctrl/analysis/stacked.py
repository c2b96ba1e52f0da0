"""The closed loop at many instants at once.

The formulas of controller, coupling and adaptation are array arithmetic on one row per robot, and do not mind
an axis of time in front of the rows. Pinocchio does: it is asked for a few instants at a time, by a cell in
which every robot stands as often. What comes out is what `look` says of these instants one after another.

Only what is known to be such arithmetic is asked in this way, see `stackable`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..control.adaptation.gradient import BoundGradient, MetricGradient
from ..control.controller import Controller, Signals
from ..control.laws.chung_slotine import BoundChungSlotine
from ..control.laws.classic import BoundComputedTorque, BoundPDGravity, BoundSlotineLi
from ..control.laws.sun_mills import BoundInjection, BoundSunMills
from ..control.network import BoundIdeal
from ..coupling.cell import Reference
from ..coupling.weights import StillWeights
from ..robots.base_parameters import BaseParameters
from ..robots.forest import SMALL
from ..robots.parameters import FrictionParameters, FullParameters, LinearParameters
from ..robots.regressors import make_regressors
from ..robots.robot import Robot
from ..simulation.closed_loop import ClosedLoop
from ..simulation.plant import Plant
from ..tasks.measurement import Poses, Positions, Tips
from ..tasks.pose import PoseSpace
from ..tasks.spaces import BoundSpace, CartesianSpace, JointSpace
from .model_torques import Robots
from .moment import Look

#: joints that Pinocchio is asked for together, where no regressors are; more take longer to put side by side
JOINTS = 48
#: numbers in the regressors of the instants that are looked at together
ENTRIES = 2**20
_SPACES = JointSpace, CartesianSpace, PoseSpace
_ADAPTATIONS = MetricGradient, BoundGradient
_PARAMETERS = FullParameters, LinearParameters, BaseParameters
_LAWS = (
    BoundSunMills,
    BoundInjection,
    BoundChungSlotine,
    BoundSlotineLi,
    BoundComputedTorque,
    BoundPDGravity,
)


def stackable(loop: ClosedLoop) -> bool:
    """Whether every part of a closed loop is one whose formulas are known to take an axis of time."""
    controller, plant, cell = loop.controller, loop.plant, loop.cell
    rigid = [type(getattr(p, "base", p)) for p in cell.parameters if isinstance(p, FrictionParameters)]
    rigid += [type(p) for p in cell.parameters if type(p) is not FrictionParameters]
    kinds = {type(plant): (Plant,), type(controller): (Controller,), type(cell.space): _SPACES}
    kinds |= {type(controller.network): (BoundIdeal,), type(controller.law): _LAWS}
    kinds |= {type(controller.adaptation): _ADAPTATIONS, **dict.fromkeys(rigid, _PARAMETERS)}
    ours = all(kind in known for kind, known in kinds.items())
    return ours and plant.physics == "pinocchio" and controller.admittance is None and loop.chain is None


class Stack:
    """The closed loop of a cell at many instants; arrays have an axis of time before that of the robots.

    Args:
        loop: the closed loop, `stackable`.
    """

    def __init__(self, loop: ClosedLoop):
        cell = loop.cell
        joints = sum(robot.nv for robot in cell.robots)
        self.loop, self.copies, few = loop, max(1, JOINTS // joints), max(1, SMALL // joints)
        self.instants = max(1, ENTRIES // (cell.n * cell.nv * cell.theta.shape[1]))
        self._controller = copy(loop.controller)
        bound: Any = SimpleNamespace(task=self._space(), robots=cell.robots, parameters=cell.parameters)
        self._controller.cell = bound
        compute = make_regressors(cell.parameters * few, [robot.nv for robot in cell.robots] * few)
        vars(self._controller)["_compute_regressors"] = over_time(compute, few)
        self._bodies = Robots(cell.robots * self.copies)
        self._dynamics = {cell.robots: over_time(self._bodies.accelerations, self.copies)}

    def look(
        self, loop: ClosedLoop, times: np.ndarray, motion: np.ndarray, z: np.ndarray, memory: np.ndarray,
        disturbance: np.ndarray,
    ) -> Look:  # fmt: skip
        """What the closed loop says at T instants between which nothing is picked up or put down.

        Args:
            loop: the closed loop as it is then.
            times: of what is desired, (T,), s.
            motion: joint positions and velocities, (2, T, n, nv).
            z: state of the adaptation, (T, n, Z).
            memory: integrals of the synchronization errors, (T, p, m).
            disturbance: torque from outside, (T, n, nv), N·m.
        """
        s: Signals = self._controller.signals(self._reference(times), motion, z, memory)
        q, v = motion
        v_dot = self._accelerations(loop.plant, q, v, loop.plant.applied(s.tau) + disturbance)
        nothing = np.zeros((len(times), 0))
        gaps = np.zeros_like(s.a_ref), np.zeros_like(s.E)
        return Look(q, v, v_dot, z, s, disturbance, *gaps, nothing, nothing, nothing)

    # -- bodies -------------------------------------------------------------------------------------------

    def dynamics(self, q: np.ndarray, v: np.ndarray, s_q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mass matrices, (T, n, nv, nv), and C s_q, (T, n, nv)."""
        M, C_s = in_blocks(self._bodies.dynamics, self.copies, q, v, s_q)
        return M, C_s

    def torque(self, q: np.ndarray, v: np.ndarray, v_ref: np.ndarray, a_ref: np.ndarray) -> np.ndarray:
        """M a_ref + C v_ref + g, (T, n, nv)."""
        return over_time(self._bodies.torque, self.copies)(q, v, v_ref, a_ref)

    # -- internals ----------------------------------------------------------------------------------------

    def _space(self) -> BoundSpace:
        """The space of the cell, bound to its robots over time."""
        cell = self.loop.cell
        if isinstance(cell.space, JointSpace):
            return cell.task
        space: Any = cell.space
        joints = [[robot.nv] for robot in cell.robots]
        return space.over(_Tips(cell.robots, self.copies), joints, space.redundancy.spread(cell.robots))

    def _reference(self, times: np.ndarray) -> Reference:
        """What is desired at all instants, (3, T, n, m), and its weights."""
        cell = self.loop.cell
        table = cell.reference_table(times)
        desired = np.ascontiguousarray(table.desired.swapaxes(0, 1))
        still = StillWeights(*(weight[0] for weight in table.weights)) if cell.coupling.is_constant else None
        return Reference(desired, still or table.weights, times)

    def _accelerations(self, plant: Plant, q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> np.ndarray:
        robots = tuple(plant.robots)
        if robots not in self._dynamics:
            self._dynamics[robots] = over_time(Robots(robots * self.copies).accelerations, self.copies)
        return self._dynamics[robots](q, v, tau - plant.friction(v) if plant.rubs else tau)


class _Tips:
    """`Tips` of robots at many instants.

    Args:
        robots: the robots.
        copies: how many instants Pinocchio is asked for at once.
    """

    def __init__(self, robots: Sequence[Robot], copies: int):
        self._tips, self._copies = Tips(tuple(robots) * copies), copies

    def positions(self, q: np.ndarray, v: np.ndarray) -> Positions:
        p, p_dot, J, J_dot = in_blocks(self._positions, self._copies, q, v)
        return np.stack((p, p_dot)), J, J_dot

    def poses(self, q: np.ndarray, v: np.ndarray) -> Poses:
        p, p_dot, R, J, J_dot = in_blocks(self._poses, self._copies, q, v)
        return np.stack((p, p_dot)), R, J, J_dot

    def _positions(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, ...]:
        motion, *others = self._tips.positions(q, v)
        return (*motion, *others)

    def _poses(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, ...]:
        motion, *others = self._tips.poses(q, v)
        return (*motion, *others)


def in_blocks(
    function: Callable[..., Sequence[np.ndarray]], copies: int, *arrays: np.ndarray
) -> list[np.ndarray]:
    """Ask a function of some instants at a time for all of them.

    Args:
        function: of arrays with a row per robot and instant, (copies n, ...); it gives some arrays of as many
            rows, which it may write over with its next call.
        copies: how many instants it takes at once.
        arrays: its arguments at T instants, (T, n, ...).

    Returns:
        What it gives, (T, n, ...) each.
    """
    T, n = arrays[0].shape[:2]
    short = -T % copies  # the last block is filled up with its last instant
    filled = [np.concatenate((x, x[-1:].repeat(short, axis=0))) if short else x for x in arrays]
    blocks = [x.reshape(-1, copies * n, *x.shape[2:]) for x in map(np.ascontiguousarray, filled)]
    found: list[np.ndarray] = []
    for k, block in enumerate(zip(*blocks, strict=True)):
        values = function(*block)
        found = found or [np.empty((len(blocks[0]), *value.shape)) for value in values]
        for place, value in zip(found, values, strict=True):
            place[k] = value
    return [x.reshape(-1, n, *x.shape[2:])[:T] for x in found]


def over_time(function: Callable[..., np.ndarray], copies: int) -> Callable[..., np.ndarray]:
    """A function of some instants at a time that gives one array, as one of any number of instants."""
    return lambda *arrays: in_blocks(lambda *rows: (function(*rows),), copies, *arrays)[0]
