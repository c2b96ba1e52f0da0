"""The true cell: rigid-body dynamics of every robot, with friction the controller does not know."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from functools import cached_property, partial
from typing import Any, Self

import numpy as np

from ..checks import choice, instance
from ..coupling.cell import Cell
from ..errors import InputError
from ..robots.forest import forests
from ..robots.friction import friction_torque
from ..robots.mechanism import joint_limits
from ..robots.robot import Robot
from ..tasks.algebra import padded
from .schedules import Payload, PayloadSchedule

Output = tuple[np.ndarray, str, tuple[str, ...]]
"""An array over time, its unit, and the names of its axes, the first of which is "time"."""
Dynamics = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""Positions, velocities and torques of the joints of all robots, (n, nv), -> accelerations, (n, nv)."""


def pinocchio_dynamics(robots: Sequence[Robot]) -> Dynamics:
    """Forward dynamics by Pinocchio's articulated-body algorithm."""
    parts = forests(robots)
    return parts[0][1].acceleration if len(parts) == 1 else partial(_by_part, parts)


def mujoco_dynamics(robots: Sequence[Robot]) -> Dynamics:
    """Forward dynamics by MuJoCo, from its own reading of the robots' URDF."""
    from .mujoco import MujocoArm

    return partial(_by_part, [(slice(i, i + 1), MujocoArm(robot)) for i, robot in enumerate(robots)])


def _by_part(parts: Any, q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """Accelerations put together from those of some robots at a time."""
    v_dot = np.zeros(q.shape)
    for rows, part in parts:
        k = part.nv
        v_dot[rows, :k] = part.acceleration(q[rows, :k], v[rows, :k], tau[rows, :k])
    return v_dot


#: what of a plant says how it moves
MOVING = frozenset({"move", "friction", "_dynamics"})
#: libraries that can compute the plant
PHYSICS: dict[str, Callable[[Sequence[Robot]], Dynamics]] = {
    "pinocchio": pinocchio_dynamics,
    "mujoco": mujoco_dynamics,
}


def torque_limits(cell: Cell) -> np.ndarray:
    """Torque limits of all robots, (n, nv), N·m; infinite where there is none."""
    limits = np.full((cell.n, cell.nv), np.inf)
    for i, robot in enumerate(cell.robots):
        limits[i, : robot.nv] = joint_limits(robot).torque
    return limits


class Plant:
    """Accelerations of all robots under torque and friction, with the payloads they carry.

    A plant of one's own is a subclass. It may have a state of its own, an array of numbers that goes through
    time with the robots: of motors that lag, of joints that the controller does not know. It overrides

    - `hidden0`: that state at t = 0, (k,);
    - `events` and `meet`: instants at which its state moves at once, by an impact or a catch, and how;
    - `move`: accelerations and the rate of that state, (k,), both finite and without side effects, for a
      method asks at states where the run never comes; what the package's plant does is `super().move(...)`;
    - `outputs`: arrays over time that the result gets beside those of every run, with units and axes;
    - `felt`: the internal wrenches that hands measure, if any do;
    - `chain`: what is proved if the robots hold one object together;
    - `longest_step`: how long a step of "rk4" may be, if that is known beforehand;
    - `report`: what `result.info` says of the state in plain data;
    - `account`: both of these, if more of the log than that state is needed for them.

    Nothing else is asked of it. The state is logged as `outputs["plant_state"]`, so that a run can be gone
    through again; a certificate names the plant beside the power of what it does and the model does not.
    The compiled engine takes a subclass that only tells, by `outputs`, `report` and `account`, and refuses
    others by name.

    Args:
        cell: the robots, with their true parameters and friction.
        physics: library that computes it, one of `PHYSICS`.
        payloads: what the robots pick up and put down.
        saturate: whether torques are cut off at the limits of the robots' descriptions.
        robots: what really stands there, if it is not what the controller knows.

    Raises:
        InputError: an unknown library, or payloads that do not fit.

    Attributes:
        viscous, coulomb: coefficients of friction, (n, nv), N·m·s/rad and N·m.
        smoothing: velocity at which Coulomb friction reaches tanh(1) of its value, (n, nv), rad/s.
        rubs: whether any joint has friction.
        torque_limits: (n, nv), N·m; infinite without saturation.
        robots: what stands there, with the loads it carries now.
        payloads: the payloads.
        schedule: when they are carried.
    """

    #: state of its own at t = 0, for instance of joints the controller does not know
    hidden0 = np.zeros(0)
    #: instants at which `meet` is called, s; those before t = 0 and from the end of a run on do not come
    events: Sequence[float] = ()

    def __init__(
        self,
        cell: Cell,
        *,
        physics: str = "pinocchio",
        payloads: Sequence[Payload] = (),
        saturate: bool = False,
        robots: Sequence[Robot] | None = None,
    ):
        instance("cell", cell, Cell, "a Cell")
        instance("payloads", payloads, Sequence, "a sequence of Payload objects")
        self.cell, self.physics = cell, choice("plant", physics, tuple(PHYSICS))
        self.payloads, self.saturate = tuple(payloads), saturate
        self.schedule = PayloadSchedule(cell.robots if robots is None else robots, self.payloads)
        self.robots = self.schedule.robots[0]
        self._set_friction()
        self.torque_limits = torque_limits(cell) if saturate else np.full((cell.n, cell.nv), np.inf)
        self._stages: dict[int, Any] = {0: self}

    # -- what happens -------------------------------------------------------------------------------------

    def at(self, t: float) -> Self:
        """The plant as it is at time t: with the payloads carried then; at an edge from the right."""
        if not self.schedule.edges:
            return self
        window = int(self.schedule.windows(np.array(t)))
        if window not in self._stages:
            self._stages[window] = self._stage(window)
        return self._stages[window]

    def applied(self, tau: np.ndarray) -> np.ndarray:
        """What reaches the joints of torques tau that the controller commands, (..., n, nv), N·m."""
        return np.clip(tau, -self.torque_limits, self.torque_limits) if self.saturate else tau

    def acceleration(self, q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """v', (n, nv), under joint torques tau, (n, nv), and friction; the plant's own state as at t = 0."""
        return self.move(q, v, tau, self.hidden0)[0].copy()

    def prepare(self) -> Dynamics:
        """What moves the robots now, made if it was not: a library that refuses one of them says so here."""
        return self._dynamics

    def check_robots(self) -> None:
        """Ask a library that may refuse a robot, before a run; the one that made their models refuses none.

        Raises:
            MissingDependencyError, InputError: it is not there, or refuses a robot.
        """
        if self.physics != "pinocchio":
            self.prepare()

    def move(
        self, q: np.ndarray, v: np.ndarray, tau: np.ndarray, hidden: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """v' and the rate of the plant's own state, which is 0 here; valid until the next call.

        Args:
            q, v: joint positions and velocities, (n, nv), rad and rad/s.
            tau: torque that reaches the joints, with that from outside, (n, nv), N·m.
            hidden: the plant's own state, of the size of `hidden0`.
        """
        at_rest = np.zeros_like(hidden) if hidden.size else hidden
        return self._dynamics(q, v, tau - self.friction(v) if self.rubs else tau), at_rest

    def meet(
        self, t: float, q: np.ndarray, v: np.ndarray, hidden: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The state after the event at time t, x+, of the one before it, x-; without side effects.

        Runs ask the plant as it is from t on, `at(t)`, and go on from x+, which is what they log.

        Args:
            t: one of `events`, s.
            q, v: joint positions and velocities, (n, nv), rad and rad/s.
            hidden: the plant's own state, of the size of `hidden0`.
        """
        return q, v, hidden

    def longest_step(self, K_r: np.ndarray) -> float:
        """The longest step of "rk4" with which the plant is stable, s; longer ones are refused before a run.

        Args:
            K_r: damping of the controller in joint space, (n, nv), N·m·s/rad; zeros where it has none there.
        """
        return float("inf")

    def felt(self, q: np.ndarray, v: np.ndarray, hidden: np.ndarray) -> np.ndarray:
        """Internal wrenches that the hands measure, for an admittance; arguments as of `move`.

        Returns:
            One row per robot, about the origin of what they hold, in world axes, (n, 6), N and N·m.

        Raises:
            InputError: this plant measures none.
        """
        text = f"an admittance expects a plant that measures wrenches, found {type(self).__qualname__}"
        raise InputError(text, subject="admittance", found=type(self).__qualname__)

    def chain(self, controller: Any) -> Any:
        """What theorems say of a controller whose robots hold one object together; None if they do not.

        It has `theorem`, `warnings` and `outside`, see `ClosedChain` of the assembly.

        Raises:
            InputError: robots and object with which a run of this controller means nothing.
        """
        return None

    def friction(self, v: np.ndarray) -> np.ndarray:
        """Torque by which friction opposes the velocities v, (n, nv), N·m."""
        return friction_torque(v, self.viscous, self.coulomb, self.smoothing)

    def outputs(self, hidden: np.ndarray) -> dict[str, Output]:
        """Further arrays over time that a result gets, of the plant's own state, (T, size of the state).

        Returns:
            Under each name an array, its unit, and the names of its axes, the first of which is "time".
        """
        return {}

    def report(self, hidden: np.ndarray) -> dict[str, Any]:
        """What a result says of the plant's own state at its logged instants, (T, size of the state)."""
        return {}

    def account(self, log: Mapping[str, np.ndarray]) -> tuple[dict[str, Any], dict[str, Output]]:
        """What a result says and gets at its logged instants: `report` and `outputs`, of more of the log.

        Args:
            log: arrays of `Result` by name, those that its adaptation adds, and "plant_state"; the torque
                that reached the joints is `applied(log["tau"]) + log["disturbance"]`.
        """
        return self.report(log["plant_state"]), self.outputs(log["plant_state"])

    # -- internals ----------------------------------------------------------------------------------------

    def _set_friction(self) -> None:
        members = [(member.robot.nv, member.friction) for member in self.cell.members]
        self.viscous = padded([np.broadcast_to(friction.viscous, nv) for nv, friction in members])
        self.coulomb = padded([np.broadcast_to(friction.coulomb, nv) for nv, friction in members])
        self.smoothing = np.repeat([[friction.smoothing] for _, friction in members], self.cell.nv, axis=1)
        self.rubs = bool(self.viscous.any() or self.coulomb.any())

    @cached_property
    def _dynamics(self) -> Dynamics:
        """What moves the robots that stand there now."""
        return PHYSICS[self.physics](self.robots)

    def _stage(self, window: int) -> Self:
        """A copy with the loads of another window."""
        stage = copy(self)
        stage.robots = self.schedule.robots[window]
        vars(stage).pop("_dynamics", None)
        return stage
